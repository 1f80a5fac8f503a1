"""The action drive_to of the example mission: a robot drives to poses while its guidance is replaced."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from rcl_interfaces.msg import Log
from rclpy.action import ActionClient

from mauve_msgs.action import DriveTo
from mauve_msgs.msg import ComponentInfo
from mauve_msgs.srv import ListComponents, ReplaceCore

NODE = "/robot_1/executor"
ROBOT = Path(__file__).parents[3] / "mauve_examples" / "architecture" / "robot.yaml"


class Operator:
    """Sends poses to the robot."""

    def __init__(self, graph: Any) -> None:
        self.graph = graph
        self.feedback: list[Any] = []
        self._client = ActionClient(graph.node, DriveTo, "/robot_1/drive_to")
        graph.spin_until(self._client.server_is_ready, "the action")

    def send(self, frame: str, **position: float) -> Any:
        """Send a goal until it is accepted, as a robot without a pose answers none: its future result."""
        goal = DriveTo.Goal()
        goal.pose.header.frame_id = frame
        for axis, metres in position.items():
            setattr(goal.pose.pose.position, axis, metres)
        while True:
            sent = self._client.send_goal_async(goal, lambda message: self.feedback.append(message.feedback))
            self.graph.spin_until(sent.done, "an answer")
            if sent.result().accepted:
                return sent.result().get_result_async()

    def ended(self, result: Any) -> Any:
        self.graph.spin_until(result.done, "a result")
        return result.result()


@pytest.fixture
def operator(start_executor: Callable[..., Any], graph: Any) -> Operator:
    start_executor("-p", f"architecture:={ROBOT}")
    return Operator(graph)


def test_the_robot_drives_to_a_goal_with_feedback(operator: Operator) -> None:
    graph = operator.graph
    result = operator.send("robot_1/odom", x=3.0)
    graph.spin_until(lambda: len(operator.feedback) > 1, "feedback")
    reply = graph.ask(
        ReplaceCore, f"{NODE}/replace_core", component="guidance", core="mauve_examples/Guidance"
    )
    assert reply.success, reply.message
    ended = operator.ended(result)
    assert (ended.status, ended.result.reached) == (GoalStatus.STATUS_SUCCEEDED, True)
    assert ended.result.distance_m <= 0.5, "the target_threshold of guidance"
    assert operator.feedback[0].distance_m > operator.feedback[-1].distance_m
    elapsed = [each.elapsed_s for each in operator.feedback]
    assert elapsed == sorted(elapsed), "the new core went on with the goal"
    parts = graph.ask(ListComponents, f"{NODE}/list_components").components
    assert {each.state for each in parts} == {ComponentInfo.RUNNING}


def test_the_log_says_why_a_goal_is_aborted(operator: Operator) -> None:
    lines = operator.graph.hear(Log, "/rosout")
    ended = operator.ended(operator.send("nowhere"))
    assert (ended.status, ended.result.reached) == (GoalStatus.STATUS_ABORTED, False)
    expected = "is aborted: frame nowhere: unknown frame"
    operator.graph.spin_until(lambda: any(expected in line.msg for line in lines), "the line")
