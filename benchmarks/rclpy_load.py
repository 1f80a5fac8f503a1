"""Keeps an executor's Python side busy: asks for its components as fast as it answers, hears a topic.

rclpy_load.py EXECUTOR TOPIC

Prints `busy` once the first answer and the first message were there; on SIGINT what it did.
"""

import signal
import sys
import time
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import Float64

from mauve_msgs.srv import ListComponents

IN_FLIGHT = 4


def main() -> None:
    """Run until interrupted."""
    executor_name, topic = sys.argv[1:3]
    ended: list[int] = []
    signal.signal(
        signal.SIGINT, lambda number, _frame: ended.append(number)
    )  # an exception may strike anywhere
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("bench_load")
    client = node.create_client(ListComponents, f"{executor_name}/list_components")
    counts = {"answers": 0, "messages": 0}

    def heard(_message: Float64) -> None:
        counts["messages"] += 1

    def answered(_future: Any) -> None:
        counts["answers"] += 1
        ask()

    def ask() -> None:
        future: Any = client.call_async(ListComponents.Request())
        future.add_done_callback(answered)

    node.create_subscription(Float64, topic, heard, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not (client.service_is_ready() or ended):
        executor.spin_once(timeout_sec=0.5)
    for _ in range(IN_FLIGHT):
        ask()
    while not (all(counts.values()) or ended):
        executor.spin_once(timeout_sec=0.5)
    began_s = time.monotonic()
    counts.update(dict.fromkeys(counts, 0))
    sys.stdout.write("busy\n")
    sys.stdout.flush()
    while not ended:
        executor.spin_once(timeout_sec=0.5)
    per_s = {name: count / max(1e-9, time.monotonic() - began_s) for name, count in counts.items()}
    print(f"rclpy side busy with {per_s['answers']:.0f} list_components calls a second", flush=True)


if __name__ == "__main__":
    main()
