"""A bare std_srvs/Trigger service of rclpy, the reference of a service call: trigger_server.py SERVICE."""

import signal
import sys

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger


def main() -> None:
    """Serve until interrupted."""
    ended: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _frame: ended.append(number))
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("bench_trigger")

    def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success = True
        return response

    node.create_service(Trigger, sys.argv[1], answer)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    print("ready", flush=True)
    while not ended:
        executor.spin_once(timeout_sec=0.5)


if __name__ == "__main__":
    main()
