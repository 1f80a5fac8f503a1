"""What `mauve check` refuses before anything starts: structs unlike messages, open ports, large types."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.cli.main import main
from mauve_rt.model import build, checks, configure, load_architecture
from mauve_rt.model.message_shapes import message_definition, mismatches

Check = Callable[[str], tuple[int, str, list[str]]]

ROBOT = """\
mauve: 1
components:
  one: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
resources:
  good: {kind: shared_data, type: mauve_msgs/msg/StepReport}
"""
LARGE = """\
mauve: 1
components:
  camera: {shell: misfits/LargeShell, core: misfits/Large, fsm: misfits/LargeFsm, stack_bytes: 8388608}
resources:
  in: {kind: shared_data, type: misfits/Large}
  out: {kind: latest_value, type: misfits/Large}
connections:
  - [camera.input, in.read]
  - [camera.output, out.write]
"""
CALLER = """\
mauve: 1
components:
  caller:
    {shell: executor_tests/CallerShell, core: executor_tests/Caller, fsm: executor_tests/CallerFsm}
resources:
  lamp: {kind: executor_tests/Lamp}
connections:
  - [caller.lamp, lamp.set]
"""


@pytest.fixture
def misfits(plugin_prefix: Path, misfits_prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package misfits, in front of all others."""
    del plugin_prefix  # searched next
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(misfits_prefix), prepend=os.pathsep)


@pytest.fixture
def check(tmp_path: Path, misfits: None, capsys: pytest.CaptureFixture[str]) -> Check:
    """check(TEXT): status, stdout, lines of stderr, of `mauve check robot`."""
    del misfits

    def run(text: str) -> tuple[int, str, list[str]]:
        path = tmp_path / "robot"
        path.write_text(text, encoding="utf-8")
        status = main(["check", str(path)])
        said = capsys.readouterr()
        return status, said.out, said.err.replace(f"{tmp_path}/", "").splitlines()

    return run


def test_a_struct_like_its_message_is_taken(check: Check) -> None:
    status, out, errors = check(ROBOT)
    assert status == 0
    assert [line for line in errors if "is not used" not in line] == []
    assert "no error found" in out


def test_a_message_is_looked_up_once_for_all_components(
    check: Check, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []
    held: list[object] = []

    def find(name: str) -> Any:
        asked.append(name)
        return message_definition(name)

    def hold(messages: Any, **options: Any) -> Any:
        held.append(messages)
        return mismatches(messages, **options)

    monkeypatch.setattr(checks, "message_definition", find)
    monkeypatch.setattr(checks, "mismatches", hold)
    assert check(ROBOT)[0] == 0
    by_one = len(held)
    asked.clear()
    held.clear()
    one = next(line for line in ROBOT.splitlines() if line.startswith("  one:"))
    assert check(ROBOT.replace(one, f"{one}\n{one.replace('one', 'two')}"))[0] == 0
    assert asked
    assert len(asked) == len(set(asked))
    assert len(held) == by_one > 0  # the shell of both is checked once


@pytest.mark.parametrize(
    ("type_name", "field", "expected", "found"),
    [
        ("geometry_msgs/msg/Vector3", "x", "float64 x", "float64 y"),
        ("geometry_msgs/msg/Quaternion", "w", "float64 w", "no further field"),
        ("geometry_msgs/msg/Pose2D", "age", "no further field", "float64 age"),
        ("std_msgs/msg/Float32", "data", "float32 data", "float64 data"),
        ("geometry_msgs/msg/Pose", "orientation.w", "float64 w", "no further field"),
        (
            "geometry_msgs/msg/Polygon",
            "points",
            "geometry_msgs/msg/Point32[] points",
            "geometry_msgs/msg/Point[<=4] points",
        ),
        ("mauve_msgs/msg/PeerAck", "peer", "string<=32 peer", "string<=64 peer"),
        (
            "geometry_msgs/msg/AccelWithCovariance",
            "accel.linear",
            "geometry_msgs/msg/Vector3 linear",
            "geometry_msgs/msg/Point linear",
        ),
    ],
)
def test_a_struct_unlike_its_message_is_refused(
    check: Check, type_name: str, field: str, expected: str, found: str
) -> None:
    status, out, errors = check(f"{ROBOT}  bad: {{kind: shared_data, type: {type_name}}}\n")
    assert (status, out) == (2, "")
    (error,) = errors
    assert error.startswith("robot:6:34: ")
    assert f"the C++ struct for {type_name} differs from the message in field '{field}'" in error
    assert f"expected {expected}" in error
    assert f"found {found}" in error
    assert "give MAUVE_TYPE the message's fields" in error


def test_a_services_response_is_held_against_the_service(check: Check) -> None:
    status, _, errors = check(
        f"{ROBOT}  ask: {{kind: client, type: std_srvs/srv/Trigger, service: {{name: ask}}}}\n"
    )
    assert status == 2
    (error,) = errors
    assert "std_srvs/srv/Trigger_Response" in error
    assert "expected bool success, found string<=16 message" in error


def test_a_shells_ports_are_held_against_their_messages(check: Check) -> None:
    two = "  two: {shell: misfits/ShortShell, core: misfits/Short, fsm: misfits/ShortFsm}\n"
    status, _, errors = check(ROBOT.replace("resources:\n", f"{two}resources:\n"))
    assert status == 2
    assert len(errors) == 1
    assert errors[0].startswith("robot:4:16: ")
    assert "geometry_msgs/msg/Quaternion" in errors[0]


def test_an_unconnected_call_port_is_refused(check: Check) -> None:
    assert check(CALLER)[0] == 0
    status, out, errors = check(CALLER.partition("connections:")[0])
    assert (status, out) == (2, "")
    (error,) = errors
    assert error.startswith("robot:3:3: ")
    assert "caller" in error
    assert "a required port is not connected" in error
    assert "port lamp" in error
    assert "connect it" in error


def test_a_message_that_the_stack_does_not_hold_is_refused(check: Check) -> None:
    assert check(LARGE)[0] == 0
    status, _, errors = check(LARGE.replace(", stack_bytes: 8388608", ""))
    assert status == 2
    (error,) = errors
    assert error.startswith("robot:3:3: ")
    assert "expected stack_bytes of at least 6032768 for 3000000 bytes of misfits/Large" in error
    assert "raise the component's stack_bytes" in error


def test_a_message_of_three_megabytes_passes_in_virtual_time(tmp_path: Path, misfits: None) -> None:
    del misfits
    path = tmp_path / "robot"
    path.write_text(LARGE, encoding="utf-8")
    model = load_architecture(path)
    architecture = build(model, PluginRegistry())
    configure(model, architecture)
    simulation = Simulation(trace=False)
    host = simulation.add(architecture)
    simulation.deploy()
    payload = b"\x00\x01\x00\x00" + bytes(range(1, 251)) * 12_000
    assert len(payload) == 3_000_004
    simulation.run_until(simulation.now_ns() + 50_000_000)
    assert host.write_resource("in", payload)
    simulation.run_until(simulation.now_ns() + 50_000_000)
    assert host.read_resource("out")[0] == payload
    simulation.shutdown()


def test_a_core_in_python_is_refused_on_a_type_that_only_cpp_has(check: Check) -> None:
    status, _, errors = check(LARGE.replace("core: misfits/Large,", "core: misfits/PyLarge,"))
    assert status == 2
    (error,) = errors
    assert error.startswith("robot:3:3: ")
    assert "component 'camera'" in error
    assert "core PyLarge is written in Python, which has no class for the port's type" in error
    assert "port input" in error
    assert "found misfits/Large" in error
    alternative = "fsm: misfits/LargeFsm, alternatives: [misfits/PyLarge],"
    status, _, errors = check(LARGE.replace("fsm: misfits/LargeFsm,", alternative))
    assert status == 2
    assert [error.partition(" ")[0] for error in errors] == ["robot:3:98:"] * 2
    assert all("which has no class for the port's type" in error for error in errors)
    assert "write the core in C++" in error
