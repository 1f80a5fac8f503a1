"""The records and messages of one recording, from sources that serve one recording after the other."""

import threading
from collections.abc import Sequence
from typing import NamedTuple

from mauve_rt.trace.bag.recorded import ReceivedBatch, ReceivedTopic, SentMessage
from mauve_rt.trace.recording.sources import Drain, Drained, MessageSource, TopicSource, TraceSource


class Taken(NamedTuple):
    """What one take() yields."""

    drain: Drain
    messages: Sequence[SentMessage]
    received: ReceivedBatch | None
    """Of topics of other nodes; None: there are none to record, or the last ones are taken."""
    topics: Sequence[ReceivedTopic] = ()
    """Those of `received`, in its order."""


class Tap:
    """Takes records and messages for one recording, from open() to close(). From any thread.

    close() takes the last records and messages and releases the sources at once. So a recorder that still
    waits for its disk takes nothing of a later recording, and does not end it.

    | member                                    | guarded by |
    | ----------------------------------------- | ---------- |
    | `_is_open`, `_last`, `_dropped`, sources  | `_lock`    |
    """

    def __init__(
        self, source: TraceSource, messages: MessageSource | None, topics: TopicSource | None
    ) -> None:
        """Take nothing before open()."""
        self._source = source
        self._messages = messages
        self._topics = topics
        self._dropped_before = messages.dropped_messages() if messages is not None else 0
        self._dropped = 0
        self._is_open = False
        self._last: Taken | None = None  # of close(), until it is taken
        self._lock = threading.Lock()

    def open(self, period_ns: int, *, discard: bool) -> Drain | None:
        """Begin; empty the rings every `period_ns`. Returns what they held, if that is to be discarded."""
        with self._lock:
            self._is_open = True
            self._source.collect_trace(period_ns)
            discarded = self._source.drain_trace() if discard else None
            if self._messages is not None:
                self._messages.keep_messages(on=True)
            return discarded

    def take(self) -> Taken:
        """Return what came since the last call; after close(), what came before it."""
        with self._lock:
            if self._is_open:
                return self._take()
            if self._last is None:
                msg = "the last records could not be taken"
                raise RuntimeError(msg)
            taken, drain = self._last, self._last.drain
            empty = Drained(b"", drain.written, drain.dropped, drain.monotonic_ns, drain.realtime_ns)
            self._last = Taken(empty, (), None)
            return taken

    def dropped_messages(self) -> int:
        """Messages that found no room in their source while the tap was open."""
        with self._lock:
            return self._count_dropped() if self._is_open else self._dropped

    def close(self) -> None:
        """Take what came last, and release the sources. May be called again."""
        with self._lock:
            if not self._is_open:
                return
            try:
                if self._topics is not None:
                    self._topics.stop()  # the last messages stay
                self._last = self._take()
                self._dropped = self._count_dropped()
            finally:
                self._is_open = False
                self._source.collect_trace(0)
                if self._messages is not None:
                    self._messages.keep_messages(on=False)

    def _take(self) -> Taken:
        # Messages before the drain: then no message is later than the clock pair that maps it.
        messages = self._messages.take_messages() if self._messages is not None else ()
        received = self._topics.take() if self._topics is not None else None
        # Since then there may be more of them.
        topics = self._topics.topics[: len(received.sizes)] if self._topics and received is not None else ()
        return Taken(self._source.drain_trace(), messages, received, topics)

    def _count_dropped(self) -> int:
        return self._messages.dropped_messages() - self._dropped_before if self._messages is not None else 0
