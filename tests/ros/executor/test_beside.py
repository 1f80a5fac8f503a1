"""Requests beside a change that is being prepared, and what is known when a change is in force."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from preparations import NODE, Preparation, declare
from std_msgs.msg import Float64

from mauve_msgs.msg import ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop
from mauve_rt.control.requests import NOT_MEASURED, Code

PATIENT = "executor_tests/PyPatient"
BACKWARDS = "executor_tests/Backwards"


@pytest.fixture
def preparation(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> Callable[[], Preparation]:
    declare(architecture, PATIENT)
    start_executor("-p", f"architecture:={architecture}")
    return lambda: Preparation(graph, tmp_path, PATIENT)


def _part(graph: Any, name: str) -> Any:
    listed = graph.ask(ListComponents, f"{NODE}/list_components")
    return next(part for part in listed.components if part.name == name)


def test_stop_start_and_list_wait_for_no_preparation(
    preparation: Callable[[], Preparation], graph: Any
) -> None:
    events = graph.hear_events(NODE)
    change = preparation()
    replies = [graph.ask(Stop, f"{NODE}/stop", component="sleepy")]
    assert _part(graph, "sleepy").state == ComponentInfo.STOPPED
    replies.append(graph.ask(Start, f"{NODE}/start", component="sleepy"))
    assert not change.reply.done()
    # What was stopped and started meanwhile is none of the change's business.
    replies.append(change.finish())
    assert [(reply.success, reply.message) for reply in replies] == [
        (True, "component 'sleepy' is stopped"),
        (True, "component 'sleepy' is started"),
        (True, f"component 'counter' runs {PATIENT}, in place of executor_tests/Counter"),
    ]
    revisions = [reply.revision for reply in replies]
    assert revisions == sorted(set(revisions))
    graph.spin_until(lambda: len(events) == 4, "the events")
    assert [event.message for event in events[1:]] == [reply.message for reply in replies]


def test_a_stop_of_its_own_component_calls_the_change_off(
    preparation: Callable[[], Preparation], graph: Any
) -> None:
    change = preparation()
    assert graph.ask(Stop, f"{NODE}/stop", component="counter").success
    refused = change.finish()
    assert (refused.success, refused.code) == (False, Code.WRONG_REVISION)
    assert "was started or stopped" in refused.message
    counter = _part(graph, "counter")
    assert (counter.state, counter.core) == (ComponentInfo.STOPPED, "executor_tests/Counter")


def test_a_stop_by_reconfigure_waits_for_no_preparation(
    preparation: Callable[[], Preparation], graph: Any
) -> None:
    change = preparation()
    behind = graph.ask_later(ReplaceCore, f"{NODE}/replace_core", component="sleepy", core=BACKWARDS)
    for kind in ("stop", "start"):
        step = ReconfigurationStep(kind=kind, target="sleepy")
        assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[step]).success
    assert _part(graph, "sleepy").state == ComponentInfo.RUNNING
    assert not change.reply.done()
    assert not behind.done(), "a change waits for the one before it"
    assert change.finish().success
    graph.spin_until(behind.done, "the change behind it")
    assert behind.result().success


def test_a_stop_waits_for_no_stop_of_another_component(
    preparation: Callable[[], Preparation], graph: Any
) -> None:
    voice = graph.voice(Float64, "/robot_1/set")
    held = {"component": "counter", "core": "executor_tests/Held"}
    assert graph.ask(ReplaceCore, f"{NODE}/replace_core", **held).success
    graph.spin_until(lambda: _part(graph, "counter").current_state == "Count", "a state that lasts")
    slow = [
        graph.ask_later(Stop, f"{NODE}/stop", component="counter", timeout_s=10.0) for _ in range(3)
    ]  # one after the other they would take half a minute
    assert graph.ask(Stop, f"{NODE}/stop", component="sleepy").success
    assert not any(reply.done() for reply in slow)
    voice.publish(Float64(data=1.0))
    graph.spin_until(lambda: all(reply.done() for reply in slow), "the others")
    assert _part(graph, "counter").state == ComponentInfo.STOPPED


def test_a_repeated_request_waits_for_the_outcome_it_repeats(
    preparation: Callable[[], Preparation], graph: Any
) -> None:
    change = preparation()
    again = graph.ask_later(ReplaceCore, f"{NODE}/replace_core", **change.request)
    other = graph.ask(Stop, f"{NODE}/stop", component="sleepy", request_id="slow")
    assert other.code == Code.REQUEST_ID_REUSED
    assert f"replace_core counter {PATIENT}" in other.message
    assert _part(graph, "sleepy").state == ComponentInfo.RUNNING
    assert graph.ask(Stop, f"{NODE}/stop", component="sleepy").success, "a stop waits for none of them"
    assert not change.reply.done()
    reply = change.finish()
    assert reply.success
    graph.spin_until(again.done, "the answer to the second")
    assert (again.result().success, again.result().revision) == (True, reply.revision)


def test_the_reply_comes_before_the_release_that_its_event_tells(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8").replace("period_ms: 5000", "period_ms: 1000")
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}", "-p", "report_phase_timeout_s:=2.0")
    events = graph.hear_events(NODE)
    cores = ("executor_tests/Backwards", "executor_tests/Counter", "executor_tests/Backwards")
    replies = []
    for number, core in enumerate(cores, start=1):
        replies.append(graph.ask(ReplaceCore, f"{NODE}/replace_core", component="sleepy", core=core))
        graph.spin_until(lambda: len(events) == number, "its event")  # noqa: B023
    known = [reply.report[0].phase_actual_ns != NOT_MEASURED for reply in replies]
    assert known.count(True) <= 1, "at most one commit came just before its release"
    for reply, event in zip(replies, events, strict=True):
        assert (event.revision, event.message) == (reply.revision, reply.message)
        (step,) = event.report
        assert (step.missed_releases, step.phase_nominal_ns) == (0, 0)
        assert step.phase_actual_ns >= 0
        if (first := reply.report[0]).phase_actual_ns == NOT_MEASURED:
            assert first.missed_releases == NOT_MEASURED
        assert (first.to_core, first.blackout_ns) == (step.to_core, step.blackout_ns)


@pytest.mark.parametrize(
    ("parts", "fault"),
    [
        ("Counter CounterFsm", (-1e7, "set to something unheard of")),
        ("Held GuardedFsm", (1.0, "ran longer than its declared")),
        ("PyHeld CounterFsm", (-1e7, "set to something unheard of")),
        ("PyHeld GuardedFsm", (1.0, "ran longer than its declared")),
    ],
)
def test_a_fallback_is_told_whatever_the_fault(
    architecture: Path,
    start_executor: Callable[..., Any],
    graph: Any,
    parts: str,
    fault: tuple[float, str],
) -> None:
    (core, fsm), (told, words) = parts.split(), fault
    text = architecture.read_text(encoding="utf-8")
    begin = text.index("core: executor_tests/Counter,")
    first = text[begin:].replace(
        "core: executor_tests/Counter, fsm: executor_tests/CounterFsm",
        f"core: executor_tests/{core}, fsm: executor_tests/{fsm}, fallback: executor_tests/Backwards",
        1,
    )
    first = first.replace("period_ms: 20", "period_ms: 20, label: briefly", 1)
    architecture.write_text(text[:begin] + first, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}", "-p", "autostart:=false")
    events = graph.hear_events(NODE)
    _activate(graph)
    voice = graph.voice(Float64, "/robot_1/set")
    if fsm == "GuardedFsm":
        graph.spin_until(lambda: _part(graph, "counter").state == ComponentInfo.FAULTED, "the watchdog")

    def is_event_told() -> bool:
        voice.publish(Float64(data=told))
        return bool(events)

    graph.spin_until(is_event_told, "the event")
    event = events[0]
    assert (event.requested_by, event.success) == ("kernel", True)
    assert words in event.cause
    cores = (f"executor_tests/{core}", "executor_tests/Backwards")
    assert (event.from_core, event.to_core) == cores
    assert [(step.component, step.from_core, step.to_core) for step in event.report] == [("counter", *cores)]
    assert _part(graph, "counter").core == "executor_tests/Backwards"


def _activate(graph: Any) -> None:
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        reply = graph.ask(ChangeState, f"{NODE}/change_state", transition=Transition(id=transition))
        assert reply.success
