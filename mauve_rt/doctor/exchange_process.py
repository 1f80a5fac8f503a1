"""Sends a message again and again, or receives one: `send|receive TOPIC SECONDS`.

The receiver prints the seconds from its start to the message; it ends with status 1 where none came. The
sender ends by SIGTERM.
"""

import signal
import sys
import time
from typing import Any

from mauve_rt.node.shared.log_folder import NO_LOG_FILES
from mauve_rt.node.shared.loopback import LoopbackError, keep_to_this_machine

_EVERY_S = 0.02


def main() -> int:
    """Do what the arguments say; returns the exit status."""
    role, topic, seconds = sys.argv[1:]
    begun_s = time.monotonic()
    try:
        keep_to_this_machine()
    except LoopbackError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    import rclpy  # noqa: PLC0415 - reads the environment
    from rclpy.node import Node  # noqa: PLC0415
    from rclpy.signals import SignalHandlerOptions  # noqa: PLC0415
    from std_msgs.msg import Empty  # noqa: PLC0415

    from mauve_rt.node.shared.announcement import first_participant  # noqa: PLC0415

    received: list[Any] = []
    ended: list[Any] = []
    signal.signal(signal.SIGTERM, lambda *_: ended.append(True))
    with first_participant():
        rclpy.init(args=list(NO_LOG_FILES), signal_handler_options=SignalHandlerOptions.NO)
        node = Node(topic[1:] + "_" + role, enable_rosout=False, start_parameter_services=False)
    if role == "send":
        publisher = node.create_publisher(Empty, topic, 1)
    else:
        node.create_subscription(Empty, topic, received.append, 1)
    while not received and not ended and time.monotonic() < begun_s + float(seconds):
        if role == "send":
            publisher.publish(Empty())
            time.sleep(_EVERY_S)
        else:
            rclpy.spin_once(node, timeout_sec=_EVERY_S)
    if received:
        sys.stdout.write(f"{time.monotonic() - begun_s:.3f}\n")
    node.destroy_node()
    node.context.try_shutdown()
    return 0 if received else 1


if __name__ == "__main__":
    sys.exit(main())
