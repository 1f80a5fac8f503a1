"""Requests to stop, deactivate and shut down come through while Python hangs: what is in Python of that."""

from collections.abc import Callable
from typing import Any

from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import LifecycleNode
from rclpy.serialization import deserialize_message, serialize_message

from mauve_msgs.srv import Stop
from mauve_rt import _bridge
from mauve_rt.control.requests import Code
from mauve_rt.control.runtime import Runtime
from mauve_rt.node.shared.watch import Watch


class StopGuard:
    """Stops in C++ what Python does not get to stop; here its work is taken over again.

    Opened once the node has its services. Takes its place with take_answered(), before a stop is carried out
    in Python, and in the node's default callback group, where transitions are made one after the other.
    """

    def __init__(
        self,
        node: LifecycleNode,
        runtime: Runtime,
        watch: Watch,
        *,
        stop: Any,
        change_state: Any,
        tell: Callable[[], None],
    ) -> None:
        """Guard these two services. `tell` is called when there is something for take_answered()."""
        self._change_state = change_state
        self._tell = tell
        self._news = node.create_guard_condition(watch.guarded("what Python has missed", self._take_over))
        self._guard = _bridge.StopGuard(
            node.handle.pointer,
            stop=stop.handle.pointer,
            change_state=change_state.handle.pointer,
            news=self._news.handle.pointer,
            logger=node.get_logger().name,
            instance_id=runtime.instance_id,
            codes={name: int(code) for name, code in Code.__members__.items()},
        )

    def follow(self, runtime: Runtime) -> None:
        """Guard the components of the runtime's present architecture, or of none."""
        self._guard.set_architecture(runtime.architecture.pointer if runtime.configured else 0)

    def release(self) -> None:
        """Let go of the architecture, which is about to be released."""
        self._guard.set_architecture(0)

    def take_answered(self) -> list[tuple[Any, Any]]:
        """(request, response) of each stop since the last call that Python did not take up."""
        return [
            (deserialize_message(request, Stop.Request), deserialize_message(response, Stop.Response))
            for request, response in self._guard.take_answered()
        ]

    def stop(self) -> None:
        """End the guard."""
        self._guard.stop()

    def _take_over(self) -> None:
        self._tell()
        for number, data in self._guard.take_transitions():
            request = deserialize_message(data, ChangeState.Request)
            response = self._change_state.callback(request, ChangeState.Response())
            self._guard.answer(number, serialize_message(response))
