"""Services of a node that a thread of their own answers."""

import threading
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import CallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from mauve_rt.errors import exception_text
from mauve_rt.node.executor_requests import Code
from mauve_rt.node.watch import Watch

_FOREVER_NS = -1


class ServiceThread:
    """Answers the requests to the services of a mutually exclusive callback group, one after the other.

    rclpy's executors make a new wait set of all that a node has for every callback and twice more at its
    end, and the one with threads hands the callback to another thread and competes with it for the
    interpreter's lock: most of what a short call costs. This waits for a few services with one wait set.
    """

    def __init__(self, node: Node, group: CallbackGroup, watch: Watch, *, name: str) -> None:
        """Of the services that the group has now; no executor may serve it (`OtherGroupsExecutor`)."""
        self._node = node
        self._services = [service for service in node.services if service.callback_group is group]
        self._wakeup = node.create_guard_condition(lambda: None, callback_group=group)
        self._ending = threading.Event()
        self._wait_set: Any = None  # of the thread
        self._thread = watch.thread(name, self._take_requests, ending=self._ending)

    def start(self) -> None:
        """Begin to answer."""
        self._thread.start()

    def stop(self) -> None:
        """Answer no more; returns when the last reply is sent."""
        self._ending.set()
        self._wakeup.trigger()
        self._thread.join()

    def _take_requests(self) -> None:
        """Wait until there are some, and answer them; their handlers are guarded (`ExecutorNode`)."""
        if self._wait_set is None:
            context = self._node.context.handle
            self._wait_set = rclpy_implementation.WaitSet(0, 1, 0, 0, len(self._services), 0, context)
        wait_set = self._wait_set
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
        """Answer one request."""
        try:
            request, header = service.handle.service_take_request(service.srv_type.Request)
        except Exception as error:  # noqa: BLE001 - rclpy has an exception class of its own for each mistake
            self._node.get_logger().error(f"a request was dropped: {exception_text(error)}")
            return
        if header is None:
            return
        service.send_response(service.callback(request, service.srv_type.Response()), header)


def refused_reply(request: Any, filled: Any, error: BaseException) -> Any:
    """A response that says no, as far as it has words for that, to a request whose handler raised."""
    response = type(filled)()  # nothing of what the handler filled in already
    text = f"internal error: {exception_text(error)}"
    if hasattr(response, "message"):
        response.success, response.message = False, text
        if hasattr(response, "code"):
            response.code = int(Code.PREPARE_FAILED)
    no = SetParametersResult(successful=False, reason=text)
    if hasattr(response, "results"):
        response.results = [no for _ in request.parameters]
    elif isinstance(getattr(response, "result", None), SetParametersResult):
        response.result = no
    return response


class OtherGroupsExecutor(MultiThreadedExecutor):
    """Runs the callbacks of all groups of a node but some."""

    def __init__(self, *groups: CallbackGroup, num_threads: int) -> None:
        super().__init__(num_threads=num_threads)
        self._groups = groups

    def can_execute(self, entity: Any) -> bool:
        """Whether a callback can be executed, and here."""
        return entity.callback_group not in self._groups and super().can_execute(entity)
