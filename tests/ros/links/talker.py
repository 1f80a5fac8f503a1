"""A program that speaks: a Float64 on TOPIC every PERIOD s, reliably, until it is killed."""

import sys
import time

import rclpy
from std_msgs.msg import Float64


def main() -> None:
    """Speak."""
    topic, period_s = sys.argv[1], float(sys.argv[2])
    rclpy.init()
    node = rclpy.create_node("talker", enable_rosout=False, start_parameter_services=False)
    publisher = node.create_publisher(Float64, topic, 10)
    due_s = time.monotonic()
    while True:
        publisher.publish(Float64(data=due_s))
        due_s = max(due_s + period_s, time.monotonic())
        time.sleep(max(due_s - time.monotonic(), 0.0))


if __name__ == "__main__":
    main()
