"""A package of its own, tests/downstream: messages as its structs, and its structs as messages."""

import ctypes
import importlib
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from bag_rules import assert_rosbag2_reads
from compiled_plugins import INSTALLED
from rclpy.serialization import deserialize_message, serialize_message
from ros_processes import ExecutorProcess
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.cli.main import main
from mauve_rt.model import build, configure, load_architecture

PACKAGE = Path(__file__).parents[1] / "downstream"
pytestmark = pytest.mark.timeout(300)  # it compiles
LEG_FILE = """\
string<=16 name
geometry_msgs/Point foot
float64[<=3] torque
mauve_downstream/Joint[2] joints
"""
SUM = """\
mauve: 1
components:
  sum: {shell: mauve_downstream/SumShell, core: mauve_downstream/Sum, fsm: mauve_downstream/SumFsm}
resources:
  joints:
    kind: shared_data
    type: sensor_msgs/msg/JointState
    capacity: {name: 3, position: 3, velocity: 3, effort: 3}
  total: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [sum.joints, joints.read]
  - [sum.sum, total.write]
"""
WALK = """\
mauve: 1
components:
  leg: {shell: mauve_downstream/LegShell, core: mauve_downstream/Leg, fsm: mauve_downstream/LegFsm}
  watch: {shell: mauve_downstream/Watch, core: mauve_downstream/Watching, fsm: mauve_downstream/WatchFsm}
resources:
  state: {kind: shared_data, type: mauve_downstream/msg/Leg, topic: {name: leg, direction: publish}}
  distance: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: distance, direction: publish}}
connections:
  - [leg.leg, state.write]
  - [watch.leg, state.read]
  - [watch.distance, distance.write]
"""


def run(*words: str | Path) -> None:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def prefix(tmp_path_factory: pytest.TempPathFactory, plugin_prefix: Path) -> Iterator[Path]:
    """Where the package is installed, searched first: also before what is searched for the whole session."""
    folder, prefix = tmp_path_factory.mktemp("build"), tmp_path_factory.mktemp("install")
    searched = [str(INSTALLED), *os.environ["AMENT_PREFIX_PATH"].split(os.pathsep)]
    options = [
        f"-DCMAKE_PREFIX_PATH={';'.join(searched)}",
        f"-DCMAKE_INSTALL_PREFIX={prefix}",
        f"-DCMAKE_INSTALL_RPATH={prefix}/lib",
        f"-DPython3_EXECUTABLE={sys.executable}",
    ]
    run("cmake", "-G", "Ninja", "-S", PACKAGE, "-B", folder, *options)
    run("cmake", "--build", folder, "--target", "install")
    [modules] = prefix.glob("lib/python3*/site-packages")
    with pytest.MonkeyPatch.context() as patch:
        paths = {"AMENT_PREFIX_PATH": prefix, "PYTHONPATH": modules, "LD_LIBRARY_PATH": prefix / "lib"}
        for name, path in paths.items():
            patch.setenv(name, os.pathsep.join([str(path), os.environ.get(name, "")]))
        patch.syspath_prepend(str(modules))
        # Found by name: this process read LD_LIBRARY_PATH at its start.
        for kind in ("fastrtps", "introspection"):
            ctypes.CDLL(str(prefix / f"lib/libmauve_downstream__rosidl_typesupport_{kind}_c.so"))
        yield prefix


@pytest.fixture
def msg(prefix: Path) -> ModuleType:
    """The classes of the package's messages."""
    return importlib.import_module("mauve_downstream.msg")


@pytest.fixture
def walk(prefix: Path, tmp_path: Path) -> Path:
    """The file of an architecture with a leg in C++, watched in Python."""
    path = tmp_path / "walk.yaml"
    path.write_text(WALK, encoding="utf-8")
    return path


def assert_walked(leg: Any) -> None:
    """As LegCore writes it."""
    assert leg.foot.x >= 1.0
    assert list(leg.torque) == [2.0 * leg.foot.x, -0.5]
    assert leg.name == "front left"
    assert [(joint.angle, joint.is_hot) for joint in leg.joints] == [(0.0, False), (0.25, True)]


def test_a_package_uses_messages_by_one_line_of_cmake(prefix: Path, tmp_path: Path) -> None:
    architecture = tmp_path / "sum.yaml"
    architecture.write_text(SUM, encoding="utf-8")
    assert main(["check", str(architecture)]) == 0  # the structs are those of the messages
    built = build(load_architecture(architecture), PluginRegistry())
    configure(load_architecture(architecture), built)
    simulation = Simulation()
    host = simulation.add(built)
    simulation.deploy()
    assert host.write_resource("joints", serialize_message(JointState(position=[1.0, 2.0, 4.0])))
    simulation.run_until(simulation.now_ns() + 50_000_000)
    message, _, _ = host.read_resource("total")
    assert deserialize_message(message, Float64).data == 7.0
    assert not host.write_resource("joints", serialize_message(JointState(position=[1.0] * 4)))


def test_the_build_lists_what_libraries_register(prefix: Path) -> None:
    index = prefix / "share/ament_index/resource_index/mauve_rt_plugins/mauve_downstream"
    lines = index.read_text(encoding="utf-8").splitlines()
    by_hand = (PACKAGE / "plugins.txt").read_text(encoding="utf-8").splitlines()
    assert lines[: len(by_hand)] == by_hand
    assert set(lines[len(by_hand) :]) == {
        "core; mauve_downstream/Doubler; mauve_rt/Float64RelayShell; mauve_downstream",
        "type; sensor_msgs/msg/JointState; ; mauve_downstream_sum",
        "type; std_msgs/msg/Float64; ; mauve_downstream_sum",
        "shell; mauve_downstream/SumShell; ; mauve_downstream_sum",
        "core; mauve_downstream/Sum; mauve_downstream/SumShell; mauve_downstream_sum",
        "fsm; mauve_downstream/SumFsm; mauve_downstream/SumShell; mauve_downstream_sum",
        "type; mauve_downstream/msg/Leg; ; mauve_downstream_leg",
        "shell; mauve_downstream/LegShell; ; mauve_downstream_leg",
        "core; mauve_downstream/Leg; mauve_downstream/LegShell; mauve_downstream_leg",
        "fsm; mauve_downstream/LegFsm; mauve_downstream/LegShell; mauve_downstream_leg",
    }


def test_a_struct_is_a_message_by_one_call_of_cmake(
    prefix: Path, msg: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert msg.Leg.get_fields_and_field_types() == {
        "name": "string<16>",
        "foot": "geometry_msgs/Point",
        "torque": "sequence<double, 3>",
        "joints": "mauve_downstream/Joint[2]",
    }
    assert (prefix / "share/mauve_downstream/msg/Leg.msg").read_text("utf-8") == LEG_FILE
    assert main(["types", "msg", "mauve_downstream/msg/Leg"]) == 0
    assert capsys.readouterr().out == LEG_FILE
    assert list(msg.Gait(legs=[msg.Leg()]).legs) == [msg.Leg()]  # a file of the same package


def test_c_plus_plus_and_python_exchange_the_struct_by_one_name(
    walk: Path, msg: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(walk)]) == 0
    assert "warning" not in capsys.readouterr().out
    model = load_architecture(walk)
    built = build(model, PluginRegistry())
    configure(model, built)
    simulation = Simulation()
    host = simulation.add(built)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + 95_000_000)
    leg = deserialize_message(host.read_resource("state")[0], msg.Leg)
    assert_walked(leg)
    distance = deserialize_message(host.read_resource("distance")[0], Float64).data
    assert leg.foot.x - 1.0 <= distance <= leg.foot.x


def test_the_struct_is_on_a_topic_and_in_a_bag(
    walk: Path,
    msg: ModuleType,
    graph: Any,
    start_executor: Callable[..., ExecutorProcess],
    tmp_path: Path,
) -> None:
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={walk}", "-p", f"bag:={bag}")
    legs = graph.hear(msg.Leg, "/leg")
    distances = graph.hear(Float64, "/distance")
    graph.spin_until(lambda: len(legs) > 2 and len(distances) > 2, "legs and distances")
    for leg in legs:
        assert_walked(leg)
    assert legs[-1].foot.x > legs[0].foot.x
    assert distances[-1].data >= 1.0
    executor.process.terminate()
    assert executor.wait() == 0, executor.output
    assert_rosbag2_reads(bag)
    with AnyReader([bag], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        [connection] = [each for each in reader.connections if each.topic == "/leg"]
        assert connection.msgtype == "mauve_downstream/msg/Leg"
        assert connection.msgdef.data.startswith(LEG_FILE)
        messages = [data for _, _, data in reader.messages([connection])]
        recorded = [reader.deserialize(data, connection.msgtype) for data in messages]
    assert recorded[0].foot.x == 1.0
    for leg in recorded[:3]:
        assert_walked(leg)
