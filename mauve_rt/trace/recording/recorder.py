"""Records an executor's trace, and whatever messages it is given, into a bag while the executor runs."""

import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from mauve_rt.trace.bag.disk import KeptDisk
from mauve_rt.trace.bag.recorded import ReceivedBatch, SentMessage, Split, TopicQos
from mauve_rt.trace.recording.trace_bag import (
    BATCHES,
    DROPPED_MESSAGES,
    NAMES,
    Drain,
    Entry,
    MessageSource,
    TopicSource,
    TraceBag,
    TraceSource,
)

__all__ = [
    "BATCHES",
    "DROPPED_MESSAGES",
    "NAMES",
    "Drain",
    "MessageSource",
    "Recorder",
    "TopicSource",
    "TraceSource",
]


_JOIN_TIMEOUT_S = 2.0


class Recorder:
    """Writes a bag from a thread of its own.

    The rings are emptied often by a native thread of the source, so neither a disk that makes this one wait
    nor a busy interpreter costs records, as long as there is room to collect them. A failure to write (a full
    disk) ends the recording, is told once through `on_error`, and leaves the bag as the flush before left it.

    Log times are CLOCK_REALTIME: monotonic times are mapped by the clock pair of their drain.

    | member          | written by                     | guarded by |
    | --------------- | ------------------------------ | ---------- |
    | `_waiting` ...  | record(), the recorder thread  | `_lock`    |
    | `_received`, `_lost` | record(), lose(), the recorder thread | `_lock` |
    | `_recording`    | start(), the recorder thread   | `_lock`    |
    | `_error`        | the recorder thread            | `_lock`    |
    | `_architecture` | tell_architecture()            | `_lock`    |
    | `_bag`          | start(), the recorder thread   |            |
    """

    def __init__(
        self,
        source: TraceSource,
        directory: Path,
        *,
        node_name: str,
        flush_period_s: float = 0.1,
        drain_period_s: float = 0.02,
        queue_bytes: int = 64 * 1024 * 1024,
        split: Split | None = None,
        on_error: Callable[[str], None] | None = None,
        messages: MessageSource | None = None,
        topics: TopicSource | None = None,
        keeper: Path | None = None,
    ) -> None:
        """Create the bag; nothing is drained before start().

        Args:
            source: the architecture's host.
            directory: the bag's folder, which must not exist yet.
            node_name: absolute name of the executor's node, e.g. /robot_1/executor; the trace is below it.
            flush_period_s: so much, and what a flush takes, is lost by a kill at most.
            drain_period_s: the rings must not fill up within it.
            queue_bytes: messages that may wait for a flush; what exceeds it is dropped and counted.
            split: when the bag goes on in a new file; after a minute unless said otherwise.
            on_error: called at most once for each cause, with one line, on the recorder thread.
            messages: asked, on the recorder thread, for messages beside those given to record().
            topics: of other nodes; it is stopped when the recording ends by itself.
            keeper: the program that writes the files (`native_program`), so that a kill of this process finds
                no write half done; without one this process writes.

        Raises:
            TraceError: the folder exists or cannot be written, or mauve_msgs is not installed.

        """
        self._source = source
        self._flush_period_s = flush_period_s
        self._drain_period_s = min(drain_period_s, flush_period_s)
        self._queue_bytes = queue_bytes
        self._on_error = on_error
        self._messages = messages
        self._topics = topics
        self._others: dict[str, Entry] = {}
        self._refused: Counter[str] = Counter()  # of topics of other nodes
        self._dropped_before = messages.dropped_messages() if messages is not None else 0
        disk = None if keeper is None else KeptDisk(keeper, on_error=self._report)
        self._bag = TraceBag(
            source, directory, node_name=node_name, on_error=self._report, split=split, disk=disk
        )
        self._lock = threading.Lock()
        self._waiting: list[SentMessage] = []
        self._waiting_bytes = 0
        self._received: Counter[str] = Counter()  # by topic
        self._lost: Counter[str] = Counter()
        self._recording = False
        self._error = ""
        self._architecture = b""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)

    @property
    def directory(self) -> Path:
        """The bag's folder."""
        return self._bag.directory

    @property
    def recording(self) -> bool:
        """False before start(), after stop(), and after a failure."""
        with self._lock:
            return self._recording

    @property
    def error(self) -> str:
        """Why it ended by itself; empty when it did not."""
        with self._lock:
            return self._error

    @property
    def message_count(self) -> int:
        """Messages in the bag, the trace's own among them."""
        return self._bag.message_count

    @property
    def dropped_messages(self) -> int:
        """Messages that were to be recorded and did not get into the bag."""
        elsewhere = self._messages.dropped_messages() if self._messages is not None else 0
        others = sum(entry.lost for entry in self._others.values())
        with self._lock:
            return self._lost.total() + others + elsewhere - self._dropped_before

    @property
    def others(self) -> dict[str, Entry]:
        """What became of the messages of each topic of other nodes, as of the last flush."""
        return self._others

    def start(self, *, discard: bool = False) -> None:
        """Start the thread. Once only.

        Args:
            discard: leave out what the rings hold already, from before.

        """
        self._source.collect_trace(round(self._drain_period_s * 1e9))
        if discard:
            self._bag.discard(self._source.drain_trace())
        if self._messages is not None:
            self._messages.keep_messages(on=True)
        with self._lock:
            self._recording = True
        self._thread.start()

    def tell_architecture(self, data: bytes) -> None:
        """Record a serialized mauve_msgs/msg/TraceArchitecture with the next flush. From any thread."""
        with self._lock:
            self._architecture = data

    def record(
        self, topic: str, type_name: str, data: bytes, *, monotonic_ns: int, qos: TopicQos | None = None
    ) -> bool:
        """Record a message with the next flush. From any thread; never waits for the disk.

        Args:
            topic: absolute name.
            type_name: package/msg/Name.
            data: CDR with its header.
            monotonic_ns: when it was sent or received, ns of CLOCK_MONOTONIC.
            qos: as the topic is offered; used when the topic is first seen.

        Returns:
            False when it was dropped: not recording, or too much waits already.

        """
        with self._lock:
            self._received[topic] += 1
            if not self._recording or self._waiting_bytes + len(data) > self._queue_bytes:
                self._lost[topic] += 1
                return False
            self._waiting.append(SentMessage(topic, type_name, data, monotonic_ns, qos))
            self._waiting_bytes += len(data)
            return True

    def stop(self) -> None:
        """Drain and flush a last time, close the bag. Returns within 2 s; may be called again."""
        self._stop.set()
        if self._thread.ident is None:
            self._bag.abort()
        elif self._thread is not threading.current_thread():
            self._thread.join(_JOIN_TIMEOUT_S)

    def _run(self) -> None:
        try:
            next_s = time.monotonic()
            while not self._stop.wait(max(0.0, next_s - time.monotonic())):
                self._write()
                self._bag.flush()
                next_s = max(next_s + self._flush_period_s, time.monotonic())
            with self._lock:
                self._recording = False
            self._write()
            self._bag.close()
        except BaseException as error:  # noqa: BLE001 - whatever ends the recording, the executor lives on
            with self._lock:
                self._recording = False
                self._error = f"recording stopped: {error}"
            self._bag.abort()
            self._report(self._error)
        finally:
            self._source.collect_trace(0)
            if self._messages is not None:
                self._messages.keep_messages(on=False)
            if self._topics is not None:
                self._topics.stop()

    def _write(self) -> None:
        with self._lock:  # before the drain: then no message is later than the clock pair that maps it
            waiting, self._waiting, self._waiting_bytes = self._waiting, [], 0
            architecture = self._architecture
            received, lost = (
                self._received.copy(),
                self._lost.copy(),
            )  # with what waits: the bag tells of no more
        taken = self._messages.take_messages() if self._messages is not None else ()
        more = Counter(message.topic for message in taken)
        waiting += taken
        batch = self._topics.take() if self._topics is not None else None
        drain = self._source.drain_trace()
        if architecture:
            self._bag.tell_architecture(architecture, drain)
        refused = self._bag.write(drain, waiting, whole=True)
        if self._topics is not None and batch is not None:
            self._refused += self._bag.write_received(batch, self._topics.topics, drain)
            self._others = self._entries(self._topics, batch)
        with self._lock:
            self._received += more
            self._lost += refused
        self._bag.tell_ledger(received + more, lost + refused, self._others)
        self._bag.tell_dropped(self.dropped_messages)

    def _entries(self, source: TopicSource, batch: ReceivedBatch) -> dict[str, Entry]:
        return {
            topic.name: Entry(
                received=received,
                lost=lost + self._refused[topic.name],
                lost_before=lost_before,
                numbered=source.numbered,
            )
            for topic, (received, lost_before, lost) in zip(source.topics, batch.counts, strict=True)
        }

    def _report(self, text: str) -> None:
        if self._on_error is not None:
            self._on_error(text)
