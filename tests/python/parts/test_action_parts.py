"""Goals of actions in programs: components in Python and in C++, on threads and in virtual time, alike."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from python_parts import ActFsm, Stage
from running_host import Running

from mauve_msgs.action import DriveTo
from mauve_msgs.msg import ActionGoal
from mauve_rt.api import (
    ActionClient,
    ActionServer,
    Core,
    GoalEvent,
    GoalReason,
    GoalSender,
    GoalState,
    MauveError,
    Shell,
    Transaction,
    action_client,
    action_server,
)
from mauve_rt.model import PluginIndex
from mauve_rt.model.plugins import PluginLoader

MS = 1_000_000
PORTS = ("status", "goal", "decide", "feedback", "result")
PACKAGES = {"cpp": "executor_tests", "python": "action_tests", "mixed": "action_tests"}
Event = GoalEvent[Any, Any]


class Served:
    """A host with a component that executes goals, and what became of the goals that a test sends."""

    def __init__(self, running: Running, package: str) -> None:
        self.running = running
        self.package = package
        self.sender = GoalSender(running.host, "drive", DriveTo)
        self.received: list[Event] = []

    def ask(self, far: float) -> int:
        goal = DriveTo.Goal()
        goal.pose.pose.position.x = far
        return self.sender.ask(goal)

    def of(self, goal: int) -> list[Event]:
        self.received += self.sender.events()
        return [each for each in self.received if each.goal == goal]

    def left(self, goal: int) -> list[float]:
        """How far the component was, by the feedback."""
        return [each.feedback.distance_m for each in self.of(goal) if each.feedback is not None]

    def until(self, condition: Callable[[], object]) -> None:
        self.running.run_until(condition)

    def end(self, goal: int) -> Event:
        """The last event of a goal, which ends."""
        self.until(lambda: any(each.state.is_final for each in self.of(goal)))
        return self.of(goal)[-1]


@pytest.fixture(params=PACKAGES)
def served(
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    plugin_prefix: Path,
    action_prefix: Path,
    way: str,
) -> Iterator[Served]:
    """In Python with a type that only Python knows, with a type of a library, and in C++."""
    paths = os.pathsep.join([str(action_prefix), os.environ["AMENT_PREFIX_PATH"]])
    monkeypatch.setenv("AMENT_PREFIX_PATH", paths)
    package = PACKAGES[request.param]
    with Stage() as stage:
        loader = PluginLoader(stage.registry, PluginIndex.installed())
        names = [(kind, f"{package}/Driver{kind.title()}") for kind in ("shell", "fsm")]
        for kind, name in (*names, ("core", f"{package}/Driver")):
            loader.require(kind, name)
        if request.param == "mixed":
            loader.require("action_type", "mauve_msgs/action/DriveTo")
        assert ("mauve_msgs/action/DriveTo" in stage.registry.names("action_type")) == (
            request.param != "python"
        )
        shell, fsm = (name for _, name in names)
        stage.add("driver", shell, f"{package}/Driver", fsm)
        stage.share(
            "drive", ActionServer(DriveTo, goals=2), *(f"driver.drive_{each}.{each}" for each in PORTS)
        )
        running = Running(stage, simulated=way == "virtual")
        running.deploy()
        yield Served(running, package)
        running.host.shutdown()


@pytest.fixture(params=["threads", "virtual"])
def way(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_a_goal_is_executed_with_feedback_and_a_result_in_any_language(served: Served) -> None:
    goal = served.ask(20.0)
    ended = served.end(goal)
    assert (ended.state, ended.reason) == (GoalState.SUCCEEDED, GoalReason.NONE)
    assert ended.result.reached
    assert served.left(goal)
    assert served.left(goal) == sorted(served.left(goal), reverse=True)
    back = served.end(served.ask(-1.0))
    assert (back.state, back.result.distance_m) == (GoalState.ABORTED, -1.0)


def test_a_goal_is_canceled_in_any_language(served: Served) -> None:
    first, second = served.ask(1e9), served.ask(2.0)
    served.until(lambda: served.left(first))
    assert served.sender.cancel(second)
    assert served.end(second).state == GoalState.CANCELED, "it waited for its turn"
    assert served.sender.cancel(first)
    ended = served.end(first)
    assert ended.state == GoalState.CANCELED
    assert 0.0 < ended.result.distance_m < 1e9, "where the component was"
    assert not served.sender.cancel(first), "it has ended"


def test_more_goals_than_allowed_are_rejected_in_any_language(served: Served) -> None:
    first, second, third = (served.ask(1e9) for _ in range(3))
    assert [(each.state, each.reason) for each in served.of(third)] == [(GoalState.REJECTED, GoalReason.FULL)]
    assert GoalReason.FULL.text == "there are as many goals as allowed"
    served.until(lambda: served.of(first) and served.of(second))
    assert not any(each.state.is_final for each in served.of(first) + served.of(second))


def test_a_goal_survives_a_replacement_of_the_core_in_any_language(served: Served) -> None:
    goal = served.ask(1e6)
    served.until(lambda: len(served.left(goal)) > 3)
    served.running.host.commit(Transaction().replace_core("driver", f"{served.package}/Driver"))
    before = len(served.left(goal))
    served.until(lambda: len(served.left(goal)) > before + 3)
    assert served.left(goal) == sorted(served.left(goal), reverse=True), "the new core went on"
    assert served.sender.cancel(goal)
    assert served.end(goal).state == GoalState.CANCELED


def test_goals_are_aborted_when_the_component_stops_in_any_language(served: Served) -> None:
    running, waiting = served.ask(1e9), served.ask(2.0)
    served.until(lambda: served.left(running))
    served.running.host.stop("driver")
    for goal in (running, waiting):
        ended = served.end(goal)
        assert (ended.state, ended.reason) == (GoalState.ABORTED, GoalReason.STOPPED)
    assert min(served.left(running)) > 0.0, "the default values that a stop writes are no feedback"
    served.running.host.start("driver")
    assert served.end(served.ask(2.0)).state == GoalState.SUCCEEDED


def test_states_and_reasons_are_those_of_the_message() -> None:
    constants = {name for name in dir(ActionGoal) if isinstance(getattr(ActionGoal, name), int)}
    assert constants == {*GoalState.__members__, *GoalReason.__members__}
    states = {name: getattr(ActionGoal, name) for name in GoalState.__members__}
    reasons = {name: getattr(ActionGoal, name) for name in GoalReason.__members__}
    assert states == {name: int(each) for name, each in GoalState.__members__.items()}
    assert reasons == {name: int(each) for name, each in GoalReason.__members__.items()}


class BigShell(Shell):
    drive = action_server(DriveTo)


class BigCore(Core[BigShell]):
    said: tuple[bool, ...] = ()

    def act(self) -> None:
        drive = self.shell.drive
        if drive.state() == GoalState.EXECUTING and drive.goal().is_new:
            BigCore.said = (
                drive.cancel(),
                drive.feedback(DriveTo.Feedback()),
                drive.succeed(),
                drive.succeed(),
            )


def test_a_goal_that_is_too_large_is_refused(way: str) -> None:
    with Stage() as stage:
        stage.add("driver", BigShell, BigCore)
        with pytest.raises(MauveError, match="max_bytes: the resource has no room"):
            stage.architecture.add_resource("small", ActionServer(DriveTo, max_bytes=10))
        ports = [f"driver.drive_{each}.{each}" for each in PORTS]
        stage.share("drive", ActionServer(DriveTo, max_bytes=200), *ports)
        running = Running(stage, simulated=way == "virtual")
        running.deploy()
        sender = GoalSender(running.host, "drive", DriveTo)
        goal = DriveTo.Goal()
        goal.pose.header.frame_id = "x" * 200
        refused = sender.ask(goal)
        assert sender.events() == [GoalEvent(refused, GoalState.REJECTED, GoalReason.MALFORMED)]
        BigCore.said = ()
        number, found = sender.ask(DriveTo.Goal()), []

        def has_ended() -> bool:
            found.extend(sender.events())
            return any(each.goal == number and each.state.is_final for each in found)

        running.run_until(has_ended)
        assert found[-1].result == DriveTo.Result()
        assert BigCore.said == (False, True, True, False), "no cancel was asked for; one goal ends once"
        with pytest.raises(TypeError, match="expected"):
            sender.ask(DriveTo.Result())
        running.host.shutdown()


class SendShell(Shell):
    drive = action_client(DriveTo)


class SendCore(Core[SendShell]):
    seen: tuple[Any, ...] = ()

    def act(self) -> None:
        drive = self.shell.drive
        sent = drive.send(DriveTo.Goal())
        again = drive.send(DriveTo.Goal())
        SendCore.seen = (
            sent,
            again,
            drive.number(),
            drive.state(),
            drive.result().status,
            drive.feedback().status,
        )
        drive.cancel()
        SendCore.seen += (drive.state(), drive.reason())


def test_a_client_in_python_sends_one_goal_at_a_time(way: str) -> None:
    SendCore.seen = ()
    with Stage() as stage:
        stage.add("sender", SendShell, SendCore, ActFsm)
        stage.share("drive", ActionClient(DriveTo), *(f"sender.drive_{each}.{each}" for each in PORTS))
        running = Running(stage, simulated=way == "virtual")
        running.deploy()
        with pytest.raises(MauveError, match="a resource of kind action_server"):
            GoalSender(running.host, "drive", DriveTo).ask(DriveTo.Goal())
        running.run_until(lambda: SendCore.seen)
        running.host.shutdown()
        sent, again, number, *rest = SendCore.seen
        assert (sent, again, number > 0) == (True, False, True)
        assert rest == [GoalState.UNKNOWN, "none", "none", GoalState.CANCELED, GoalReason.NONE]


def test_each_component_has_ports_of_its_own() -> None:
    first, second = BigShell(), BigShell()
    assert first.drive is not second.drive
    assert first.drive.ports["goal"] is not second.drive.ports["goal"]
    with pytest.raises(TypeError, match="expected a class of a ROS action"):
        action_server(DriveTo.Goal)
    with pytest.raises(TypeError, match="expected a class of a ROS action"):
        action_server("mauve_msgs/action/DriveTo")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="expected a class of a ROS action"):
        ActionClient(DriveTo.Goal)
