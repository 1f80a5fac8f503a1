"""A managed node of rclpy that does nothing, to see what the start of any costs.

Prints `ready`, the instant, and the CPU time of its process in ms so far, when it is about to spin.
"""

import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode


def main() -> None:
    """Run until it is ended."""
    rclpy.init(args=[])
    node = LifecycleNode("rclpy_lifecycle")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    print("ready", time.monotonic_ns(), time.process_time() * 1e3, flush=True)
    try:
        executor.spin()
    finally:
        node.destroy_node()
        node._state_machine.destroy_when_not_in_use()  # noqa: SLF001 - it would stay in /dev/shm else


if __name__ == "__main__":
    main()
