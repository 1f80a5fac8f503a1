"""What lost supervisors have in force: it ends where their rules say `on_supervisor_loss: release`."""

import threading
import time
from collections.abc import Callable, Sequence

from rclpy.node import Node

from mauve_rt._kernel import Overlay
from mauve_rt.control.requests import Outcome, Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.node.shared.watch import Watch

LOST_AFTER_S = 3.0
"""So long a supervisor may be missing from the graph: it may have been started again."""


class LostSupervisors:
    """Looks at the graph now and then, on one thread; a release has a thread of its own, as it may last."""

    def __init__(
        self, node: Node, runtime: Runtime, handle: Callable[[Request], Outcome], watch: Watch
    ) -> None:
        """`handle` carries out a request."""
        self._node = node
        self._runtime = runtime
        self._handle = handle
        self._watch = watch
        self._seen_s: dict[str, float] = {}  # when a supervisor was there last
        self._releasing: threading.Thread | None = None

    def look(self) -> None:
        """Release the rules of those that are gone."""
        overlays = self._runtime.overlays()
        bound = [each for each in overlays.active() if each.ends_with_source] if overlays is not None else []
        if not bound:
            self._seen_s.clear()
            return
        now_s = time.monotonic()
        there = {
            f"{namespace.rstrip('/')}/{name}"
            for name, namespace in self._node.get_node_names_and_namespaces()
        }
        for source in {each.source for each in bound}:
            if source in there or source not in self._seen_s:
                self._seen_s[source] = now_s
        lost = [each for each in bound if now_s - self._seen_s[each.source] >= LOST_AFTER_S]
        if lost and (self._releasing is None or not self._releasing.is_alive()):
            release = self._watch.guarded("releasing the rules of a lost supervisor", self._release)
            self._releasing = threading.Thread(target=release, args=(lost,), daemon=True)
            self._releasing.start()

    def _release(self, lost: Sequence[Overlay]) -> None:
        for overlay in lost:
            cause = f"{overlay.source} is gone, and its rules say on_supervisor_loss: release"
            self._node.get_logger().warning(f"rule {overlay.rule} is released: {cause}")
            self._handle(Request(rule=overlay.rule, release=True, requested_by=overlay.source, cause=cause))
