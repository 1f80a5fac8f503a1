"""Services of a node that a thread of their own answers."""

import threading
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

_FOREVER_NS = -1


class ServiceThread:
    """Answers the requests to the services of a mutually exclusive callback group, one after the other.

    rclpy's executors make a new wait set of all that a node has for every callback and twice more at its
    end, and the one with threads hands the callback to another thread and competes with it for the
    interpreter's lock: most of what a short call costs. This waits for a few services with one wait set.
    """

    def __init__(self, node: Node, group: CallbackGroup) -> None:
        """Of the services that the group has now; no executor may serve it (`OtherGroupsExecutor`)."""
        self._node = node
        self._services = [service for service in node.services if service.callback_group is group]
        self._wakeup = node.create_guard_condition(lambda: None, callback_group=group)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="services", daemon=True)

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def stop(self) -> None:
        """Answer no more; returns when the last reply is sent."""
        self._ending.set()
        self._wakeup.trigger()
        self._thread.join()

    def _run(self) -> None:
        context = self._node.context.handle
        wait_set = rclpy_implementation.WaitSet(0, 1, 0, 0, len(self._services), 0, context)
        while not self._ending.is_set():
            wait_set.clear_entities()
            wait_set.add_guard_condition(self._wakeup.handle)
            for service in self._services:
                wait_set.add_service(service.handle)
            wait_set.wait(_FOREVER_NS)
            ready = wait_set.get_ready_entities("service")
            for service in self._services:
                if service.handle.pointer in ready and not self._ending.is_set():
                    self._answer(service)

    def _answer(self, service: Any) -> None:
        kind = service.srv_type
        try:
            request, header = service.handle.service_take_request(kind.Request)
            if header is not None:
                service.send_response(service.callback(request, kind.Response()), header)
        except Exception as error:  # noqa: BLE001 - a malformed request must not end the process
            text = f"a request was dropped: {type(error).__name__}: {error}"
            self._node.get_logger().error(text)


class OtherGroupsExecutor(MultiThreadedExecutor):
    """Runs the callbacks of all groups of a node but one."""

    def __init__(self, group: CallbackGroup, *, num_threads: int) -> None:
        super().__init__(num_threads=num_threads)
        self._group = group

    def can_execute(self, entity: Any) -> bool:
        """Whether a callback can be executed, and here."""
        return entity.callback_group is not self._group and super().can_execute(entity)
