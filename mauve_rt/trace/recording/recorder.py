"""Records an executor's trace, and whatever messages it is given, into a bag while the executor runs."""

import contextlib
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from mauve_rt.trace.bag.disk import KeptDisk
from mauve_rt.trace.bag.recorded import ReceivedBatch, ReceivedTopic, SentMessage, Split, TopicQos, Window
from mauve_rt.trace.errors import DiskError, TraceError
from mauve_rt.trace.recording.ledger import DROPPED_MESSAGES, Entry
from mauve_rt.trace.recording.recent import RecentBag
from mauve_rt.trace.recording.sources import Drain, MessageSource, TopicSource, TraceSource
from mauve_rt.trace.recording.tap import Tap
from mauve_rt.trace.recording.trace_bag import BATCHES, NAMES, TraceBag

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
_TRY_PERIOD_S = 1.0  # of a paused recording, to go on


class Recorder:
    """Writes a bag from a thread of its own.

    The rings are emptied often by a native thread of the source, so neither a disk that makes this one wait
    nor a busy interpreter costs records, as long as there is room to collect them.

    A disk that refuses to write (it is full, limits a file, fails) ends the recording, or pauses it
    until there is room again. The reason, the ledger and the number of lost records go into the room that the
    bag keeps.

    stop() takes the last records and releases the sources itself, before it waits for the disk: a later
    recording of the same sources is whole, however long the disk of this one hangs.

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
        waits_for_room: bool = False,
        compression: str = "none",
        window: Window | None = None,
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
            compression: of the chunks of the files, one of COMPRESSIONS; done by the recorder thread.
            waits_for_room: a disk that refuses to write pauses the recording; else it ends the recording.
            window: there is no bag: so much stays in memory, and snapshot() writes bags below `directory`.

        Raises:
            TraceError: the folder exists or cannot be written, or mauve_msgs is not installed.

        """
        self._flush_period_s = flush_period_s
        self._drain_period_s = min(drain_period_s, flush_period_s)
        self._queue_bytes = queue_bytes
        self._on_error = on_error
        self._waits_for_room = waits_for_room
        self._try_at_s = 0.0  # when paused
        self._tap = Tap(source, messages, topics)
        self._topics = topics
        self._others: dict[str, Entry] = {}
        self._refused: Counter[str] = Counter()  # of topics of other nodes
        self._bag: TraceBag | RecentBag
        if window is not None:
            self._bag = RecentBag(
                source,
                directory,
                window=window,
                node_name=node_name,
                on_error=self._report,
                split=split,
                keeper=keeper,
                compression=compression,
            )
        else:
            self._bag = TraceBag(
                source,
                directory,
                node_name=node_name,
                on_error=self._report,
                split=split,
                disk=None if keeper is None else KeptDisk(keeper, on_error=self._report),
                compression=compression,
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
    def recent(self) -> RecentBag | None:
        """What is in memory; None: it records into a bag."""
        return self._bag if isinstance(self._bag, RecentBag) else None

    @property
    def recording(self) -> bool:
        """False before start(), after stop(), and after a failure."""
        with self._lock:
            return self._recording and not self._stop.is_set()

    @property
    def is_closed(self) -> bool:
        """Whether it has ended, and waits for the disk no longer."""
        return self._stop.is_set() and not self._thread.is_alive()

    @property
    def error(self) -> str:
        """Why it ended by itself, or is paused; empty when it did not."""
        with self._lock:
            return self._error

    @property
    def message_count(self) -> int:
        """Messages in the bag, the trace's own among them."""
        return self._bag.message_count

    @property
    def dropped_messages(self) -> int:
        """Messages that were to be recorded and did not get into the bag."""
        elsewhere = self._tap.dropped_messages()
        others = sum(entry.lost for entry in self._others.values())
        with self._lock:
            return self._lost.total() + others + elsewhere

    @property
    def others(self) -> dict[str, Entry]:
        """What became of the messages of each topic of other nodes, as of the last flush."""
        return self._others

    def start(self, *, discard: bool = False) -> None:
        """Start the thread. Once only.

        Args:
            discard: leave out what the rings hold already, from before.

        """
        discarded = self._tap.open(round(self._drain_period_s * 1e9), discard=discard)
        if discarded is not None:
            self._bag.discard(discarded)
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
            if self._stop.is_set():
                return False
            self._received[topic] += 1
            if not self._recording or self._waiting_bytes + len(data) > self._queue_bytes:
                self._lost[topic] += 1
                return False
            self._waiting.append(SentMessage(topic, type_name, data, monotonic_ns, qos))
            self._waiting_bytes += len(data)
            return True

    def stop(self) -> bool:
        """Take the last records, flush, close the bag. May be called again.

        Returns:
            False when the disk did not answer within 2 s: the bag is not complete. The recorder thread
            waits on, and completes the bag.

        """
        with self._lock:
            self._stop.set()
        with contextlib.suppress(Exception):  # the recorder thread meets and reports it
            self._tap.close()
        if self._thread.ident is None:
            self._bag.abort()
            return True
        if self._thread is not threading.current_thread():
            self._thread.join(_JOIN_TIMEOUT_S)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            next_s = time.monotonic()
            while not self._stop.wait(max(0.0, next_s - time.monotonic())):
                if self._bag.is_interrupted:
                    self._try_to_go_on()
                else:
                    self._write()
                    self._flush(self._bag.flush)
                next_s = max(next_s + self._flush_period_s, time.monotonic())
            self._tap.close()
            if self._bag.is_interrupted:
                self._try_at_s = 0.0
                self._try_to_go_on()
            else:
                self._write()
            if not self._bag.is_interrupted:
                self._flush(self._bag.finish)
            self._bag.abort()
            with self._lock:
                self._recording = False
        except BaseException as error:  # noqa: BLE001 - whatever ends the recording, the executor lives on
            with self._lock:
                self._recording = False
                self._error = f"recording stopped: {error}"
            self._bag.abort()
            self._report(self._error)
        finally:
            with contextlib.suppress(Exception):  # the recording has ended, and why is reported
                self._tap.close()

    def _flush(self, flush: Callable[[], None]) -> None:
        try:
            flush()
        except DiskError as error:
            if self._waits_for_room:
                self._interrupt(error)
                self._pause(str(error))
                return
            with self._lock:
                self._recording = False
            self._tap.close()
            self._interrupt(error)
            raise

    def _pause(self, reason: str) -> None:
        self._try_at_s = time.monotonic() + _TRY_PERIOD_S
        error = f"recording paused until the disk has room again: {reason}"
        with self._lock:
            self._error = error
        self._report(error)

    @property
    def _on_disk(self) -> TraceBag:
        """The bag, of which a disk has refused something."""
        assert isinstance(self._bag, TraceBag)  # noqa: S101 - for mypy: no disk is asked by another
        return self._bag

    def _interrupt(self, error: DiskError) -> None:
        """Count what is lost with the flush that failed, and what came since."""
        lost = self._on_disk.interrupt(str(error))
        for topic in lost.keys() & self._others.keys():
            self._refused[topic] += lost.pop(topic)
        with self._lock:
            self._lost += lost
        self._skip()
        self._write_last_words()

    def _skip(self) -> None:
        """Count what came: it is lost."""
        with self._lock:
            waiting, self._waiting, self._waiting_bytes = self._waiting, [], 0
        drain, taken, batch, topics = self._tap.take()
        more = Counter(message.topic for message in taken)
        if self._topics is not None and batch is not None:
            for topic, count in zip(topics, batch.sizes, strict=True):
                self._refused[topic.name] += count
            self._others = self._entries(topics, batch, numbered=self._topics.numbered)
        with self._lock:
            self._received += more
            self._lost += more + Counter(message.topic for message in waiting)
            received, lost = self._received.copy(), self._lost.copy()
        self._on_disk.skip(drain)
        self._on_disk.tell_ledger(received, lost, self._others)
        self._on_disk.tell_dropped(self.dropped_messages)

    def _write_last_words(self) -> None:
        try:
            self._on_disk.write_last_words()
        except TraceError as error:
            self._report(f"the bag does not tell what it lost: {error}")

    def _try_to_go_on(self) -> None:
        """Once a second, since a new file is made for it."""
        self._skip()
        if time.monotonic() < self._try_at_s:
            return
        self._try_at_s = time.monotonic() + _TRY_PERIOD_S
        try:
            missed = self._on_disk.go_on()
        except DiskError:
            self._write_last_words()
            return
        with self._lock:
            self._error = ""
        paused_s = (missed.until_ns - missed.from_ns) / 1e9
        self._report(f"recording goes on after {paused_s:.1f} s: {missed.records:,} records are lost")

    def _write(self) -> None:
        with self._lock:  # before the tap: then no message is later than the clock pair that maps it
            waiting, self._waiting, self._waiting_bytes = self._waiting, [], 0
            architecture = self._architecture
            received, lost = (
                self._received.copy(),
                self._lost.copy(),
            )  # with what waits: the bag tells of no more
        drain, taken, batch, topics = self._tap.take()
        more = Counter(message.topic for message in taken)
        waiting += taken
        if architecture:
            self._bag.tell_architecture(architecture, drain)
        refused = self._bag.write(drain, waiting, whole=True)
        if self._topics is not None and batch is not None:
            self._refused += self._bag.write_received(batch, topics, drain)
            self._others = self._entries(topics, batch, numbered=self._topics.numbered)
        with self._lock:
            self._received += more
            self._lost += refused
        self._bag.tell_ledger(received + more, lost + refused, self._others)
        self._bag.tell_dropped(self.dropped_messages)

    def _entries(
        self, topics: Sequence[ReceivedTopic], batch: ReceivedBatch, *, numbered: bool
    ) -> dict[str, Entry]:
        return {
            topic.name: Entry(
                received=received,
                lost=lost + self._refused[topic.name],
                lost_before=lost_before,
                numbered=numbered,
            )
            for topic, (received, lost_before, lost) in zip(topics, batch.counts, strict=True)
        }

    def _report(self, text: str) -> None:
        if self._on_error is not None:
            self._on_error(text)
