"""What came of each request, told in the order in which they were decided. Knows no ROS."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from mauve_rt.control.requests import Outcome, Request
from mauve_rt.node.shared.watch import Watch

MOST_WAITING = 1000  # events; more come only where each waits for a release that is slow to come
_LOOK_NS = 50_000_000  # how long a hurried end may have to wait for a look at a report


@dataclass(eq=False)
class Event:
    """A request, what came of it, and when that was."""

    request: Request
    outcome: Outcome
    stamp: Any
    answered: bool = False  # who asked comes first


class Events:
    """Tells of one request after the other, each when its report is complete.

    The release after a change comes up to a period later, which nobody waits for but the thread here. So
    what comes after a change to a slow component is told late rather than out of order.

    | member             | written by                     | guarded by          |
    | ------------------ | ------------------------------ | ------------------- |
    | `_waiting`         | add(), the thread              | `_changed`          |
    | `answered` of each | tell()                         | `_changed`          |
    | `_hurried`         | flush(): how many ask          | `_changed`          |
    | `_left_out`        | add(), the thread              | `_changed`          |
    | `_ending`          | close()                        | `_changed`          |
    | `_thread`          | add()                          | `_changed`          |
    | `_ended`           | the thread                     | itself              |
    """

    def __init__(self, publish: Callable[[Event], None], watch: Watch) -> None:
        """`publish` is called by the thread here, which begins with the first event."""
        self._publish = publish
        self._watch = watch
        self._changed = threading.Condition()
        self._waiting: deque[Event] = deque()
        self._hurried = 0
        self._left_out = 0
        self._ending = False
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def add(self, event: Event) -> None:
        """Take it down, after those before it; it is told after tell(). From any thread.

        With too many before it, it is left out, which is logged.
        """
        with self._changed:
            if len(self._waiting) >= MOST_WAITING:
                self._left_out += 1
                return
            self._waiting.append(event)
            if self._thread is None:
                self._thread = self._watch.thread("events", self._tell_next, ending=self._ended)
                self._thread.start()

    def tell(self, event: Event) -> None:
        """Who asked has the answer."""
        with self._changed:
            event.answered = True
            self._changed.notify_all()

    def flush(self) -> None:
        """Tell of all there are now, with what is known of them; returns when they are told."""
        with self._changed:
            last = self._waiting[-1] if self._waiting else None
            self._hurried += 1
            self._changed.notify_all()
            self._changed.wait_for(lambda: last not in self._waiting)
            self._hurried -= 1

    def close(self) -> None:
        """As flush(), for good."""
        self.flush()
        with self._changed:
            self._ending = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()

    def _tell_next(self) -> None:
        event = self._next()
        if event is None:
            self._ended.set()
            return
        try:
            event.outcome = self._completed(event.outcome)
            self._publish(event)
        finally:  # the next ones are to be told in any case
            with self._changed:
                self._waiting.popleft()
                left_out, self._left_out = self._left_out, 0
                self._changed.notify_all()
        if left_out:
            self._watch.report(f"{left_out} events were left out: they came faster than they can be reported")

    def _next(self) -> Event | None:
        def is_due() -> bool:
            return self._waiting[0].answered or self._hurried > 0 if self._waiting else self._ending

        with self._changed:
            self._changed.wait_for(is_due)
            return self._waiting[0] if self._waiting else None

    def _completed(self, outcome: Outcome) -> Outcome:
        while outcome.pending is not None and not self._hurried:
            outcome = outcome.pending.look(outcome, wait_ns=_LOOK_NS)
        if outcome.pending is not None:
            outcome = outcome.pending.look(outcome, wait_ns=0)
        return replace(outcome, pending=None)  # which would keep the deployer
