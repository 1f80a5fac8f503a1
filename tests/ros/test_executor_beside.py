"""Requests beside a change that is being prepared, and what is known when a change is in force."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from std_msgs.msg import Float64

from mauve_msgs.msg import ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop
from mauve_rt.node.executor_requests import NOT_MEASURED, Code

NODE = "/robot_1/executor"
PATIENT = "executor_tests/PyPatient"


class Preparation:
    """A replacement of the counter's core, which is being prepared until finish()."""

    def __init__(self, graph: Any, folder: Path) -> None:
        self._graph = graph
        self._awaited = folder / "go"
        label = ReconfigurationStep(
            kind="set_property", target="counter", name="label", value=f"'{self._awaited}'"
        )
        assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[label]).success
        core = {"component": "counter", "core": PATIENT, "request_id": "slow"}
        self.reply = graph.ask_later(ReplaceCore, f"{NODE}/replace_core", **core)
        graph.spin_until(self._awaited.with_suffix(".begun").exists, "the preparation")

    def finish(self) -> Any:
        """Its reply."""
        self._awaited.touch()
        self._graph.spin_until(self.reply.done, "the change")
        return self.reply.result()


@pytest.fixture
def preparation(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> Callable[[], Preparation]:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("executor_tests/PyCounter,", f"executor_tests/PyCounter, {PATIENT},")
    architecture.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    return lambda: Preparation(graph, tmp_path)


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
        (True, f"component 'counter' runs {PATIENT}, before executor_tests/Counter"),
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


def test_a_repeated_id_waits_for_the_outcome_it_repeats(
    preparation: Callable[[], Preparation], graph: Any
) -> None:
    change = preparation()
    other = graph.ask_later(Stop, f"{NODE}/stop", component="sleepy", request_id="slow")
    assert graph.ask(ListComponents, f"{NODE}/list_components").components
    assert change.finish().success
    graph.spin_until(other.done, "the answer of the second")
    assert other.result().code == Code.REQUEST_ID_REUSED
    assert _part(graph, "sleepy").state == ComponentInfo.RUNNING


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
