"""The last seconds of a recording, in memory. A request writes them as a bag."""

import threading
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.trace.bag.disk import KeptDisk
from mauve_rt.trace.bag.recorded import ReceivedBatch, ReceivedTopic, SentMessage, Split, Window
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.recording.latched import LatchedMessages
from mauve_rt.trace.recording.ledger import Entry, Snapshot
from mauve_rt.trace.recording.sources import Drain, Drained, TraceWords
from mauve_rt.trace.recording.trace_bag import TraceBag

_PIECE_BYTES, _MESSAGE_BYTES = 1000, 200  # what objects cost besides their data, about
_FLUSH_BYTES = 1 << 20
_NEWEST_S = 1.0  # a snapshot waits so long for what comes before its request
_NO_COUNTS: Mapping[str, int] = {}


class _Piece(NamedTuple):
    """What one flush of a recorder yields, and the counts of the recording at its end."""

    drain: Drained
    messages: Sequence[SentMessage] = ()
    architecture: bytes = b""
    received: Mapping[str, int] = _NO_COUNTS
    lost: Mapping[str, int] = _NO_COUNTS
    others: Mapping[str, Entry] = {}
    dropped: int = 0

    @property
    def size(self) -> int:
        """Bytes in memory, about."""
        data = sum(len(one.data) + _MESSAGE_BYTES for one in self.messages)
        return len(self.drain.records) + data + _PIECE_BYTES


class _Content(NamedTuple):
    """What the memory holds at one instant."""

    before: _Piece | None
    """The last piece that it holds no longer, without its data."""
    latched: Sequence[SentMessage]
    pieces: Sequence[_Piece]
    snapshot: Snapshot


class _Words(NamedTuple):
    """Words of a host at one instant, as TraceWords."""

    components: list[str]
    names: list[str]

    def trace_components(self) -> list[str]:
        return self.components

    def trace_names(self) -> list[str]:
        return self.names


class WrittenSnapshot:
    """A snapshot that a thread of its own writes. From any thread."""

    def __init__(
        self,
        directory: Path,
        write: Callable[[Path], tuple[int, Snapshot]],
        *,
        on_error: Callable[[str], None],
    ) -> None:
        """Begin; `write` creates the bag, and returns how many messages are in it."""
        self.directory = directory
        self.error = ""
        """Why the bag is not complete; empty while that is not known."""
        self.messages = 0
        self.snapshot: Snapshot | None = None
        self._write = write
        self._on_error = on_error
        self._thread = threading.Thread(target=self._run, name="snapshot", daemon=True)
        self._thread.start()

    def wait(self, timeout_s: float) -> bool:
        """Whether it has ended, with or without an error."""
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self.messages, self.snapshot = self._write(self.directory)
        except Exception as error:  # noqa: BLE001 - whatever ends it, the executor lives on
            self.error = str(error) or type(error).__name__
            self._on_error(f"snapshot: {self.error}")


class RecentBag:
    """Takes what a TraceBag takes, and keeps the last seconds of it.

    The memory is bounded by time and by bytes: what is older than the last seconds goes, and as much more as
    does not fit. The newest flush always stays.

    | member                          | written by          | guarded by  |
    | ------------------------------- | ------------------- | ----------- |
    | `_pieces` ... `_is_closed`      | the recorder thread | `_changed`  |
    | `_architecture` ... `_dropped`  | the recorder thread |             |
    | `_written`                      | snapshot()          | `_changed`  |
    """

    is_interrupted = False  # no disk can fail

    def __init__(
        self,
        words: TraceWords,
        directory: Path,
        *,
        window: Window,
        node_name: str,
        on_error: Callable[[str], None],
        split: Split | None = None,
        keeper: Path | None = None,
        compression: str = "none",
    ) -> None:
        """Keep nothing yet; `directory`: snapshots are created in it. Else as TraceBag."""
        self.directory = directory
        self._words = words
        self._window = window
        self._node_name = node_name
        self._on_error = on_error
        self._split = split
        self._keeper = keeper
        self._compression = compression
        self._changed = threading.Condition()
        self._pieces: deque[_Piece] = deque()
        self._sizes: deque[int] = deque()  # of the pieces
        self._bytes = 0  # of all
        self._before: _Piece | None = None
        self._latched = LatchedMessages()  # of what is held no longer
        self._is_begun = False  # something is held no longer
        self._sealed = 0
        self._is_closed = False
        self._written: WrittenSnapshot | None = None
        self._architecture = b""
        self._drain: Drain | None = None
        self._messages: list[SentMessage] = []
        self._counts: tuple[Mapping[str, int], Mapping[str, int], Mapping[str, Entry]] = ({}, {}, {})
        self._dropped = 0

    # ---- as a TraceBag, by the recorder

    @property
    def message_count(self) -> int:
        """Messages in memory, the trace's own among them."""
        with self._changed:
            return sum(len(piece.messages) + 1 for piece in self._pieces)

    def write(self, drain: Drain, messages: Sequence[SentMessage], *, whole: bool) -> Counter[str]:  # noqa: ARG002
        """As TraceBag.write(); a snapshot finds out what it cannot write."""
        self._drain = drain
        self._messages += messages
        return Counter()

    def write_received(
        self,
        batch: ReceivedBatch,
        topics: Sequence[ReceivedTopic],
        drain: Drain,  # noqa: ARG002
    ) -> Counter[str]:
        """As TraceBag.write_received()."""
        for number, (topic, count) in enumerate(zip(topics, batch.sizes, strict=True)):
            if count:
                self._messages += [
                    SentMessage(topic.name, topic.type_name, data, time_ns, topic.qos)
                    for time_ns, data in batch.messages(number)
                ]
        return Counter()

    def discard(self, drain: Drain) -> None:
        """As TraceBag.discard()."""
        with self._changed:
            self._before = _Piece(_value(drain, b""))

    def tell_architecture(self, data: bytes, drain: Drain) -> None:  # noqa: ARG002
        """As TraceBag.tell_architecture()."""
        self._architecture = data

    def tell_dropped(self, messages: int) -> None:
        """As TraceBag.tell_dropped()."""
        self._dropped = messages

    def tell_ledger(
        self, received: Mapping[str, int], lost: Mapping[str, int], others: Mapping[str, Entry] | None = None
    ) -> None:
        """As TraceBag.tell_ledger()."""
        self._counts = (received, lost, others or {})

    def flush(self) -> None:
        """Keep what was written, and drop what is too old or does not fit."""
        if self._drain is None:
            return
        drain = _value(self._drain, self._drain.records)
        piece = _Piece(drain, tuple(self._messages), self._architecture, *self._counts, self._dropped)
        self._drain, self._messages = None, []
        with self._changed:
            self._pieces.append(piece)
            self._sizes.append(piece.size)
            self._bytes += piece.size
            oldest_ns = drain.monotonic_ns - round(self._window.seconds * 1e9)
            while len(self._pieces) > 1 and (
                self._pieces[0].drain.monotonic_ns <= oldest_ns or self._bytes > self._window.max_bytes
            ):
                self._drop_oldest()
            self._sealed += 1
            self._changed.notify_all()

    def finish(self) -> None:
        """Flush for the last time."""
        self.flush()

    def abort(self) -> None:
        """Nothing comes after this."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def _drop_oldest(self) -> None:
        piece = self._pieces.popleft()
        self._bytes -= self._sizes.popleft()
        for message in piece.messages:
            self._latched.keep(message)
        self._before = piece._replace(messages=(), drain=piece.drain._replace(records=b""))
        self._is_begun = True

    # ---- snapshots

    def snapshot(self, directory: Path) -> WrittenSnapshot | None:
        """Begin to write what is in memory as a new bag; None: an earlier snapshot is still being written."""
        with self._changed:
            if self._written is not None and not self._written.wait(0):
                return None
            self._written = WrittenSnapshot(directory, self._write, on_error=self._on_error)
            return self._written

    @property
    def written(self) -> WrittenSnapshot | None:
        """The last snapshot, or the one that is being written."""
        with self._changed:
            return self._written

    def _take(self) -> _Content:
        with self._changed:
            # One flush may be under way, without the records of just now.
            first = self._sealed + 2
            self._changed.wait_for(lambda: self._is_closed or self._sealed >= first, _NEWEST_S)
            pieces, before = tuple(self._pieces), self._before
            latched = tuple(self._latched)
            is_begun = self._is_begun
        if not pieces:
            msg = "there is nothing in memory yet; ask again in a second"
            raise TraceError(msg)
        first_drain, last = (before or pieces[0]).drain, pieces[-1].drain
        held_s = (last.monotonic_ns - first_drain.monotonic_ns) / 1e9
        snapshot = Snapshot(
            asked_s=self._window.seconds,
            from_ns=last.realtime_ns - (last.monotonic_ns - first_drain.monotonic_ns),
            until_ns=last.realtime_ns,
            max_bytes=self._window.max_bytes,
            is_short=is_begun and held_s < self._window.seconds,
        )
        return _Content(before, latched, pieces, snapshot)

    def _write(self, directory: Path) -> tuple[int, Snapshot]:
        content = self._take()
        # Asked for after the last drain: there are never too few words.
        words = _Words(self._words.trace_components(), self._words.trace_names())
        bag = TraceBag(
            words,
            directory,
            node_name=self._node_name,
            on_error=self._on_error,
            split=self._split,
            disk=None if self._keeper is None else KeptDisk(self._keeper, on_error=self._on_error),
            compression=self._compression,
        )
        try:
            _write_content(content, bag)
            return bag.message_count, content.snapshot
        finally:
            bag.abort()


def _write_content(content: _Content, bag: TraceBag) -> None:
    before = content.before
    bag.tell_snapshot(content.snapshot)
    if before is not None:
        bag.discard(before.drain, architecture=before.architecture, latched=content.latched)
    base = before or _Piece(content.pieces[0].drain)
    refused: Counter[str] = Counter()
    waiting_bytes = 0
    for piece in content.pieces:
        if piece.architecture:
            bag.tell_architecture(piece.architecture, piece.drain)
        refused += bag.write(piece.drain, piece.messages, whole=True)
        others = {
            topic: entry.since(base.others.get(topic, Entry())) for topic, entry in piece.others.items()
        }
        own = Counter(refused)
        for topic in own.keys() & others.keys():
            others[topic] = others[topic]._replace(lost=others[topic].lost + own.pop(topic))
        lost = _since(piece.lost, base.lost)
        for topic, count in own.items():
            lost[topic] = lost.get(topic, 0) + count
        bag.tell_ledger(_since(piece.received, base.received), lost, others)
        bag.tell_dropped(piece.dropped - base.dropped + refused.total())
        waiting_bytes += piece.size
        if waiting_bytes > _FLUSH_BYTES:
            bag.flush()
            waiting_bytes = 0
    bag.tell_snapshot(content.snapshot._replace(is_complete=True))
    bag.finish()


def _since(counts: Mapping[str, int], before: Mapping[str, int]) -> dict[str, int]:
    return {topic: count - before.get(topic, 0) for topic, count in counts.items()}


def _value(drain: Drain, records: bytes) -> Drained:
    written, dropped = list(drain.written), list(drain.dropped)
    return Drained(records, written, dropped, drain.monotonic_ns, drain.realtime_ns)
