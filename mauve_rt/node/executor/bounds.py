"""Watches the bounds of an executor in a thread of its own: ~/violations, the log, figures of each job."""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from mauve_msgs.msg import BoundViolation
from mauve_rt.control.judging import Judge
from mauve_rt.control.runtime import Runtime
from mauve_rt.node.shared.watch import Watch

if TYPE_CHECKING:
    from mauve_rt.control.bound_watch import BoundWatch, Violation, WatchedBound

_PERIOD_S = 1.0
_END_S = 2.0
_DEPTH = 100
TYPE = "mauve_msgs/msg/BoundViolation"


class WatchedBounds:
    """Watches where the file declares what a proof needs of the computer. Computes nothing before the start.

    | member     | written by        | guarded by      |
    | ---------- | ----------------- | --------------- |
    | `_watched` | the thread        | exchanged whole |
    | `_thread`  | start(), stop()   |                 |
    """

    def __init__(
        self,
        node: LifecycleNode,
        runtime: Runtime,
        judge: Judge,
        *,
        publish: Callable[[Any, str, Any, QoSProfile], None],
        watch: Watch,
    ) -> None:
        """`judge` has the timing of what runs; `publish` sends and records a message."""
        self._node = node
        self._runtime = runtime
        self._judge = judge
        self._publish = publish
        self._watch = watch
        self._qos = QoSProfile(depth=_DEPTH)
        self._violations = node.create_publisher(BoundViolation, "~/violations", self._qos)
        self._watched: BoundWatch | None = None
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Watch; the host is deployed."""
        executor = self._runtime.model.executor
        if executor.wakeup_us is None or executor.overhead_ns is None:
            return  # nothing is provable
        self._ending.clear()
        self._thread = self._watch.thread("bounds", self._look, ending=self._ending)
        self._thread.start()

    def stop(self) -> None:
        """End the watch; no violation is left behind. May be called again."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join(_END_S)  # it may be computing bounds, for no use now
            self._thread = None
        watched, self._watched = self._watched, None
        if watched is not None:
            self._report(watched.end())

    def of_components(self) -> "dict[str, list[WatchedBound]]":
        """Bounds and measured times by component; none where nothing is proved, or while a change is made."""
        watched = self._watched
        return {} if watched is None else watched.bounds()

    def _look(self) -> None:
        if self._ending.wait(_PERIOD_S):
            return
        if self._watched is None:
            from mauve_rt.control.bound_watch import BoundWatch  # noqa: PLC0415 - it loads the analysis

            self._watched = BoundWatch(self._runtime, self._judge.timing)
        self._report(self._watched.look())

    def _report(self, violations: "list[Violation]") -> None:
        for one in violations:
            self._node.get_logger().warning(one.message)
            self._publish(self._violations, TYPE, self._message(one), self._qos)

    def _message(self, one: "Violation") -> Any:
        return BoundViolation(
            stamp=self._node.get_clock().now().to_msg(),
            instance_id=self._runtime.instance_id,
            revision=self._runtime.revision,
            component=one.component,
            after=one.after,
            until=one.until,
            instant_ns=one.instant_ns,
            response_ns=one.response_ns,
            bound_ns=one.bound_ns,
            term=int(one.excess.term),
            element=one.excess.element,
            took_ns=one.excess.took_ns,
            declared_ns=one.excess.declared_ns,
            count=one.jobs,
            message=one.message,
        )
