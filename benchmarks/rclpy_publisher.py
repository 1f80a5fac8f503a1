"""Publishes stamped points as one would with rclpy.

rclpy_publisher.py NAMESPACE TOPICS

A timer of a millisecond for each topic. Prints `ready` and the instant, then does what lines on the standard
input say: start, stop.
"""

import queue
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import Point
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.timer import Timer

_PERIOD_S = 0.001
_NS_PER_S = 1_000_000_000


def talking_timer(node: Node, topic: str) -> Timer:
    """A timer whose callback publishes a stamped point."""
    publisher = node.create_publisher(Point, topic, 10)
    number = 0

    def talk() -> None:
        nonlocal number
        number += 1
        seconds, nanoseconds = divmod(time.monotonic_ns(), _NS_PER_S)
        publisher.publish(Point(x=float(seconds), y=float(nanoseconds), z=float(number)))

    return node.create_timer(_PERIOD_S, talk, autostart=False)


def _read(lines: "queue.SimpleQueue[str]") -> None:
    for line in sys.stdin:
        lines.put(line.strip())


def main() -> None:
    """Run until it is ended."""
    namespace, topics = sys.argv[1], int(sys.argv[2])
    rclpy.init(args=[])
    node = rclpy.create_node("rclpy_publisher", namespace=namespace)
    timers = [talking_timer(node, f"point_{index}") for index in range(topics)]
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    print("ready", time.monotonic_ns(), flush=True)
    while True:
        executor.spin_once(timeout_sec=0.05)
        if not lines.empty():
            starting = lines.get() == "start"
            for timer in timers:
                timer.reset() if starting else timer.cancel()


if __name__ == "__main__":
    main()
