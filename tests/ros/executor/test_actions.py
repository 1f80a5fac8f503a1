"""ROS actions: an executor serves goals of rclpy's client, and sends goals to rclpy's server."""

import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64

from mauve_msgs.action import DriveTo
from mauve_msgs.msg import (
    ActionGoal,
    ArchitectureState,
    ComponentInfo,
    ReconfigurationStep,
    SupervisorDecision,
)
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop

NODE = "/robot_1/executor"
DRIVE = "/robot_1/drive"
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
PORTS = ("status", "goal", "decide", "feedback", "result")
DRIVER = "{shell: executor_tests/DriverShell, core: executor_tests/Driver, fsm: executor_tests/DriverFsm}"
SERVER = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  driver: {DRIVER}
resources:
  drive:
    {{kind: action_server, type: mauve_msgs/action/DriveTo, goals: 3,
     action: {{name: drive, answer_ms: 3000}}}}
connections:
""" + "".join(f"  - [driver.drive_{port}, drive.{port}]\n" for port in PORTS)
OTHER = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
"""
CLIENT = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  passenger: {shell: executor_tests/PassengerShell, core: executor_tests/Passenger,
              fsm: executor_tests/PassengerFsm}
resources:
  drive: {kind: action_client, type: mauve_msgs/action/DriveTo, action: {name: /taxi/drive, answer_ms: 5000}}
  wish: {kind: shared_data, type: std_msgs/msg/Float64,
         topic: {name: wish, direction: subscribe, qos: reliable}}
  said: {kind: shared_data, type: std_msgs/msg/Float64,
         topic: {name: said, direction: publish, qos: reliable}}
connections:
  - [passenger.wish, wish.read]
  - [passenger.said, said.write]
""" + "".join(f"  - [passenger.drive_{port}, drive.{port}]\n" for port in PORTS)


class Rider:
    """Goals of rclpy's client."""

    def __init__(self, graph: Any) -> None:
        self.graph = graph
        self.client = ActionClient(graph.node, DriveTo, DRIVE)
        self.left: list[float] = []
        graph.spin_until(self.client.server_is_ready, "the action")

    def ask(self, far: float, count: int = 1) -> list[Any]:
        """The handles of so many goals, each answered."""
        goal = DriveTo.Goal()
        goal.pose.pose.position.x = far
        futures = [
            self.client.send_goal_async(goal, lambda message: self.left.append(message.feedback.distance_m))
            for _ in range(count)
        ]
        return [self.get(future, "an answer") for future in futures]

    def accepted(self, far: float) -> Any:
        """The handle of a goal, asked for until there is room for it."""
        while not (handle := self.ask(far)[0]).accepted:
            pass
        return handle

    def get(self, future: Any, what: str) -> Any:
        self.graph.spin_until(future.done, what)
        return future.result()

    def result(self, handle: Any) -> Any:
        return self.get(handle.get_result_async(), "a result")

    def until(self, condition: Callable[[], bool], what: str) -> None:
        self.graph.spin_until(condition, what)


@pytest.fixture(params=["executor_tests", "action_tests"], ids=["cpp", "python"])
def parts(request: pytest.FixtureRequest) -> str:
    """The package of the parts: in C++ with the action's type, or in Python without a library of the type."""
    return str(request.param)


@pytest.fixture
def serve(
    start_executor: Callable[..., Any], tmp_path: Path, plugin_prefix: Path, action_prefix: Path, parts: str
) -> Callable[..., Any]:
    searched = os.environ["AMENT_PREFIX_PATH"].split(os.pathsep)
    if parts == "action_tests":
        searched = [str(action_prefix), *(each for each in searched if each != str(plugin_prefix))]

    def start(text: str = SERVER) -> Any:
        path = tmp_path / "actions.yaml"
        path.write_text(text.replace("executor_tests/", f"{parts}/"), encoding="utf-8")
        environment = {"AMENT_PREFIX_PATH": os.pathsep.join(searched)}
        return start_executor("-p", f"architecture:={path}", environment=environment)

    return start


@pytest.fixture
def rider(serve: Callable[..., Any], graph: Any) -> Rider:
    serve()
    return Rider(graph)


def counts(graph: Any) -> Any:
    """What /diagnostics says of the action."""
    arrays = graph.hear(DiagnosticArray, "/diagnostics")
    graph.spin_until(lambda: bool(arrays), "a status")
    arrays.clear()
    graph.spin_until(lambda: bool(arrays), "a later status")
    status = next(each for each in arrays[-1].status if DRIVE in each.name)
    return {each.key: each.value for each in status.values}


def test_a_goal_is_executed_with_feedback_and_a_result(rider: Rider) -> None:
    (handle,) = rider.ask(400.0)
    assert handle.accepted
    rider.until(lambda: len(rider.left) > 3, "feedback")
    ended = rider.result(handle)
    assert ended.status == GoalStatus.STATUS_SUCCEEDED
    assert (ended.result.reached, ended.result.distance_m) == (True, 0.0)
    assert rider.left == sorted(rider.left, reverse=True)
    again = rider.result(handle)
    assert again.status == GoalStatus.STATUS_SUCCEEDED, "a result may be asked for again"
    (back,) = rider.ask(-1.0)
    assert rider.result(back).status == GoalStatus.STATUS_ABORTED, "the component's decision"
    values = counts(rider.graph)
    assert (values["accepted"], values["succeeded"], values["aborted"]) == ("2", "1", "1")


def test_a_goal_is_canceled(rider: Rider) -> None:
    first, second = rider.ask(1e9, 2)
    rider.until(lambda: len(rider.left) > 3, "feedback")
    reply = rider.get(second.cancel_goal_async(), "the answer to a cancel")
    assert [bytes(each.goal_id.uuid) for each in reply.goals_canceling] == [bytes(second.goal_id.uuid)]
    assert rider.result(second).status == GoalStatus.STATUS_CANCELED, "it waited for its turn"
    rider.get(first.cancel_goal_async(), "the answer to a cancel")
    ended = rider.result(first)
    assert ended.status == GoalStatus.STATUS_CANCELED
    assert 0.0 < ended.result.distance_m < 1e9, "where the component was"
    late = rider.get(first.cancel_goal_async(), "the answer to a late cancel")
    assert not late.goals_canceling


def test_a_goal_survives_a_replacement_of_the_core(rider: Rider, parts: str) -> None:
    (handle,) = rider.ask(400.0)
    rider.until(lambda: len(rider.left) > 3, "feedback")
    reply = rider.graph.ask(ReplaceCore, f"{NODE}/replace_core", component="driver", core=f"{parts}/Driver")
    assert reply.success, reply.message
    ended = rider.result(handle)
    assert (ended.status, ended.result.reached) == (GoalStatus.STATUS_SUCCEEDED, True)
    assert rider.left == sorted(rider.left, reverse=True), "the new core went on where the old one was"


def test_a_goal_is_aborted_when_its_component_stops(rider: Rider) -> None:
    graph = rider.graph
    running, waiting = rider.ask(1e9, 2)
    rider.until(lambda: len(rider.left) > 3, "feedback")
    assert graph.ask(Stop, f"{NODE}/stop", component="driver").success
    for handle in (running, waiting):
        assert rider.result(handle).status == GoalStatus.STATUS_ABORTED
    assert min(rider.left) > 0.0, "the stop's default values are no feedback"
    assert graph.ask(Start, f"{NODE}/start", component="driver").success
    (handle,) = rider.ask(2.0)
    assert rider.result(handle).status == GoalStatus.STATUS_SUCCEEDED


def test_a_goal_is_aborted_when_its_action_is_removed(serve: Callable[..., Any], graph: Any) -> None:
    executor = serve()
    rider = Rider(graph)
    (handle,) = rider.ask(1e9)
    result = handle.get_result_async()
    rider.until(lambda: len(rider.left) > 3, "feedback")
    executor.process.terminate()
    assert rider.get(result, "the last result").status == GoalStatus.STATUS_ABORTED


def test_a_component_that_does_not_answer_has_its_goals_rejected(
    serve: Callable[..., Any], graph: Any
) -> None:
    asleep = SERVER.replace("core: executor_tests/Driver,", "core: executor_tests/Asleep,")
    serve(asleep.replace("executor_tests/DriverFsm", "executor_tests/AsleepFsm").replace("3000", "300"))
    rider = Rider(graph)
    began = time.monotonic()
    (handle,) = rider.ask(1.0)
    assert not handle.accepted
    assert time.monotonic() - began > 0.25


def test_a_thousand_goals_at_once_do_no_harm(rider: Rider) -> None:
    """The middleware keeps a few requests and replies of a service, and loses the others."""
    goal = DriveTo.Goal()
    goal.pose.pose.position.x = 1e9
    for _ in range(1000):
        rider.client.send_goal_async(goal)
    rider.until(lambda: int(counts(rider.graph)["accepted"]) == 3, "as many goals as allowed")
    assert int(counts(rider.graph)["rejected"]) > 0
    cancel = rider.graph.node.create_client(CancelGoal, f"{DRIVE}/_action/cancel_goal")
    reply = rider.get(cancel.call_async(CancelGoal.Request()), "the answer to a cancel of all")
    assert len(reply.goals_canceling) == 3
    handle = rider.accepted(2.0)
    assert rider.result(handle).status == GoalStatus.STATUS_SUCCEEDED


def test_clients_that_ask_for_nothing_more_block_nobody(rider: Rider) -> None:
    """Their results are never asked for; one cancels what it never asked for; one is gone."""
    cancel = rider.graph.node.create_client(CancelGoal, f"{DRIVE}/_action/cancel_goal")
    request = CancelGoal.Request()
    request.goal_info.goal_id.uuid = [7] * 16
    reply = rider.get(cancel.call_async(request), "the answer to a cancel")
    assert reply.return_code == CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
    for _ in range(20):
        rider.accepted(1.0)
    gone = Rider(rider.graph)
    gone.accepted(300.0)
    gone.client.destroy()
    handle = rider.accepted(2.0)
    assert rider.result(handle).status == GoalStatus.STATUS_SUCCEEDED


def test_list_shows_the_action(rider: Rider) -> None:
    reply = rider.graph.ask(ListComponents, f"{NODE}/list_components")
    drive = next(resource for resource in reply.resources if resource.name == "drive")
    assert (drive.kind, drive.type, drive.offers) == ("action_server", "mauve_msgs/action/DriveTo", DRIVE)


class Taxi:
    """rclpy's server, which drives until it is let go, or canceled."""

    def __init__(self, graph: Any) -> None:
        self.let_go = threading.Event()
        self.accepts = True
        self.server = ActionServer(
            graph.node,
            DriveTo,
            "/taxi/drive",
            self._drive,
            goal_callback=lambda _: GoalResponse.ACCEPT if self.accepts else GoalResponse.REJECT,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    async def _drive(self, handle: Any) -> Any:
        handle.publish_feedback(DriveTo.Feedback(distance_m=handle.request.pose.pose.position.x))
        if handle.request.pose.pose.position.x > 1000.0:
            handle.abort()
        else:
            handle.succeed()
        return DriveTo.Result(reached=handle.status == GoalStatus.STATUS_SUCCEEDED)


def test_a_component_sends_goals(serve: Callable[..., Any], graph: Any) -> None:
    taxi = Taxi(graph)
    serve(CLIENT)
    said = graph.hear(Float64, "/robot_1/said")
    wish = graph.voice(Float64, "/robot_1/wish")

    def until(number: int, state: int, reason: int = ActionGoal.NONE) -> None:
        code = number * 1000.0 + state * 100.0 + reason
        graph.spin_until(lambda: bool(said) and said[-1].data == code, f"{code}, {said[-3:]}")

    wish.publish(Float64(data=5.0))
    until(1, ActionGoal.SUCCEEDED)
    wish.publish(Float64(data=5000.0))
    until(2, ActionGoal.ABORTED)
    taxi.accepts = False
    wish.publish(Float64(data=6.0))
    until(3, ActionGoal.REJECTED)
    taxi.server.destroy()
    graph.spin_until(
        lambda: not ActionClient(graph.node, DriveTo, "/taxi/drive").server_is_ready(), "its end"
    )
    wish.publish(Float64(data=7.0))
    until(4, ActionGoal.REJECTED, ActionGoal.NO_SERVER)


def test_a_transaction_adds_an_action(serve: Callable[..., Any], graph: Any, parts: str) -> None:
    serve(OTHER)
    steps = [
        ReconfigurationStep(
            kind="add_resource",
            target="drive",
            value="{kind: action_server, type: mauve_msgs/action/DriveTo, action: {name: drive}}",
        ),
        ReconfigurationStep(
            kind="add_component",
            target="driver",
            value=DRIVER.replace("executor_tests/", f"{parts}/"),
        ),
        *(
            ReconfigurationStep(kind="connect", target="driver", name=f"drive_{port}", value=f"drive.{port}")
            for port in PORTS
        ),
        ReconfigurationStep(kind="start", target="driver"),
    ]
    reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    assert reply.success, reply.message
    rider = Rider(graph)
    (handle,) = rider.ask(3.0)
    assert rider.result(handle).status == GoalStatus.STATUS_SUCCEEDED
    (handle,) = rider.ask(1e9)
    result = handle.get_result_async()
    steps = [
        ReconfigurationStep(kind="remove_component", target="driver"),
        ReconfigurationStep(kind="remove_resource", target="drive"),
    ]
    reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    assert reply.success, reply.message
    assert rider.get(result, "the last result").status == GoalStatus.STATUS_ABORTED


WATCHED = SERVER.replace("resources:\n", OTHER.partition("components:\n")[2] + "resources:\n")
SLOW = """\
mauve: 1
rules:
  - name: watch
    when: {action: {resource: drive, is: overdue, longer_than_s: 0.5}}
    do: [{kind: replace_core, target: counter, name: executor_tests/Backwards}]
    undo: {}
"""
FAILED = """\
mauve: 1
rules:
  - name: watch
    when: {action: {resource: drive, is: aborted}}
    do: [{kind: stop, target: driver}]
"""


class Watched:
    """An executor whose rule watches the goals of its action."""

    def __init__(self, start_executor: Callable[..., Any], graph: Any, folder: Path, rules: str) -> None:
        for name, text in (("robot", WATCHED), ("rules", rules)):
            (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
        words = [f"architecture:={folder / 'robot.yaml'}", f"rules:={folder / 'rules.yaml'}"]
        start_executor(*(word for each in words for word in ("-p", each)))
        self.graph = graph
        self.decisions = graph.hear(SupervisorDecision, f"{NODE}/decisions", LATCHED)
        self.states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
        self.rider = Rider(graph)

    def shows(self, component: str) -> Any:
        newest = self.states[-1].components if self.states else []
        return next((each for each in newest if each.name == component), None)

    def until_shown(self, component: str, **facts: Any) -> None:
        def is_shown() -> bool:
            shown = self.shows(component)
            return shown is not None and all(getattr(shown, name) == fact for name, fact in facts.items())

        self.graph.spin_until(is_shown, f"{component}: {facts}")

    def reasons(self, decision: str) -> list[str]:
        return [each.reason for each in self.decisions if each.decision == decision]


def test_a_rule_replaces_a_core_while_a_goal_is_overdue(
    start_executor: Callable[..., Any], graph: Any, tmp_path: Path, plugin_prefix: Path
) -> None:
    watched = Watched(start_executor, graph, tmp_path, SLOW)
    watched.until_shown("counter", core="executor_tests/Counter")
    (handle,) = watched.rider.ask(1e9)
    watched.until_shown("counter", core="executor_tests/Backwards")
    watched.graph.spin_until(lambda: bool(watched.reasons("do")), "the decision")
    assert watched.reasons("do") == ["a goal of drive is overdue"]
    watched.rider.get(handle.cancel_goal_async(), "the answer to a cancel")
    assert watched.rider.result(handle).status == GoalStatus.STATUS_CANCELED
    watched.until_shown("counter", core="executor_tests/Counter")


def test_a_rule_stops_a_component_when_a_goal_was_aborted(
    start_executor: Callable[..., Any], graph: Any, tmp_path: Path, plugin_prefix: Path
) -> None:
    watched = Watched(start_executor, graph, tmp_path, FAILED)
    (handle,) = watched.rider.ask(2.0)
    assert watched.rider.result(handle).status == GoalStatus.STATUS_SUCCEEDED
    (handle,) = watched.rider.ask(-1.0)
    assert watched.rider.result(handle).status == GoalStatus.STATUS_ABORTED
    watched.until_shown("driver", state=ComponentInfo.STOPPED)
    watched.graph.spin_until(lambda: bool(watched.reasons("do")), "the decision")
    assert watched.reasons("do") == ["a goal of drive is aborted"]
