"""Transactions of many steps over ~/reconfigure, and cores that take over after a fault."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64

from mauve_msgs.msg import (
    ArchitectureState,
    ComponentInfo,
    ReconfigurationStep,
)
from mauve_msgs.srv import ListComponents, Reconfigure
from mauve_rt.cli.main import main
from mauve_rt.control.requests import NOT_MEASURED, Code
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.report.analysis import analyse

NODE = "/robot_1/executor"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FALLBACK = "executor_tests/Backwards"
COUNTER = (
    "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm, "
    "alternatives: [executor_tests/Backwards], properties: {step: 3.0}}"
)


def _step(kind: str, target: str, name: str = "", value: str = "") -> Any:
    return ReconfigurationStep(kind=kind, target=target, name=name, value=value)


ADD = [
    _step("add_resource", "sum", value="{kind: shared_data, type: std_msgs/msg/Float64}"),
    _step("add_component", "second", value=COUNTER),
    _step("connect", "second", "count", "sum.write"),
    _step("disconnect", "counter", "set"),
    _step("connect", "counter", "set", "sum.read"),
    _step("start", "second"),
]
REMOVE = [
    _step("disconnect", "counter", "set"),
    _step("connect", "counter", "set", "set.read"),
    _step("remove_component", "second"),
    _step("remove_resource", "sum"),
]


def _list(graph: Any) -> Any:
    return graph.ask(ListComponents, f"{NODE}/list_components")


def _facts(reply: Any) -> list[tuple[object, ...]]:
    """What a refused transaction must leave as it was."""
    return [
        (part.name, part.shell, part.core, part.fsm, part.state, part.ports, part.properties)
        for part in reply.components
    ]


@pytest.mark.usefixtures("executor")
def test_a_change_is_made_at_an_idle_instant_and_says_so(graph: Any) -> None:
    steps = [_step("set_property", "counter", "step", "2.0")]
    words = "made while no job of a participant was pending"
    plain = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    assert (plain.success, words in plain.message) == (True, False), plain.message
    idle = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps, idle=True, idle_within_s=5.0)
    assert (idle.success, words in idle.message) == (True, True), idle.message
    refused = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps, idle=True, idle_within_s=11.0)
    assert refused.code == Code.INVALID
    assert "bad idle_within_s: expected 0 (the default) to 10 s, found 11" in refused.message


@pytest.mark.usefixtures("executor")
def test_components_and_resources_come_and_go(graph: Any) -> None:
    states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    events = graph.hear_events(NODE)
    counts = graph.hear(Float64, "/robot_1/count")
    before = _list(graph)
    dry = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=ADD, dry_run=True)
    assert dry.success, dry.message
    assert _facts(_list(graph)) == _facts(before)
    assert dry.revision == before.revision
    wrong = [*ADD[:2], _step("connect", "second", "count", "sum.read"), *ADD[3:]]
    refused = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=wrong)
    assert (refused.success, refused.code, len(refused.report)) == (False, Code.INVALID, 0)
    assert "step 3 (connect second.count sum.read)" in refused.message
    assert _facts(_list(graph)) == _facts(before)
    done = graph.ask(
        Reconfigure, f"{NODE}/reconfigure", steps=ADD, expected_revision=before.revision, cause="more"
    )
    assert done.success, done.message
    assert [(step.component, step.step) for step in done.report] == [
        ("", "add_resource sum"),
        ("second", "add_component"),
        ("second", "connect count sum.write"),
        ("counter", "disconnect set"),
        ("counter", "connect set sum.read"),
        ("second", "start"),
    ]
    assert done.report[0].blackout_ns == NOT_MEASURED
    assert done.report[4].blackout_ns > 0
    assert all(step.prepare_ns > 0 for step in done.report)
    parts = {part.name: part for part in _list(graph).components}
    assert list(parts) == ["counter", "guard", "sleepy", "second"]
    assert (parts["second"].state, parts["second"].period_ns) == (ComponentInfo.RUNNING, 10_000_000)
    assert {port.name: port.resource for port in parts["counter"].ports} == {"set": "sum", "count": "count"}
    graph.spin_until(
        lambda: bool(states) and [part.name for part in states[-1].components] == list(parts), "its state"
    )
    graph.spin_until(lambda: bool(counts) and counts[-1].data % 3.0 == 1.0, "a count from the second one's")
    removed = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=REMOVE)
    assert removed.success, removed.message
    assert _facts(_list(graph)) == _facts(before)
    graph.spin_until(lambda: len(events) == 4, "the events")
    assert [event.success for event in events] == [True, False, True, True]
    assert events[2].request.startswith(
        "add_resource sum {kind: shared_data, type: std_msgs/msg/Float64}; add_"
    )
    assert events[2].cause == "more"
    assert [step.step for step in events[2].report] == [step.step for step in done.report]
    graph.spin_until(lambda: len(states[-1].components) == 3, "the state without it")
    assert (states[-1].revision, states[-1].instance_id) == (removed.revision, removed.instance_id)


def test_a_fallback_core_that_took_over_is_shown_everywhere(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("priority: 40", f"priority: 40, fallback: {FALLBACK}")
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    events = graph.hear_events(NODE)
    health = graph.hear(DiagnosticArray, "/diagnostics")
    voice = graph.voice(Float64, "/robot_1/set")
    graph.spin_until(
        lambda: bool(states) and states[-1].components[0].state == ComponentInfo.RUNNING, "its start"
    )
    voice.publish(Float64(data=-1e7))
    graph.spin_until(lambda: bool(events), "the event")
    (event,) = events
    assert (event.requested_by, event.success) == ("kernel", True)
    assert "set to something unheard of (in state Count" in event.cause
    assert (event.from_core, event.to_core) == ("executor_tests/Counter", FALLBACK)
    graph.spin_until(lambda: states[-1].components[0].core == FALLBACK, "the state")
    status = states[-1].components[0]
    assert (status.state, status.fault) == (ComponentInfo.RUNNING, event.cause)

    def warnings() -> list[str]:
        return [
            status.message
            for array in health
            for status in array.status
            if status.name == f"{NODE}: counter" and status.level == DiagnosticStatus.WARN
        ]

    graph.spin_until(lambda: any("fallback core" in message for message in warnings()), "a warning")
    listed = _list(graph).components[0]
    assert (listed.core, listed.fault) == (FALLBACK, event.cause)
    assert "executor_tests/Counter" in listed.alternatives
    again = graph.ask(
        Reconfigure,
        f"{NODE}/reconfigure",
        steps=[_step("replace_core", "counter", "executor_tests/Counter")],
    )
    assert again.success, again.message
    assert _list(graph).components[0].fault == ""


def test_a_removed_component_keeps_its_number_in_the_bag(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={tmp_path / 'bag'}")
    assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=ADD).success
    assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=REMOVE).success
    third = [_step("add_component", "third", value=COUNTER), _step("start", "third")]
    assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=third).success
    executor.process.terminate()
    assert executor.wait() == 0
    trace = open_trace(tmp_path / "bag")
    assert list(trace.components)[-2:] == ["second", "third"]
    assert len(trace.of("second")) > 0
    assert len(trace.of("third")) > 0


OWN_CHANGES = [
    _step("replace_core", "counter", FALLBACK),
    _step("set_property", "counter", "step", "2.0"),
    _step("set_property", "sleepy", "step", "3.0"),
]


def test_each_component_is_told_of_its_own_change(
    architecture: Path,
    start_executor: Callable[..., Any],
    graph: Any,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    for steps in (OWN_CHANGES, [_step("remove_component", "sleepy"), *ADD[:3], ADD[-1]]):
        reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
        assert reply.success, reply.message
    executor.process.terminate()
    assert executor.wait() == 0
    own = {
        ("counter", f"set_property step, replace_core {FALLBACK}"),
        ("sleepy", "set_property step"),
        ("sleepy", "remove"),
    }
    trace = open_trace(bag)
    swaps = analyse(trace, events=trace.messages("mauve_msgs/msg/ReconfigurationEvent")).swaps
    assert {(swap.measured.component, swap.measured.what) for swap in swaps} == own
    asked = [swap.request for swap in swaps if swap.request is not None]
    cores = {
        (swap.measured.component, swap.request.from_core, swap.request.to_core)
        for swap in swaps
        if swap.request is not None
    }
    assert len(asked) == len(swaps) == 3
    assert cores == {("counter", "executor_tests/Counter", FALLBACK), ("sleepy", "", "")}
    assert main(["trace", "stats", str(bag)]) == 0
    rows = capsys.readouterr().out.partition("reconfigurations")[2].splitlines()
    for component, what in own:
        assert any(row.split("  ")[0].strip() == component and f" {what} " in row for row in rows), rows
    page = tmp_path / "page.html"
    assert main(["report", str(bag), "--out", str(page)]) == 0
    assert page.read_text(encoding="utf-8").count("<td>Counter \N{RIGHTWARDS ARROW} Backwards</td>") == 1
