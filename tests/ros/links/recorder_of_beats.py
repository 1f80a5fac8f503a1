"""Writes a line for each message of a topic: when it came (s of CLOCK_MONOTONIC), and its value.

listener.py TOPIC FILE
"""

import sys
import time
from pathlib import Path

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


def main() -> None:
    topic, path = sys.argv[1:]
    rclpy.init()
    node = Node("recorder_of_beats")
    with Path(path).open("w", encoding="utf-8", buffering=1) as file:
        node.create_subscription(
            Float64, topic, lambda message: file.write(f"{time.monotonic()} {message.data}\n"), 100
        )
        rclpy.spin(node)


main()
