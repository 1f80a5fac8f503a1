"""A short-lived ROS node that asks an executor."""

import os
import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from mauve_rt.errors import ParameterError
from mauve_rt.node.discovery import limit_discovery

DISCOVERY_TIMEOUT_S = 10.0  # seen here: 0.1 to 2.8 s
REPLY_TIMEOUT_S = 15.0  # longer than any time-out that a request can ask for
RESEND_S = 4.0
LISTING_S = 3.5
_LIST_SERVICE = "mauve_msgs/srv/ListComponents"
_POLL_S = 0.05  # waiting in rclpy does not end at a Ctrl-C: short waits do
_interrupted = threading.Event()


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

        A reply can be lost while the service does not know its new client yet: the request is sent again. An
        executor knows it by its id, and gives the first outcome.

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
            self._spin_once()
        if getattr(request, "request_id", None) == "":
            request.request_id = str(uuid.uuid4())
        futures: list[Any] = []
        deadline = time.monotonic() + REPLY_TIMEOUT_S
        while (now := time.monotonic()) < deadline:
            if now >= deadline - REPLY_TIMEOUT_S + len(futures) * RESEND_S:
                futures.append(client.call_async(request))
            self._spin_once()
            for future in futures:
                if future.done():
                    return future.result()
        raise NoExecutorError(f"no reply from {service} within {REPLY_TIMEOUT_S:g} s; is its process frozen?")

    def seen_executors(self) -> list[str]:
        """Executors discovered so far."""
        suffix = "/list_components"
        found = self._node.get_service_names_and_types()
        return sorted(name.removesuffix(suffix) for name, types in found if _LIST_SERVICE in types)

    def find_executors(self, *, wait_s: float = LISTING_S) -> list[str]:
        """Executors, after discovery had the time it takes."""
        deadline = time.monotonic() + wait_s
        while time.monotonic() < deadline:
            self._spin_once()
        return self.seen_executors()

    def listen(self, message_type: Any, topic: str, heard: Callable[[Any], None]) -> None:
        """Call `heard` with every message, until KeyboardInterrupt."""
        self._node.create_subscription(message_type, topic, heard, QoSProfile(depth=100))
        while True:
            self._spin_once()

    def _spin_once(self) -> None:
        self._executor.spin_once(timeout_sec=_POLL_S)
        if _interrupted.is_set():
            raise KeyboardInterrupt


@contextmanager
def _interrupts_between_spins() -> Iterator[None]:
    """Keep Ctrl-C until rclpy has returned: inside of it an exception can be lost, as in a destructor."""
    _interrupted.clear()
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def note(_signal: int, _frame: FrameType | None) -> None:
        _interrupted.set()

    before = signal.signal(signal.SIGINT, note)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def connected() -> Iterator[Client]:
    """A client on a ROS context of its own; this machine only, unless the environment says otherwise."""
    limit_discovery()
    context = Context()
    with _interrupts_between_spins():
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
