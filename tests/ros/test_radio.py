"""The radio between the robots: real topics, in the test's process."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from domains import draw_domain
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import wait_for_signals
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from mauve_examples.mission.medium import Medium
from mauve_examples.mission.radio_node import Radio
from mauve_msgs.msg import PeerMessage

ROBOTS = ["robot_1", "robot_2", "robot_3"]
PATIENCE_S = 100.0


class World:
    """Three robots' ends of the radio, and the radio."""

    def __init__(self, **settings: float) -> None:
        self.context = Context()
        rclpy.init(context=self.context, domain_id=draw_domain())
        self.executor = SingleThreadedExecutor(context=self.context)
        overrides = [Parameter("robots", value=ROBOTS), Parameter("drop_share", value=0.0)]
        overrides += [Parameter(name, value=value) for name, value in settings.items()]
        self.radio = Radio(context=self.context, parameter_overrides=overrides)
        self.node = Node("robots", context=self.context)
        self.executor.add_node(self.radio)
        self.executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = {robot: [] for robot in ROBOTS}
        self.states: list[bool] = []
        self.connected: list[bool] = []
        self.voices = {}
        for robot in ROBOTS:
            self.voices[robot] = self.node.create_publisher(PeerMessage, f"/{robot}/radio/out", 50)
            self.node.create_subscription(PeerMessage, f"/{robot}/radio/in", self.heard[robot].append, 50)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.node.create_subscription(Bool, "/radio/link", lambda m: self.states.append(m.data), latched)
        self.node.create_subscription(
            Bool, "/radio/connected", lambda m: self.connected.append(m.data), latched
        )
        self.set_link = self.node.create_client(SetBool, "/radio/set_link")
        self.until(lambda: self.connected[-1:] == [True])
        self.until(lambda: self.states[:1] == [True])
        self.until(lambda: all(voice.get_subscription_count() for voice in self.voices.values()))
        self.until(self.set_link.service_is_ready)

    def until(self, condition: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline_s, "it did not happen"
            self.executor.spin_once(timeout_sec=0.1)

    def cut(self, *, up: bool) -> Any:
        future = self.set_link.call_async(SetBool.Request(data=up))
        self.until(future.done)
        return future.result()

    def counts(self) -> list[int]:
        return [len(self.heard[robot]) for robot in ROBOTS]

    def close(self) -> None:
        self.executor.shutdown()
        self.radio.destroy_node()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def world() -> Iterator[World]:
    world = World()
    yield world
    world.close()


def test_everybody_but_the_sender_hears_what_is_said(world: World):
    world.voices["robot_2"].publish(PeerMessage(sender="robot_2", sequence=7, x=1.5))
    world.until(lambda: sum(world.counts()) == 2)
    assert world.counts() == [1, 0, 1]
    message = world.heard["robot_1"][0]
    assert (message.sender, message.sequence, message.x) == ("robot_2", 7, 1.5)


def test_a_cut_link_carries_nothing_until_it_is_back(world: World):
    reply = world.cut(up=False)
    assert (reply.success, reply.message) == (True, "link down")
    world.until(lambda: world.states[-1] is False)
    world.voices["robot_1"].publish(PeerMessage(sequence=1))
    world.until(lambda: world.radio.counts.dropped_link_down == 2)
    world.cut(up=True)
    world.voices["robot_1"].publish(PeerMessage(sequence=2))
    world.until(lambda: world.counts() == [0, 1, 1])
    assert world.heard["robot_2"][0].sequence == 2
    assert world.states == [True, False, True]


def test_the_share_that_is_lost_can_be_changed_and_is_counted(world: World):
    assert world.radio.set_parameters([Parameter("drop_share", value=1.0)])[0].successful
    for sequence in range(5):
        world.voices["robot_1"].publish(PeerMessage(sequence=sequence))
    world.until(lambda: world.radio.counts.dropped_at_random == 10)
    assert world.counts() == [0, 0, 0]
    assert not world.radio.set_parameters([Parameter("drop_share", value=1.5)])[0].successful
    assert not world.radio.set_parameters([Parameter("seed", value=5)])[0].successful


def test_equal_seeds_lose_the_same_messages():
    def fates(seed: int) -> list[list[str]]:
        medium = Medium(ROBOTS, drop_share=0.5, seed=seed)
        return [medium.receivers("robot_1") for _ in range(50)]

    assert fates(1) == fates(1)
    assert fates(1) != fates(2)


def test_about_the_share_is_lost():
    medium = Medium(ROBOTS, drop_share=0.3, seed=1)
    for _ in range(1000):
        medium.receivers("robot_1")
    assert 500 < medium.counts.dropped_at_random < 700
    assert medium.counts.forwarded == 2000 - medium.counts.dropped_at_random


@pytest.mark.parametrize("overrides", [[], [Parameter("robots", value=["robot_1", "robot_1"])]])
def test_bad_robots_are_refused(overrides: list[Any]):
    context = Context()
    rclpy.init(context=context, domain_id=draw_domain())
    try:
        with pytest.raises(ValueError, match="every robot once"):
            Radio(context=context, parameter_overrides=overrides)
    finally:
        rclpy.shutdown(context=context)


def test_a_second_ctrl_c_changes_nothing():
    """As `ros2 launch` sends one after that of the terminal."""
    radio = subprocess.Popen(
        [sys.executable, "-m", "mauve_examples.mission.radio", "--ros-args", "-p", "robots:=[a, b]"],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"ROS_DOMAIN_ID": str(draw_domain())},
    )
    wait_for_signals(radio.pid)
    for _ in range(2):
        radio.send_signal(signal.SIGINT)
        time.sleep(0.01)
    _, errors = radio.communicate(timeout=PATIENCE_S)
    assert (radio.returncode, errors) == (0, "")


def test_the_link_changes_so_long_after_all_have_met():
    world = World(link_loss_at_s=0.3, link_back_at_s=0.5)
    try:
        world.until(lambda: world.states == [True, False, True])
        assert world.radio.set_parameters([Parameter("link_loss_at_s", value=9.0)])[0].successful is False
    finally:
        world.close()
