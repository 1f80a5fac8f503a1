"""A short-lived ROS node that asks an executor."""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from mauve_rt.errors import ParameterError

DISCOVERY_TIMEOUT_S = 10.0  # seen here: 0.1 to 2.8 s
REPLY_TIMEOUT_S = 15.0  # longer than any time-out that a request can ask for
LISTING_S = 3.5
_LIST_SERVICE = "mauve_msgs/srv/ListComponents"
_POLL_S = 0.05  # waiting in rclpy does not end at a Ctrl-C: short waits do


class NoExecutorError(ParameterError):
    """Nobody answers under the given name."""


class Client:
    """Asks executors. For one thread."""

    def __init__(self, node: Node, executor: SingleThreadedExecutor) -> None:
        self._node = node
        self._executor = executor

    def call(
        self, service_type: Any, service: str, request: Any, *, wait_s: float = DISCOVERY_TIMEOUT_S
    ) -> Any:
        """The reply of a service, e.g. `/robot_1/executor/stop`.

        Raises:
            NoExecutorError: no such service within `wait_s`, or no reply within 15 s.
        """
        asked = service.rpartition("/")[0]
        client = self._node.create_client(service_type, service)
        deadline = time.monotonic() + wait_s
        while not client.service_is_ready():
            if time.monotonic() >= deadline:
                seen = ", ".join(name for name in self.seen_executors() if name != asked) or "none"
                raise NoExecutorError(f"no service {service} within {wait_s:g} s; executors seen: {seen}")
            self._executor.spin_once(timeout_sec=_POLL_S)
        future = client.call_async(request)
        deadline = time.monotonic() + REPLY_TIMEOUT_S
        while not future.done() and time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=_POLL_S)
        if not future.done():
            raise NoExecutorError(
                f"no reply from {service} within {REPLY_TIMEOUT_S:g} s; is its process frozen?"
            )
        return future.result()

    def seen_executors(self) -> list[str]:
        """Executors discovered so far."""
        suffix = "/list_components"
        found = self._node.get_service_names_and_types()
        return sorted(name.removesuffix(suffix) for name, types in found if _LIST_SERVICE in types)

    def find_executors(self, *, wait_s: float = LISTING_S) -> list[str]:
        """Executors, after discovery had the time it takes."""
        deadline = time.monotonic() + wait_s
        while time.monotonic() < deadline:
            self._executor.spin_once(timeout_sec=_POLL_S)
        return self.seen_executors()

    def listen(self, message_type: Any, topic: str, heard: Callable[[Any], None]) -> None:
        """Call `heard` with every message, until interrupted."""
        self._node.create_subscription(message_type, topic, heard, QoSProfile(depth=100))
        while True:
            self._executor.spin_once(timeout_sec=_POLL_S)


@contextmanager
def connected() -> Iterator[Client]:
    """A client on a ROS context of its own; this machine only, unless the environment says otherwise."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    context = Context()
    rclpy.init(context=context, args=[])
    try:
        node = Node(
            f"mauve_{os.getpid()}", context=context, enable_rosout=False, start_parameter_services=False
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        try:
            yield Client(node, executor)
        finally:
            executor.shutdown(timeout_sec=0)
            node.destroy_node()
    finally:
        context.try_shutdown()
