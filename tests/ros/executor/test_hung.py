"""A component whose state does not end is told: in /diagnostics, in ~/state, in the log, by `mauve list`."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64

from mauve_msgs.msg import ArchitectureState, ComponentInfo, ComponentStatus
from mauve_msgs.srv import ListComponents, Stop
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
WAYS = ("loop", "sleep", "lock", "pipe")
# The loop has the lowest priority on the CPU that all share: it keeps none of the others from running.
COMPONENT = """\
  {name}: {{shell: executor_tests/CounterShell, core: executor_tests/{core}, fsm: executor_tests/{fsm},
            cpus: [0], priority: {priority}, {more}properties: {{period_ms: 20, label: '{label}'}}}}
"""
QUIET = "diagnostics: {overruns: null, allocations: null, page_faults: null}, "
REST = """\
resources:
  set: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set, direction: subscribe}}
  event: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: event, direction: subscribe}}
connections:
  - [loop.set, set.read]
  - [sporadic.set, event.read]
"""


class Told:
    """What an executor tells of its components' health."""

    def __init__(self, graph: Any) -> None:
        self.graph = graph
        self.health = graph.hear(DiagnosticArray, "/diagnostics")
        qos = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.states = graph.hear(ArchitectureState, f"{NODE}/state", qos)

    def statuses(self, part: str) -> list[Any]:
        return [found for array in self.health for found in array.status if found.name == f"{NODE}: {part}"]

    def in_state(self, part: str) -> Any:
        """Its part of the newest ~/state."""
        newest = self.states[-1].components if self.states else ()
        return next((found for found in newest if found.name == part), ComponentStatus())

    def await_hung(self, part: str, state: str = "Count") -> None:
        said = f"hung: state {state} has lasted "

        def told() -> bool:
            newest = self.statuses(part)[-1:]
            return any(found.level == DiagnosticStatus.ERROR and said in found.message for found in newest)

        self.graph.spin_until(told, f"/diagnostics to say that {part} is hung")
        self.graph.spin_until(lambda: self.in_state(part).hung, f"~/state to say that {part} is hung")

    def await_well(self, part: str) -> None:
        self.graph.spin_until(lambda: "hung" not in self.statuses(part)[-1].message, f"{part} to go on")
        self.graph.spin_until(lambda: not self.in_state(part).hung, f"~/state to say that {part} goes on")


def _write(path: Path, pipe: Path, core: str, sporadic: str = "") -> None:
    os.mkfifo(pipe)
    text = "mauve: 1\nexecutor: {namespace: /robot_1}\ncomponents:\n"
    labels = {"loop": "loop", "sleep": "sleep", "lock": "lock", "pipe": str(pipe)}
    for at, (name, label) in enumerate(labels.items()):
        fields = {"name": name, "label": label, "core": core, "fsm": "CounterFsm"}
        text += COMPONENT.format(**fields, priority=20 + at, more="")
    rest = {"label": "", "more": QUIET, "priority": 50}
    text += COMPONENT.format(name="neighbour", core="Counter", fsm="CounterFsm", **rest)
    rest["label"] = sporadic
    text += COMPONENT.format(name="sporadic", core="Hanging", fsm="EventFsm", **rest)
    path.write_text(text + REST, encoding="utf-8")


def _list(domain: int, *words: str) -> str:
    command = [sys.executable, "-m", "mauve_rt.cli", "list", NODE, *words]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("core", ["Hanging", "PyHanging"])
def test_a_hung_component_is_told_until_it_goes_on(
    core: str,
    tmp_path: Path,
    architecture: Path,
    start_executor: Callable[..., Any],
    graph: Any,
) -> None:
    pipe = tmp_path / "pipe"
    _write(architecture, pipe, core)
    executor = start_executor("-p", f"architecture:={architecture}")
    domain = graph.node.context.get_domain_id()
    told = Told(graph)
    for way in WAYS:
        told.await_hung(way)
        status = told.in_state(way)
        assert (status.state, status.fault) == (ComponentInfo.RUNNING, ""), "told, not condemned"
        assert status.current_state == "Count"
        assert status.state_age_ns > status.hung_after_ns == 1_000_000_000
    values = {item.key: item.value for item in told.statuses("lock")[-1].values}
    assert int(values["state_age_ns"]) > 1_000_000_000
    assert (values["period_ns"], values["state_bound_ns"]) == ("20000000", "0")

    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    found = {part.name: part for part in reply.components}
    assert found["lock"].hung
    assert found["lock"].state_age_ns > int(values["state_age_ns"]), "it grows"
    assert not found["neighbour"].hung
    line = next(line for line in _list(domain).splitlines() if line.startswith("lock: "))
    assert line.startswith("lock: hung: state Count has lasted ")
    assert line.endswith(" (period 0.02 s, hung from 1 s on)")
    listed = {part["name"]: part for part in json.loads(_list(domain, "--json"))["components"]}
    assert (listed["lock"]["hung"], listed["neighbour"]["hung"]) == (True, False)

    reply = graph.ask(Stop, f"{NODE}/stop", component="lock", timeout_s=0.1)
    assert (reply.success, reply.code) == (False, Code.TIMEOUT)
    told.await_hung("lock")

    pipe.write_bytes(b"x")
    graph.voice(Float64, "/robot_1/set").publish(Float64(data=1.0))
    for way in ("loop", "sleep", "pipe"):
        told.await_well(way)
    assert told.in_state("lock").hung
    for part in ("neighbour", "sporadic"):
        assert {status.level for status in told.statuses(part)} == {DiagnosticStatus.OK}
    assert executor.process.poll() is None
    for way in ("loop", "sleep", "pipe"):
        gone = f"component '{way}' is no longer hung"
        executor.await_output(gone)
        assert executor.output.count(gone) == 1
        assert executor.output.count(f"component '{way}' is hung: state Count has lasted ") == 1


def test_one_that_waits_for_events_has_a_figure_of_its_own(
    tmp_path: Path, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    pipe = tmp_path / "pipe"
    _write(architecture, tmp_path / "other", "Counter", sporadic=str(pipe))
    os.mkfifo(pipe)
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("fsm: executor_tests/EventFsm,", "fsm: executor_tests/EventFsm, hung_after_ms: 300,")
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    told = Told(graph)
    told.await_hung("sporadic")
    status = told.in_state("sporadic")
    assert status.state_age_ns > status.hung_after_ns == 300_000_000
    assert not told.in_state("neighbour").hung
    pipe.write_bytes(b"x")
    told.await_well("sporadic")
