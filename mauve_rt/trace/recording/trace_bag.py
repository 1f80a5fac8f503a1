"""The bag of one executor: its trace, and whatever messages it is given. For one thread at a time."""

import functools
import json
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.trace.bag.deletion import DELETED, Deleted
from mauve_rt.trace.bag.disk import Disk
from mauve_rt.trace.bag.metadata import BagFileCounts
from mauve_rt.trace.bag.recorded import ReceivedBatch, ReceivedTopic, SentMessage, Split, TopicQos
from mauve_rt.trace.bag.writer import BagWriter
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.cdr import Batch, encode_batch, encode_names
from mauve_rt.trace.recording.latched import LatchedMessages
from mauve_rt.trace.recording.ledger import (
    DROPPED_MESSAGES,
    INTERRUPTIONS,
    LEDGER,
    SNAPSHOT,
    Entry,
    Interruption,
    Snapshot,
)
from mauve_rt.trace.recording.sources import Drain, TraceWords

BATCHES = "trace/batches"
NAMES = "trace/names"
ARCHITECTURE = "trace/architecture"
_MOST_INTERRUPTIONS, _LONGEST_REASON = 16, 400
_RECORD_BYTES = 48
_BATCH_TYPE = "mauve_msgs/msg/TraceBatch"
_NAMES_TYPE = "mauve_msgs/msg/TraceNames"
_ARCHITECTURE_TYPE = "mauve_msgs/msg/TraceArchitecture"
_LATCHED = TopicQos(depth=1, transient_local=True)


class _Gone(NamedTuple):
    """What the limit of the bag's size deleted."""

    deleted: Deleted
    messages: Counter[str] = Counter()  # noqa: RUF012 - never changed

    def plus(self, file: BagFileCounts, records: int, messages: Mapping[str, int]) -> "_Gone":
        """Return it with a further file."""
        before = self.deleted
        counts = file.counts
        deleted = before._replace(
            files=before.files + 1,
            records=before.records + records,
            from_ns=before.from_ns or counts.start_ns,
            until_ns=max(before.until_ns, counts.end_ns),
            last_file=file.name,
        )
        return _Gone(deleted, self.messages + Counter(messages))


class TraceBag:
    """Writes what a trace source yields, and messages on the same time base.

    Publish times are CLOCK_REALTIME: monotonic times are mapped by the clock pair of their drain. Log times
    are the same, but never run backwards: after that clock was set back they stay ahead of it by as much,
    since readers play a bag by its log times. Each file begins with the words, the architecture, a batch
    without records where there were records before it, and what latched topics said last: so it can be read
    alone. Nobody is told who sent a message, so of a latched topic the last 16 different ones count, 8 MiB at
    most.
    """

    def __init__(
        self,
        words: TraceWords,
        directory: Path,
        *,
        node_name: str,
        on_error: Callable[[str], None],
        split: Split | None = None,
        disk: Disk | None = None,
        compression: str = "none",
    ) -> None:
        """Create the bag; nothing is drained yet.

        Args:
            words: a host's.
            directory: the bag's folder, which must not exist yet.
            node_name: absolute name of the executor's node; the trace is below it.
            on_error: called at most once for each type that cannot be recorded, with one line.
            split: when it goes on in a new file; after a minute unless said otherwise.
            disk: closed with the bag.
            compression: of the chunks of its files, one of COMPRESSIONS.

        Raises:
            TraceError: the folder exists or cannot be written, or mauve_msgs is not installed.

        """
        self._words = words
        self._split = split or Split()
        self._node_name = node_name.rstrip("/")
        self._on_error = on_error
        self._bag = BagWriter(directory, disk=disk, keeps_room=True, compression=compression)
        try:
            self._bag.add_topic(self._topic(NAMES), _NAMES_TYPE, qos=_LATCHED)
            self._bag.add_topic(self._topic(BATCHES), _BATCH_TYPE)
            self._bag.add_topic(self._topic(ARCHITECTURE), _ARCHITECTURE_TYPE, qos=_LATCHED)
            self._bag.flush()  # metadata.yaml names them; the file does when it has a message
        except TraceError:
            self._bag.abort()
            raise
        self._names: tuple[Sequence[str], Sequence[str]] | None = None
        self._latched: dict[str, bytes] = {}  # each file begins with these
        self._latched_of_others = LatchedMessages()
        self._repeated: Counter[str] = Counter()
        self._repeated_waiting: Counter[str] = Counter()  # for the next flush
        self._records_waiting = 0
        self._dropped_flushed = 0  # by the rings
        self._entries: dict[str, Entry] = {}  # but for what this class adds
        self._records_in: Counter[str] = Counter()  # by file
        self._gone = _Gone(Deleted(self._split.max_bytes))
        self._interruptions: deque[Interruption] = deque(maxlen=_MOST_INTERRUPTIONS)
        self._is_interrupted = False
        self._last: Drain | None = None
        self._ahead_ns: int | None = None  # log time - monotonic time
        self._refused_types: set[tuple[str, str]] = set()

    @property
    def directory(self) -> Path:
        """The bag's folder."""
        return self._bag.directory

    @property
    def message_count(self) -> int:
        """Messages in it, the trace's own among them."""
        return self._bag.message_count

    def write(self, drain: Drain, messages: Sequence[SentMessage], *, whole: bool) -> Counter[str]:
        """Move what was drained, and messages from before, into the buffer; returns what was refused.

        A batch without records (it tells of losses) is written if `whole`.
        """
        self._last = drain
        count = len(drain.records) // _RECORD_BYTES
        self._records_waiting += count
        self._records_in[self._bag.file_name] += count
        self._write_names(drain)
        if drain.records or messages or whole:
            self._write_batch(drain, drain.records)
        return Counter(message.topic for message in messages if not self._write_message(message, drain))

    def write_received(
        self, batch: ReceivedBatch, topics: Sequence[ReceivedTopic], drain: Drain
    ) -> Counter[str]:
        """Move messages of other nodes, from before the drain, into the buffer; returns what was refused."""
        refused: Counter[str] = Counter()
        written: list[str | None] = [None] * len(topics)
        for number, (topic, count) in enumerate(zip(topics, batch.sizes, strict=True)):
            if not count:
                continue
            if not self._declare(topic.name, topic.type_name, topic.qos):
                refused[topic.name] += count
            elif topic.qos.transient_local:
                for time_ns, data in batch.messages(number):
                    message = SentMessage(topic.name, topic.type_name, data, time_ns, topic.qos)
                    self._write_message(message, drain)
            else:
                written[number] = topic.name
        log_ahead_ns = self._log_time_ns(drain, 0)
        self._bag.write_batch(batch, written, ahead_ns=(log_ahead_ns, drain.realtime_ns - drain.monotonic_ns))
        return refused

    def discard(
        self, drain: Drain, *, architecture: bytes = b"", latched: Iterable[SentMessage] = ()
    ) -> None:
        """Leave out what was recorded before this bag; only how much it was gets into it.

        `architecture`, `latched`: of what was left out, what begins the bag: it is still in effect.
        """
        self._last = drain
        self._dropped_flushed = sum(drain.dropped)
        self._write_names(drain)
        if architecture:
            self.tell_architecture(architecture, drain)
        self._write_batch(drain, b"")
        for message in latched:
            if self._declare(message.topic, message.type_name, message.qos, message.definition):
                self._latched_of_others.keep(message)
                self._repeat(message, drain)

    def tell_snapshot(self, snapshot: Snapshot) -> None:
        """Note with the next flush of what the bag is a snapshot."""
        self._bag.set_custom_data(SNAPSHOT, json.dumps(snapshot._asdict()))

    def tell_architecture(self, data: bytes, drain: Drain) -> None:
        """Write a serialized mauve_msgs/msg/TraceArchitecture, unless it is the last one again."""
        self._write_latched(ARCHITECTURE, data, drain)

    def tell_dropped(self, messages: int) -> None:
        """Note with the next flush how many messages did not get into the bag."""
        self._bag.set_custom_data(DROPPED_MESSAGES, str(messages))

    def tell_ledger(
        self, received: Mapping[str, int], lost: Mapping[str, int], others: Mapping[str, Entry] | None = None
    ) -> None:
        """Note with the next flush what became of the messages of each topic."""
        told = {topic: Entry(count, lost.get(topic, 0)) for topic, count in received.items()}
        for topic, entry in (others or {}).items():
            # Own as well: a resource was bound to it while it was recorded.
            told[topic] = entry.plus(told.get(topic, Entry()))
        self._entries = told
        self._tell_ledger()

    def _tell_ledger(self) -> None:
        gone = self._gone
        entries = {
            topic: entry._replace(repeated=self._repeated[topic], deleted=gone.messages[topic])._asdict()
            for topic, entry in self._entries.items()
        }
        self._bag.set_custom_data(LEDGER, json.dumps(entries))
        if gone.deleted.files:
            messages = sum(gone.messages[topic] for topic in self._entries)
            self._bag.set_custom_data(DELETED, json.dumps(gone.deleted._replace(messages=messages)._asdict()))

    def flush(self) -> None:
        """Make the bag a finished one of all that was written; go on in a new file when it is time."""
        self._write_out(self._bag.flush)
        last = self._last
        if last is not None and self._is_time_to_split(self._log_time_ns(last, last.monotonic_ns)):
            self._bag.split()
            self._begin_file(last)

    def finish(self) -> None:
        """Flush a last time. Then abort() closes the bag."""
        self._write_out(self._bag.finish)

    def _write_out(self, flush: Callable[[], None]) -> None:
        """Flush; where the bag is too large, without the oldest files, which are deleted afterwards."""
        before = self._gone
        while 0 < self._split.max_bytes < self._bag.total_bytes:
            removed = self._bag.remove_oldest()
            if removed is None:
                break
            records = self._records_in[removed.name]
            self._gone = self._gone.plus(removed, records, self._bag.messages_in(removed))
        if self._gone is not before:
            self._tell_ledger()
        try:
            flush()
        except TraceError:
            self._gone = before
            self._tell_ledger()
            raise
        self._note_flushed()
        self._bag.delete_removed()

    def close(self) -> None:
        """Flush a last time, and close."""
        try:
            self.finish()
        finally:
            self.abort()

    @property
    def is_interrupted(self) -> bool:
        """Whether nothing can be written since interrupt()."""
        return self._is_interrupted

    def interrupt(self, reason: str) -> Counter[str]:
        """Give up what no flush could write; returns the messages, by topic. Write nothing until go_on()."""
        own = {self._topic(name) for name in (NAMES, BATCHES, ARCHITECTURE)}
        waiting = self._bag.drop_waiting()
        lost = Counter({topic: count for topic, count in waiting.items() if topic not in own})
        lost -= self._repeated_waiting
        self._repeated -= self._repeated_waiting
        self._repeated_waiting.clear()
        now_ns = self._last.realtime_ns if self._last is not None else time.time_ns()
        self._interruptions.append(Interruption(reason[:_LONGEST_REASON], now_ns))
        self._is_interrupted = True
        self._records_in[self._bag.file_name] -= self._records_waiting
        self._lose_records(self._records_waiting)
        return lost

    def skip(self, drain: Drain) -> None:
        """Count what was drained while the bag is interrupted."""
        self._last = drain
        self._lose_records(len(drain.records) // _RECORD_BYTES)

    def write_last_words(self) -> None:
        """Write ledger, drop counts and interruptions into the room that the bag keeps for them.

        Raises:
            TraceError: they do not fit, or the disk failed.

        """
        self._tell_interruptions()
        self._bag.write_into_room()

    def go_on(self) -> Interruption:
        """Go on in a new file; returns what it missed.

        Raises:
            TraceError: there is no room yet; the bag is as before.

        """
        last, ongoing = self._last, self._interruptions[-1]
        if last is None:
            msg = "nothing was drained yet"
            raise TraceError(msg)
        ended = ongoing._replace(until_ns=last.realtime_ns)
        self._interruptions[-1] = ended
        self._tell_interruptions()
        try:
            self._bag.go_on(functools.partial(self._begin_file, last))
        except TraceError:
            self._interruptions[-1] = ongoing
            self._repeated -= self._repeated_waiting
            self._repeated_waiting.clear()
            raise
        self._note_flushed()
        self._is_interrupted = False
        return ended

    def _begin_file(self, last: Drain) -> None:
        for topic, data in self._latched.items():
            self._write(self._topic(topic), data, last, last.monotonic_ns)
        self._write_batch(last, b"")
        for message in self._latched_of_others:
            self._repeat(message, last)

    def _repeat(self, message: SentMessage, last: Drain) -> None:
        self._write(message.topic, message.data, last, last.monotonic_ns)
        self._repeated[message.topic] += 1
        self._repeated_waiting[message.topic] += 1

    def _note_flushed(self) -> None:
        self._repeated_waiting.clear()
        self._records_waiting = 0
        self._dropped_flushed = sum(self._last.dropped) if self._last is not None else 0

    def _lose_records(self, count: int) -> None:
        dropped = sum(self._last.dropped) if self._last is not None else 0
        count += max(dropped - self._dropped_flushed, 0)  # by the rings
        self._dropped_flushed = dropped
        self._records_waiting = 0
        ongoing = self._interruptions[-1]
        self._interruptions[-1] = ongoing._replace(records=ongoing.records + count)

    def _tell_interruptions(self) -> None:
        told = json.dumps([one._asdict() for one in self._interruptions])
        self._bag.set_custom_data(INTERRUPTIONS, told)

    def abort(self) -> None:
        """Leave the bag as the last flush left it."""
        self._bag.abort()

    def _is_time_to_split(self, now_ns: int) -> bool:
        age_s = (now_ns - (self._bag.file_start_ns or now_ns)) / 1e9
        return 0 < self._split.after_s <= age_s or 0 < self._split.file_bytes <= self._bag.file_bytes

    def _write_batch(self, drain: Drain, records: bytes) -> None:
        batch = Batch(drain.monotonic_ns, drain.realtime_ns, drain.written, drain.dropped, records)
        self._write(self._topic(BATCHES), encode_batch(batch), drain, drain.monotonic_ns)

    def _write_names(self, drain: Drain) -> None:
        """Write the words ahead of the records that use them (asked for after the drain: never too few)."""
        words = (self._words.trace_components(), self._words.trace_names())
        if words != self._names:
            self._names = words
            self._write_latched(NAMES, encode_names(*words), drain)

    def _write_latched(self, topic: str, data: bytes, drain: Drain) -> None:
        if self._latched.get(topic) != data:
            self._latched[topic] = data
            self._write(self._topic(topic), data, drain, drain.monotonic_ns)

    def _declare(self, topic: str, type_name: str, qos: TopicQos | None, definition: str = "") -> bool:
        try:
            self._bag.add_topic(topic, type_name, qos=qos, definition=definition)
        except TraceError as error:
            if (topic, type_name) not in self._refused_types:
                self._refused_types.add((topic, type_name))
                self._on_error(f"topic {topic} is not recorded: {error}")
            return False
        return True

    def _write_message(self, message: SentMessage, drain: Drain) -> bool:
        if not self._declare(message.topic, message.type_name, message.qos, message.definition):
            return False
        self._write(message.topic, message.data, drain, message.monotonic_ns)
        self._latched_of_others.keep(message)
        return True

    def _write(self, topic: str, data: bytes, drain: Drain, monotonic_ns: int) -> None:
        """Write what was sent at a time, mapped by a drain's clock pair."""
        published_ns = monotonic_ns + drain.realtime_ns - drain.monotonic_ns
        log_time_ns = self._log_time_ns(drain, monotonic_ns)
        self._bag.write(topic, log_time_ns, data, publish_time_ns=published_ns)

    def _log_time_ns(self, drain: Drain, monotonic_ns: int) -> int:
        ahead_ns = drain.realtime_ns - drain.monotonic_ns
        self._ahead_ns = ahead_ns if self._ahead_ns is None else max(ahead_ns, self._ahead_ns)
        return monotonic_ns + self._ahead_ns

    def _topic(self, name: str) -> str:
        return f"{self._node_name}/{name}"
