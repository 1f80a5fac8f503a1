"""The basic elements as plug-ins of the package mauve_rt: in architecture files, with cores in Python."""

import itertools
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist, Vector3
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from waiting import wait_until

from mauve_rt._kernel import Deployer, PluginRegistry
from mauve_rt.model import load_architecture
from mauve_rt.model.build import build
from mauve_rt.model.plugins import INDEX_RESOURCE, PluginIndex, PluginLoader, parse_index
from mauve_rt.parts import ament_index
from mauve_rt.parts.cores import Core, core_factory
from mauve_rt.parts.message_types import message_class
from mauve_rt.parts.resources import read_resource

FILTER_SHELL = "mauve_rt/Float64FilterShell"

TELEOPERATION = """\
mauve: 1
components:
  mux:
    shell: mauve_rt/TwistPriorityMultiplexerShell
    core: mauve_rt/TwistPriorityMultiplexer
    fsm: mauve_rt/TwistPriorityMultiplexerFsm
    properties: {period_us: 1000, max_age_0_ms: 0, max_age_1_ms: 0}
resources:
  joystick: {kind: shared_data, type: geometry_msgs/msg/Twist}
  autonomy: {kind: shared_data, type: geometry_msgs/msg/Twist}
  command: {kind: shared_data, type: geometry_msgs/msg/Twist}
connections:
  - [mux.input_0, joystick.read]
  - [mux.input_1, autonomy.read]
  - [mux.output, command.write]
"""

FILTER = """\
mauve: 1
components:
  filter:
    shell: mauve_rt/Float64FilterShell
    core: test/Doubling
    fsm: mauve_rt/Float64FilterFsm
    properties: {period_us: 1000}
resources:
  before: {kind: shared_data, type: std_msgs/msg/Float64}
  after: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [filter.input, before.read]
  - [filter.output, after.write]
"""

RELAY = """\
mauve: 1
components:
  relay:
    shell: mauve_rt/NAMERelayShell
    core: mauve_rt/NAMERelay
    fsm: mauve_rt/NAMERelayFsm
    properties: {period_us: 1000}
resources:
  before: {kind: shared_data, type: TYPE}
  after: {kind: shared_data, type: TYPE}
connections:
  - [relay.input, before.read]
  - [relay.output, after.write]
"""

BESIDE_A_PACKAGE = """\
mauve: 1
components:
  relay:
    shell: mauve_rt/Float64RelayShell
    core: mauve_rt/Float64Relay
    fsm: mauve_rt/Float64RelayFsm
  metronome:
    shell: mauve_examples/MetronomeShell
    core: mauve_examples/Metronome
    fsm: mauve_examples/MetronomeFsm
    properties: {ticks_per_beat: 2}
resources:
  beat: {kind: shared_data, type: std_msgs/msg/Float64}
  relayed: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [metronome.beat, beat.write]
  - [relay.input, beat.read]
  - [relay.output, relayed.write]
"""


class Doubling(Core):
    """All that has to be written for a component of one method."""

    def update(self) -> None:
        self.shell.output.write(Float64(data=2.0 * self.shell.input.read().value.data))


@contextmanager
def deployed(text: str, folder: Path) -> Iterator[Deployer]:
    """The architecture of a file's text, running."""
    file = folder / "architecture.yaml"
    file.write_text(text, encoding="utf-8")
    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("shell", "mauve_rt/Float64FilterShell")
    registry.add_python_core("test/Doubling", "mauve_rt/Float64FilterShell", core_factory(Doubling))
    architecture = build(load_architecture(file), registry)
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.deploy()
    try:
        yield deployer
    finally:
        deployer.shutdown()


def number(deployer: Deployer, resource: str) -> float:
    """The number in a resource."""
    return float(read_resource(deployer, resource, Float64).value.data)


def forward_m_s(deployer: Deployer) -> float:
    """The command that goes to the robot."""
    return float(read_resource(deployer, "command", Twist).value.linear.x)


def _numbered(message: Any) -> Any:
    """The message with another number in each field, so that no two can be mistaken for each other."""
    numbers = itertools.count(1)

    def fill(part: Any) -> Any:
        for field in part.get_fields_and_field_types():
            value = getattr(part, field)
            setattr(part, field, fill(value) if hasattr(value, "SLOT_TYPES") else type(value)(next(numbers)))
        return part

    return fill(message)


def _command(speed_m_s: float) -> bytes:
    return serialize_message(Twist(linear=Vector3(x=speed_m_s)))


def test_what_is_listed_is_what_is_registered():
    file, prefix = next(
        (file, prefix)
        for package, prefix, file in ament_index.resources(INDEX_RESOURCE)
        if package == "mauve_rt"
    )
    listed, complaints = parse_index(file.read_text(encoding="utf-8"), prefix=prefix, origin=str(file))
    assert complaints == []
    registry = PluginRegistry()
    for library in {str(plugin.library) for plugin in listed}:
        registry.load_library(library)
    for kind in ("shell", "core", "fsm", "type"):
        of_kernel = {*PluginRegistry().names(kind)}
        assert {plugin.name for plugin in listed if plugin.kind == kind} == {
            *registry.names(kind)
        } - of_kernel
    for plugin in listed:
        if plugin.kind == "core":
            assert registry.core_shell(plugin.name) == plugin.shell
        if plugin.kind == "fsm":
            assert registry.fsm_shell(plugin.name) == plugin.shell


def test_the_common_types_are_ros_messages():
    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("core", "mauve_rt/TwistRelay")
    for name in registry.names("type"):
        assert message_class(name) is not None, name


@pytest.mark.parametrize("name", ["Bool", "Int64", "Float64", "Point", "Pose", "Pose2D", "Twist"])
def test_a_common_type_is_on_the_wire_as_ros_has_it(name: str, tmp_path: Path):
    package = "std_msgs" if name in ("Bool", "Int64", "Float64") else "geometry_msgs"
    message = _numbered(message_class(f"{package}/msg/{name}")())
    text = RELAY.replace("TYPE", f"{package}/msg/{name}").replace("NAME", name)
    with deployed(text, tmp_path) as deployer:
        assert deployer.write_resource("before", serialize_message(message))
        wait_until(lambda: read_resource(deployer, "after", type(message)).value == message)


@pytest.mark.parametrize("element", ["Multiplexer", "PriorityMultiplexer"])
def test_named_multiplexers_have_four_inputs(element: str):
    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("shell", f"mauve_rt/Pose{element}Shell")
    shell = registry.describe_shell(f"mauve_rt/Pose{element}Shell")
    assert [port.name for port in shell.ports] == ["input_0", "input_1", "input_2", "input_3", "output"]
    assert {port.type for port in shell.ports} == {"geometry_msgs/msg/Pose"}


def test_a_person_s_command_goes_before_the_robot_s(tmp_path: Path):
    with deployed(TELEOPERATION, tmp_path) as deployer:
        deployer.write_resource("autonomy", _command(0.5))
        wait_until(lambda: forward_m_s(deployer) == 0.5)
        deployer.write_resource("joystick", _command(-0.1))
        wait_until(lambda: forward_m_s(deployer) == -0.1)
        deployer.set_property("mux", "max_age_0_ms", 1)  # from now on the joystick's silence counts
        wait_until(lambda: forward_m_s(deployer) == 0.5)


def test_a_core_in_python_needs_but_one_method(tmp_path: Path):
    with deployed(FILTER, tmp_path) as deployer:
        deployer.write_resource("before", serialize_message(Float64(data=21.0)))
        wait_until(lambda: number(deployer, "after") >= 42.0)


def test_elements_work_with_another_package_s_components(tmp_path: Path):
    with deployed(BESIDE_A_PACKAGE, tmp_path) as deployer:
        wait_until(lambda: number(deployer, "relayed") >= 3.0)
