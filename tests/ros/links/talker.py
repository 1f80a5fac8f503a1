"""A program that speaks: a Float64 on TOPIC every PERIOD s, reliably, until it is killed.

Into FILE it writes when, by CLOCK_MONOTONIC, as a double each.
"""

import struct
import sys
import time
from pathlib import Path

import rclpy
from std_msgs.msg import Float64


def main() -> None:
    """Speak."""
    topic, period_s = sys.argv[1], float(sys.argv[2])
    file = Path(sys.argv[3]).open("ab", buffering=0)  # noqa: SIM115 - until it is killed
    rclpy.init()
    node = rclpy.create_node("talker", enable_rosout=False, start_parameter_services=False)
    publisher = node.create_publisher(Float64, topic, 10)
    due_s = time.monotonic()
    while True:
        publisher.publish(Float64(data=due_s))
        file.write(struct.pack("d", time.monotonic()))
        due_s = max(due_s + period_s, time.monotonic())
        time.sleep(max(due_s - time.monotonic(), 0.0))


if __name__ == "__main__":
    main()
