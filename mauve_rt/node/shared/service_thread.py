"""Services of a node that threads of their own answer."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import CallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from mauve_rt.control.requests import Code
from mauve_rt.errors import exception_text, internal_error_text
from mauve_rt.node.shared.watch import Watch

PATIENCE_S = 10.0  # of a change, for those before it
_MOST_THREADS = 64
_FOREVER_NS = -1


class ServiceThreads:
    """Answers the requests to the services of a callback group.

    One thread waits for requests; whoever takes one answers it itself, while another thread waits in its
    place. So a request waits for no other one, but for those before it where it is a change: these are
    answered one after the other, as they came. Behind a change that lasts, one is refused after `patience_s`:
    the change may wait for its answer, as a part does that asks its own executor while it is configured.

    rclpy's executors make a new wait set of all that a node has for every callback and twice more at its
    end, and the one with threads hands the callback to another thread and competes with it for the
    interpreter's lock: most of what a short call costs. This waits for a few services with one wait set.

    | member                                    | written by             | guarded by |
    | ----------------------------------------- | ---------------------- | ---------- |
    | `_wait_set`                               | who waits for requests | `_baton`   |
    | `_calls`, `_queue`, `_is_changing`, `_threads`, `_idle` | each thread | `_mutex` |
    """

    def __init__(
        self,
        node: Node,
        group: CallbackGroup,
        watch: Watch,
        *,
        is_change: Callable[[Any], bool],
        sign: Callable[[Any], None],
        patience_s: float = PATIENCE_S,
    ) -> None:
        """Of the services that the group has now; no executor may serve it (`OtherGroupsExecutor`).

        `is_change(request)` says which requests wait for each other; `sign(response)` puts into a refusal who
        refuses.
        """
        self._node = node
        self._watch = watch
        self._services = [service for service in node.services if service.callback_group is group]
        self._wakeup = node.create_guard_condition(lambda: None, callback_group=group)
        self._is_change = is_change
        self._sign = sign
        self._patience_s = patience_s
        self._ending = threading.Event()
        self._baton = threading.Lock()
        self._wait_set: Any = None
        self._mutex = threading.Lock()
        self._threads: list[threading.Thread] = []
        self._idle = 0  # threads that wait, for requests or for the baton
        self._calls: list[_Call] = []  # taken, not answered yet
        self._queue: deque[_Call] = deque()  # of these the changes that wait for their turn
        self._is_changing = False

    def start(self) -> None:
        """Begin to answer."""
        with self._mutex:
            self._start_thread()
            self._start_thread()

    def stop(self, *, wait_s: float, message: str) -> None:
        """Answer no more. Who is not answered within `wait_s` is refused, by `message`: NOT_ACTIVE.

        A handler that has not come back by then is left behind with its thread.
        """
        self._ending.set()
        until_s = time.monotonic() + wait_s
        with self._mutex:
            threads, self._queue = [*self._threads], deque()
        for thread in threads:
            self._wakeup.trigger()
            thread.join(max(0.0, until_s - time.monotonic()))
        with self._mutex:
            left = [*self._calls]
        for call in left:
            call.refuse(Code.NOT_ACTIVE, message, self._sign)

    def _start_thread(self) -> None:
        name = f"requests {len(self._threads) + 1}"
        thread = self._watch.thread(name, self._serve, ending=self._ending)
        self._threads.append(thread)
        self._idle += 1
        thread.start()

    def _serve(self) -> None:
        """Take a request and answer it; its handler is guarded (`ExecutorNode`)."""
        with self._baton:  # so that changes are lined up in the order in which they came
            call = None if self._ending.is_set() else self._take()
            if call is None or not self._is_due(call):
                return
        try:
            self._answer_changes() if call.is_change else self._answer(call)
        finally:
            with self._mutex:
                self._idle += 1

    def _is_due(self, call: "_Call") -> bool:
        """Whether this thread is to answer it: no change that another one comes to in its turn."""
        with self._mutex:
            self._calls.append(call)
            if call.is_change:
                self._queue.append(call)
                if self._is_changing:
                    self._wakeup.trigger()  # who waits for requests looks after its patience, too
                    return False
                self._is_changing = True
            self._idle -= 1
            if self._idle == 0 and len(self._threads) < _MOST_THREADS:
                self._start_thread()
        return True

    def _answer_changes(self) -> None:
        while True:
            with self._mutex:
                if not self._queue:
                    self._is_changing = False
                    return
                call = self._queue.popleft()
            self._answer(call)

    def _answer(self, call: "_Call") -> None:
        try:
            call.answer()
        finally:
            with self._mutex:
                self._calls.remove(call)

    def _take(self) -> "_Call | None":
        """Wait for a request."""
        if self._wait_set is None:
            context = self._node.context.handle
            self._wait_set = rclpy_implementation.WaitSet(0, 1, 0, 0, len(self._services), 0, context)
        wait_set = self._wait_set
        wait_set.clear_entities()
        wait_set.add_guard_condition(self._wakeup.handle)
        for service in self._services:
            wait_set.add_service(service.handle)
        wait_set.wait(self._refuse_overdue())
        ready = wait_set.get_ready_entities("service")
        for service in self._services:
            if service.handle.pointer in ready and (call := self._taken(service)) is not None:
                return call
        return None

    def _taken(self, service: Any) -> "_Call | None":
        try:
            request, header = service.handle.service_take_request(service.srv_type.Request)
        except Exception as error:  # noqa: BLE001 - rclpy has an exception class of its own for each mistake
            self._node.get_logger().error(f"a request was dropped: {exception_text(error)}")
            return None
        if header is None:
            return None
        return _Call(service, request, header, is_change=self._is_change(request))

    def _refuse_overdue(self) -> int:
        """Refuse the changes that have waited too long; returns how long the others may wait, ns."""
        now_s = time.monotonic()
        overdue: list[_Call] = []
        with self._mutex:
            while self._queue and self._queue[0].since_s + self._patience_s <= now_s:
                overdue.append(self._queue.popleft())
            for call in overdue:
                self._calls.remove(call)
            left_s = self._queue[0].since_s + self._patience_s - now_s if self._queue else -1.0
        for call in overdue:
            text = f"another change has been under way for more than {self._patience_s:g} s"
            call.refuse(Code.TIMEOUT, f"{text}; ask again when it is done (~/events)", self._sign)
            self._node.get_logger().warning(f"a request was refused: {text}")
        return math.ceil(left_s * 1e9) if left_s >= 0 else _FOREVER_NS


class _Call:
    """A request to a service, answered once."""

    def __init__(self, service: Any, request: Any, header: Any, *, is_change: bool) -> None:
        self.is_change = is_change
        self.since_s = time.monotonic()
        self._service = service
        self._request = request
        self._header = header
        self._lock = threading.Lock()
        self._is_answered = False

    def answer(self) -> None:
        """Let its handler answer it."""
        response = self._service.srv_type.Response()
        self._send(self._service.callback(self._request, response))

    def refuse(self, code: Code, message: str, sign: Callable[[Any], None]) -> None:
        """Answer it in its handler's place."""
        response = refusing(self._request, self._service.srv_type.Response(), code, message)
        sign(response)
        self._send(response)

    def _send(self, response: Any) -> None:
        with self._lock:
            was_answered, self._is_answered = self._is_answered, True
        if not was_answered:
            self._service.send_response(response, self._header)


def refused_reply(request: Any, filled: Any, error: BaseException) -> Any:
    """A response that says no, as far as it has words for that, to a request whose handler raised."""
    response = type(filled)()  # nothing of what the handler filled in already
    return refusing(request, response, Code.PREPARE_FAILED, internal_error_text(error))


def refusing(request: Any, response: Any, code: Code, text: str) -> Any:
    """A new response, made one that refuses a request, as far as it has words for that."""
    if hasattr(response, "message"):
        response.success, response.message = False, text
        if hasattr(response, "code"):
            response.code = int(code)
    refused = SetParametersResult(successful=False, reason=text)
    if hasattr(response, "results"):
        response.results = [refused for _ in request.parameters]
    elif isinstance(getattr(response, "result", None), SetParametersResult):
        response.result = refused
    return response


class OtherGroupsExecutor(MultiThreadedExecutor):
    """Runs the callbacks of all groups of a node but some."""

    def __init__(self, *groups: CallbackGroup, num_threads: int) -> None:
        super().__init__(num_threads=num_threads)
        self._groups = groups

    def can_execute(self, entity: Any) -> bool:
        """Whether a callback can be executed, and here."""
        return entity.callback_group not in self._groups and super().can_execute(entity)
