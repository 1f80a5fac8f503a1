"""Sequences of messages: capacities from files and programs, values in place in C++, what is too long."""

from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Point
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from mauve_rt._kernel import Architecture, MauveError, PluginRegistry, Simulation, Transaction
from mauve_rt.api import LatestValue, RingBuffer, SharedData
from mauve_rt.cli.main import main
from mauve_rt.control.limits import bytes_of_resource
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import build, configure, load_architecture
from mauve_rt.model.plugins import PluginIndex, PluginLoader

CAPACITY = "capacity: {name: 4, position: 4, velocity: 4, effort: 4}"
GOOD = f"""\
mauve: 1
components:
  turner: {{shell: executor_tests/JointShell, core: executor_tests/JointTurner, fsm: executor_tests/JointFsm}}
resources:
  joints: {{kind: shared_data, type: sensor_msgs/msg/JointState, {CAPACITY}}}
  turned: {{kind: ring_buffer, capacity: 3, type: sensor_msgs/msg/JointState,
           capacity.name: 4, capacity.position: 4, capacity.velocity: 4, capacity.effort: 4}}
connections:
  - [turner.input, joints.read]
  - [turner.output, turned.write]
"""
TYPE = "sensor_msgs/msg/JointState"
FOUR = {"name": 4, "position": 4, "velocity": 4, "effort": 4}


def built(folder: Path, text: str) -> Architecture:
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    model = load_architecture(path)
    architecture = build(model, PluginRegistry())
    configure(model, architecture)
    return architecture


def joints(count: int) -> Any:
    state = JointState(name=[f"joint_{i}" for i in range(count)], position=[float(i) for i in range(count)])
    state.header.frame_id = "arm"
    return state


def test_a_core_reads_and_writes_sequences_in_place(tmp_path: Path, plugin_prefix: Path) -> None:
    simulation = Simulation()
    host = simulation.add(built(tmp_path, GOOD))
    simulation.deploy()
    assert host.write_resource("joints", serialize_message(joints(4)))
    simulation.run_until(simulation.now_ns() + 50_000_000)
    message, sequence, _ = host.read_resource("turned")
    turned = deserialize_message(message, JointState)
    assert sequence == 1
    assert (turned.name, list(turned.position)) == (joints(4).name, [0.0, -1.0, -2.0, -3.0])
    assert turned.header.frame_id == "arm"
    assert not host.write_resource("joints", serialize_message(joints(5)))


def test_a_new_core_gets_the_memory_of_the_resource_that_it_is_wired_to(
    tmp_path: Path, plugin_prefix: Path
) -> None:
    more = "".join(
        f"  {name}: {{kind: shared_data, type: {TYPE}, {CAPACITY.replace('4', '9')}}}\n"
        for name in ("many", "passed")
    )
    text = GOOD.replace(
        "fsm: executor_tests/JointFsm",
        "fsm: executor_tests/JointFsm, alternatives: [executor_tests/JointKeeper]",
    )
    simulation = Simulation()
    architecture = built(tmp_path, text.replace("connections:", f"{more}connections:"))
    host = simulation.add(architecture)
    simulation.deploy()
    change = Transaction().replace_core("turner", "executor_tests/JointKeeper")
    for port, resource, service in (("input", "many", "read"), ("output", "passed", "write")):
        change.disconnect("turner", port).connect("turner", port, resource, service)
    simulation.at(simulation.now_ns() + 25_000_000, lambda: host.commit(change))
    simulation.run_until(simulation.now_ns() + 100_000_000)
    assert host.write_resource("many", serialize_message(joints(9)))
    simulation.run_until(simulation.now_ns() + 50_000_000)
    assert deserialize_message(host.read_resource("passed")[0], JointState) == joints(9)


BAD = {
    "none": (
        f", {CAPACITY}",
        "",
        "joints: {",
        "needs a capacity, at capacity.name: expected how many elements it holds at most, found none; add ",
    ),
    "one lacks": (", effort: 4}", "}", "joints: {", "at capacity.effort"),
    "unknown": (
        "effort: 4}",
        "efort: 4, effort: 4}",
        "joints: {",
        "no such sequence, at capacity.efort: expected one of",
    ),
    "zero": ("{name: 4", "{name: 0", "0", "expected at least 1, found 0"),
    "no number": ("{name: 4", "{name: many", "many", "expected a whole number, found 'many'"),
    "latest value": (
        "joints: {kind: shared_data",
        "joints: {kind: latest_value",
        "sensor",
        "as one with sequences",
    ),
    "ring without length": ("capacity: 3, ", "", "turned: {", "resource 'turned' has no capacity"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_capacity_is_refused_at_its_place(case: str, tmp_path: Path, plugin_prefix: Path) -> None:
    before, after, culprit, message = BAD[case]
    text = GOOD.replace(before, after, 1)
    assert text != GOOD
    with pytest.raises(ArchitectureFileError) as caught:
        built(tmp_path, text)
    problem = caught.value.problems[0]
    assert message in str(caught.value)
    assert text.splitlines()[problem.line - 1][problem.column - 1 :].startswith(culprit)


def test_capacities_of_a_program(plugin_prefix: Path) -> None:
    registry = PluginRegistry()
    loader = PluginLoader(registry, PluginIndex.installed())
    loader.require("core", "executor_tests/JointTurner")
    architecture = Architecture(registry)
    architecture.add_resource("one", kind="shared_data", type=TYPE, capacity=FOUR)
    architecture.add_resource("two", SharedData(JointState, capacities=FOUR))
    architecture.add_resource("three", RingBuffer(JointState, 2, capacities=FOUR))
    with pytest.raises(MauveError, match=r"each sequence of sensor_msgs/msg/JointState needs a capacity"):
        architecture.add_resource("four", SharedData(JointState))
    with pytest.raises(MauveError, match="as one with sequences"):
        architecture.add_resource("five", LatestValue(JointState))
    assert {resource.name for resource in architecture.resources()} == {"one", "two", "three"}


def test_the_check_says_what_the_values_take(
    tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    built(tmp_path, GOOD)
    assert main(["check", str(tmp_path / "robot.yaml")]) == 0
    said = capsys.readouterr().out
    model = load_architecture(tmp_path / "robot.yaml")
    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("core", "executor_tests/JointTurner")
    for name, resource in model.resources.items():
        assert f"resource '{name}' takes {bytes_of_resource(resource, registry):,} bytes" in said


def test_a_resource_says_what_its_values_take(tmp_path: Path, plugin_prefix: Path) -> None:
    found = {each.name: each.memory_bytes for each in built(tmp_path, GOOD).resources()}
    model = load_architecture(tmp_path / "robot.yaml")
    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("core", "executor_tests/JointTurner")
    one = registry.value_bytes(TYPE, {f"capacity.{path}": size for path, size in FOUR.items()})
    for name, bytes_found in found.items():
        assert bytes_found % one == 0
        assert bytes_found >= bytes_of_resource(model.resources[name], registry)
    twice = built(tmp_path, GOOD.replace("position: 4", "position: 4000")).resources()
    assert all(each.memory_bytes > found[each.name] for each in twice)


def test_structs_of_two_libraries_for_one_message_are_connected(plugin_prefix: Path) -> None:
    """The resource has the struct of the library that was loaded first, the port that of the other one."""
    registry = PluginRegistry()
    loader = PluginLoader(registry, PluginIndex.installed())
    loader.require("core", "mauve_examples/Robot")
    architecture = Architecture(registry)
    architecture.add_resource("place", kind="shared_data", type="geometry_msgs/msg/Point")
    for kind in ("shell", "core", "fsm"):
        loader.require(kind, "executor_tests/Pilot" + {"core": ""}.get(kind, kind.capitalize()))
    architecture.add_resource("attitude", kind="shared_data", type="executor_tests/Attitude")
    architecture.add_component(
        "pilot", "executor_tests/PilotShell", "executor_tests/Pilot", "executor_tests/PilotFsm"
    )
    architecture.connect("pilot", "attitude", "attitude", "write")
    architecture.connect("pilot", "place", "place", "write")
    architecture.configure()
    simulation = Simulation()
    host = simulation.add(architecture)
    simulation.deploy()
    simulation.run_until(simulation.now_ns() + 100_000_000)
    message, sequence, _ = host.read_resource("place")
    assert sequence > 0
    assert deserialize_message(message, Point).x != 0.0
