"""Records an executor's trace, and whatever messages it is given, into a bag while the executor runs."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

from mauve_rt.trace.bag import BagWriter, TopicQos
from mauve_rt.trace.cdr import Batch, encode_batch, encode_names
from mauve_rt.trace.errors import TraceError

BATCHES = "trace/batches"
NAMES = "trace/names"
DROPPED_MESSAGES = "mauve_dropped_messages"
"""Key in the custom data of metadata.yaml: messages given to record() that did not get into the bag."""
_BATCH_TYPE = "mauve_msgs/msg/TraceBatch"
_NAMES_TYPE = "mauve_msgs/msg/TraceNames"
_NAMES_QOS = TopicQos(depth=1, transient_local=True)
_JOIN_TIMEOUT_S = 2.0


class Drain(Protocol):
    """What one drain of the kernel's rings yields (`mauve_rt._kernel.TraceDrain`)."""

    @property
    def records(self) -> bytes:
        """Records, 48 bytes each."""

    @property
    def written(self) -> list[int]:
        """Per component: records ever offered."""

    @property
    def dropped(self) -> list[int]:
        """Per component: of these, lost because the ring was full."""

    @property
    def monotonic_ns(self) -> int:
        """Time of the drain, CLOCK_MONOTONIC."""

    @property
    def realtime_ns(self) -> int:
        """The same instant, CLOCK_REALTIME."""


class TraceSource(Protocol):
    """The part of `mauve_rt._kernel.Deployer` that the recorder uses."""

    def drain_trace(self) -> Drain:
        """Take everything out of the rings."""

    def trace_components(self) -> list[str]:
        """Words that `component` of a record refers to."""

    def trace_names(self) -> list[str]:
        """Words that `name` of a record refers to."""


class _Waiting(NamedTuple):
    topic: str
    type_name: str
    data: bytes
    monotonic_ns: int
    qos: TopicQos | None


class Recorder:
    """Writes a bag from a thread of its own, which drains the rings often and flushes the bag less often.

    Log times are CLOCK_REALTIME: monotonic times are mapped by the clock pair of their drain. A
    failure to write (a full disk) ends the recording, is told once through `on_error`, and leaves the bag
    as the flush before left it.

    | member        | written by                     | guarded by |
    | ------------- | ------------------------------ | ---------- |
    | `_waiting`    | record(), the recorder thread  | `_lock`    |
    | `_dropped`    | record(), the recorder thread  | `_lock`    |
    | `_recording`  | start(), the recorder thread   | `_lock`    |
    | `_bag`        | the recorder thread            |            |
    """

    def __init__(
        self,
        source: TraceSource,
        directory: Path,
        *,
        node_name: str,
        flush_period_s: float = 0.2,
        drain_period_s: float = 0.04,
        queue_bytes: int = 64 * 1024 * 1024,
        on_error: Callable[[str], None] | None = None,
    ) -> None:
        """Create the bag; nothing is drained before start().

        Args:
            source: the deployer.
            directory: the bag's folder, which must not exist yet.
            node_name: absolute name of the executor's node, e.g. /robot_1/executor; the trace is below it.
            flush_period_s: at most so much is lost by a kill.
            drain_period_s: the rings (4,096 records each) must not fill up within it.
            queue_bytes: messages that may wait for a flush; what exceeds it is dropped and counted.
            on_error: called at most once for each cause, with one line, on the recorder thread.

        Raises:
            TraceError: the folder exists or cannot be written, or mauve_msgs is not installed.

        """
        self._source = source
        self._node_name = node_name.rstrip("/")
        self._flush_period_s = flush_period_s
        self._drain_period_s = min(drain_period_s, flush_period_s)
        self._queue_bytes = queue_bytes
        self._on_error = on_error
        self._bag = BagWriter(directory)
        try:
            self._bag.add_topic(self._topic(NAMES), _NAMES_TYPE, qos=_NAMES_QOS)
            self._bag.add_topic(self._topic(BATCHES), _BATCH_TYPE)
            self._bag.flush()
        except TraceError:
            self._bag.abort()
            raise
        self._names_written: tuple[Sequence[str], Sequence[str]] | None = None
        self._refused_types: set[tuple[str, str]] = set()
        self._lock = threading.Lock()
        self._waiting: list[_Waiting] = []
        self._waiting_bytes = 0
        self._dropped = 0
        self._recording = False
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
    def dropped_messages(self) -> int:
        """Messages given to record() that did not get into the bag."""
        with self._lock:
            return self._dropped

    def start(self) -> None:
        """Start the thread. Once only."""
        with self._lock:
            self._recording = True
        self._thread.start()

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
            if not self._recording or self._waiting_bytes + len(data) > self._queue_bytes:
                self._dropped += 1
                return False
            self._waiting.append(_Waiting(topic, type_name, data, monotonic_ns, qos))
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
            next_drain_s = next_flush_s = time.monotonic()
            while not self._stop.wait(max(0.0, next_drain_s - time.monotonic())):
                now_s = time.monotonic()
                self._drain(whole=now_s >= next_flush_s)
                if now_s >= next_flush_s:
                    self._bag.flush()
                    next_flush_s = max(next_flush_s + self._flush_period_s, now_s)
                next_drain_s = max(next_drain_s + self._drain_period_s, time.monotonic())
            with self._lock:
                self._recording = False
            self._drain(whole=True)
            self._bag.close()
        except Exception as error:  # noqa: BLE001 - whatever ends the recording, the executor lives on
            with self._lock:
                self._recording = False
            self._bag.abort()
            self._report(f"recording stopped: {error}")

    def _drain(self, *, whole: bool) -> None:
        """Move everything into the bag's buffer; a batch without records (it tells of losses) if `whole`."""
        with self._lock:  # before the drain: then no message is later than the clock pair that maps it
            waiting, self._waiting, self._waiting_bytes = self._waiting, [], 0
        drain = self._source.drain_trace()
        self._write_names(drain.realtime_ns)
        if drain.records or waiting or whole:
            batch = Batch(drain.monotonic_ns, drain.realtime_ns, drain.written, drain.dropped, drain.records)
            self._bag.write(self._topic(BATCHES), drain.realtime_ns, encode_batch(batch))
        offset_ns = drain.realtime_ns - drain.monotonic_ns
        for message in waiting:
            self._write_message(message, message.monotonic_ns + offset_ns)
        self._bag.set_custom_data(DROPPED_MESSAGES, str(self.dropped_messages))

    def _write_names(self, log_time_ns: int) -> None:
        """Write the words ahead of the records that use them (asked for after the drain: never too few)."""
        words = (self._source.trace_components(), self._source.trace_names())
        if words != self._names_written:
            self._names_written = words
            self._bag.write(self._topic(NAMES), log_time_ns, encode_names(*words))

    def _write_message(self, message: _Waiting, log_time_ns: int) -> None:
        try:
            self._bag.add_topic(message.topic, message.type_name, qos=message.qos)
        except TraceError as error:
            with self._lock:
                self._dropped += 1
            refused = (message.topic, message.type_name)
            if refused not in self._refused_types:
                self._refused_types.add(refused)
                self._report(f"topic {message.topic} is not recorded: {error}")
            return
        self._bag.write(message.topic, log_time_ns, message.data)

    def _report(self, text: str) -> None:
        if self._on_error is not None:
            self._on_error(text)

    def _topic(self, name: str) -> str:
        return f"{self._node_name}/{name}"
