"""A stop, a deactivation and a shutdown come through while the executor's Python side hangs."""

import os
import signal
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from std_msgs.msg import Float64

from mauve_msgs.msg import ComponentInfo
from mauve_msgs.srv import ListComponents, Start, Stop
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
SILENT = "the executor's Python side did not take the request up"


class Hanging:
    """An executor whose Python side can be made to hang."""

    def __init__(self, graph: Any, executor: Any, kept: Callable[..., Path], pipe: Path) -> None:
        self.graph, self.executor, self._kept, self._pipe = graph, executor, kept, pipe
        self.counts = graph.hear(Float64, "/robot_1/count")
        self.events = graph.hear_events(NODE)
        graph.spin_until(lambda: len(self.counts) > 3, "counts")
        graph.ask(ChangeState, f"{NODE}/change_state", transition=Transition(id=99))  # its client is known
        self._file: Path | None = None

    def hang(self) -> None:
        """Until work(): whoever opens a pipe to read waits for who opens it to write."""
        os.mkfifo(self._pipe)
        self._file = self._kept(self.executor, str(self._pipe))
        self.graph.spin_until(self.hangs, "the interpreter to be kept")

    def hangs(self) -> bool:
        return self._says("keeping")

    def work(self) -> None:
        assert self.hangs()
        self._pipe.write_bytes(b"")
        self.graph.spin_until(lambda: self._says("over"), "Python to work again")

    def ask(self, component: str, **fields: Any) -> Any:
        return self.graph.ask(Stop, f"{NODE}/stop", component=component, **fields)

    def await_safe(self) -> None:
        self.graph.spin_until(lambda: self.counts[-1].data == 0.0, "the type's zero, written at the stop")

    def states(self) -> dict[str, int]:
        listed = self.graph.ask(ListComponents, f"{NODE}/list_components").components
        return {part.name: part.state for part in listed}

    def close(self) -> None:
        if self.hangs():
            self._pipe.write_bytes(b"")
        if self._file is not None:
            self._file.unlink()

    def _says(self, word: str) -> bool:
        return self._file is not None and self._file.read_text("utf-8") == word


@pytest.fixture
def robot(
    architecture: Path,
    start_executor: Callable[..., Any],
    graph: Any,
    kept: Callable[..., Path],
    tmp_path: Path,
) -> Iterator[Hanging]:
    robot = Hanging(graph, start_executor("-p", f"architecture:={architecture}"), kept, tmp_path / "pipe")
    yield robot
    robot.close()


def test_a_stop_is_carried_out_and_told_later(robot: Hanging) -> None:
    robot.hang()
    asked = {"request_id": str(uuid.uuid4()), "requested_by": "test", "cause": "it hangs"}
    reply = robot.ask("counter", **asked)
    robot.await_safe()
    assert robot.hangs(), "it is stopped while Python hangs"
    assert (reply.success, reply.code) == (True, Code.OK), reply
    assert reply.message == f"component 'counter' is stopped; {SILENT}"
    assert reply.instance_id
    assert robot.ask("counter", **asked) == reply, "who repeats a request gets its outcome"
    reused = robot.ask("nobody", **asked)
    assert (reused.success, reused.code) == (False, Code.REQUEST_ID_REUSED), reused
    again = robot.ask("counter")
    assert (again.success, again.code) == (False, Code.NOT_RUNNING), again
    nobody = robot.ask("nobody")
    assert (nobody.success, nobody.code) == (False, Code.UNKNOWN_COMPONENT), nobody
    robot.graph.spin_until(lambda: f"stop counter: {reply.message}" in robot.executor.output, "the log")

    robot.work()
    told = [lambda event: event.request_id == asked["request_id"]]
    robot.graph.spin_until(lambda: any(map(told[0], robot.events)), "the event")
    (event,) = filter(told[0], robot.events)
    assert (event.success, event.requested_by, event.cause) == (True, "test", "it hangs")
    assert [(step.step, step.component) for step in event.report] == [("stop", "counter")]
    assert robot.ask("counter", **asked).message == reply.message, "Python knows the outcome, too"
    assert robot.states()["counter"] == ComponentInfo.STOPPED
    assert robot.graph.ask(Start, f"{NODE}/start", component="counter").success
    assert robot.executor.end(signal.SIGTERM)[0] == 0


def test_what_hangs_is_stopped_by_force(robot: Hanging) -> None:
    robot.hang()
    late = robot.ask("sleepy", timeout_s=0.1)
    assert (late.success, late.code) == (False, Code.TIMEOUT), late
    assert "the stop stays pending" in late.message
    forced = robot.ask("sleepy", timeout_s=0.1, force=True)
    assert robot.hangs()
    assert (forced.success, forced.code) == (True, Code.OK), forced
    assert "by force: it is FAULTED" in forced.message
    robot.work()
    assert robot.executor.end(signal.SIGTERM)[0] == 0


def test_what_it_cannot_check_is_refused(robot: Hanging) -> None:
    robot.hang()
    refusals = [
        ({"expected_revision": 3}, Code.WRONG_REVISION, "ask without expected_revision"),
        ({"timeout_s": float("nan")}, Code.INVALID, "bad timeout"),
        ({"timeout_s": 11.0}, Code.INVALID, "bad timeout"),
    ]
    for fields, code, words in refusals:
        refused = robot.ask("counter", **fields)
        assert (refused.success, refused.code) == (False, code), refused
        assert words in refused.message
    robot.work()
    assert robot.states()["counter"] == ComponentInfo.RUNNING


@pytest.mark.parametrize(
    ("transition", "state"),
    [
        (Transition(id=Transition.TRANSITION_DEACTIVATE), "inactive"),
        (Transition(label="deactivate"), "inactive"),
        (Transition(id=Transition.TRANSITION_ACTIVE_SHUTDOWN), "finalized"),
    ],
)
def test_a_transition_makes_outputs_safe_at_once_and_follows(
    robot: Hanging, transition: Transition, state: str
) -> None:
    robot.hang()
    change = robot.graph.ask_later(ChangeState, f"{NODE}/change_state", transition=transition)
    robot.await_safe()
    assert robot.hangs(), "outputs are safe while Python hangs"
    assert not change.done(), "the transition is the node's"
    robot.graph.spin_until(lambda: "the transition follows" in robot.executor.output, "the log")
    robot.work()
    robot.graph.spin_until(change.done, "the transition")
    assert change.result().success, robot.executor.output
    assert robot.graph.ask(GetState, f"{NODE}/get_state").current_state.label == state
    assert robot.executor.end(signal.SIGTERM)[0] == 0


def test_requests_that_came_meanwhile_are_carried_out_in_order(robot: Hanging) -> None:
    robot.hang()
    wanted = [
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
    ]
    changes = [
        robot.graph.ask_later(ChangeState, f"{NODE}/change_state", transition=Transition(id=number))
        for number in wanted
    ]
    robot.await_safe()
    robot.work()
    robot.graph.spin_until(lambda: all(change.done() for change in changes), "the transitions")
    assert [change.result().success for change in changes] == [True] * len(wanted)
    assert robot.graph.ask(GetState, f"{NODE}/get_state").current_state.label == "inactive"
    refused = robot.ask("counter")
    assert (refused.success, refused.code) == (False, Code.NOT_ACTIVE), refused
    assert SILENT not in refused.message
    assert robot.executor.end(signal.SIGTERM)[0] == 0
