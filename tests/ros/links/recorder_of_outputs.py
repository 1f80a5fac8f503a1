"""Writes a line for each message of a robot's outputs: time (s of CLOCK_MONOTONIC), topic, value.

    recorder_of_outputs.py FILE TIMEOUT_S TOPIC...

The name of a topic begins with its quality of service. As the driver of a reliable topic the program also
writes `watch/TOPIC` each time the command changes. Each line on stdin is a topic and a value to publish: the
file gets the instant before.
"""

import sys
import threading
import time
from functools import partial
from pathlib import Path
from typing import Any

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64

from mauve_rt.driver import CommandWatch

LOOP_S = 0.005


class Recorder:
    """Outputs of one robot as one computer receives them."""

    def __init__(self, node: Node, path: Path, timeout_s: float, topics: list[str]) -> None:
        self._node = node
        self._file = path.open("w", encoding="utf-8", buffering=1)
        self._watches = {topic: CommandWatch(timeout_s, safe=0.0) for topic in topics if "reliable" in topic}
        self._publishers: dict[str, Any] = {}
        self._commands = dict.fromkeys(self._watches, 0.0)
        for topic in topics:
            reliability = ReliabilityPolicy[topic.partition("/")[0].upper()]
            qos = QoSProfile(depth=100, reliability=reliability, deadline=Duration(seconds=timeout_s))
            node.create_subscription(Float64, topic, partial(self._received, topic), qos)
        node.create_timer(LOOP_S, self._drive)

    def _write(self, topic: str, value: float) -> None:
        self._file.write(f"{time.monotonic()} {topic} {value}\n")

    def _received(self, topic: str, message: Float64) -> None:
        self._write(topic, message.data)
        if topic in self._watches:
            self._watches[topic].received(message.data)

    def _drive(self) -> None:
        for topic, watch in self._watches.items():
            command = watch.value
            if command != self._commands[topic]:
                self._commands[topic] = command
                self._write(f"watch/{topic}", command)

    def publish(self) -> None:
        """Publish what stdin says, each once a subscriber is there."""
        for line in sys.stdin:
            topic, value = line.split()
            if topic not in self._publishers:
                self._publishers[topic] = self._node.create_publisher(Float64, topic, 10)
            publisher = self._publishers[topic]
            while not publisher.get_subscription_count():
                time.sleep(0.01)
            self._write(topic, float(value))
            publisher.publish(Float64(data=float(value)))


def main() -> None:
    path, timeout_s, *topics = sys.argv[1:]
    rclpy.init()
    node = Node("recorder_of_outputs")
    recorder = Recorder(node, Path(path), float(timeout_s), topics)
    threading.Thread(target=recorder.publish, daemon=True).start()
    rclpy.spin(node)


main()
