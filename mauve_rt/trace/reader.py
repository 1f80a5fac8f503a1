"""Reads a recorded trace back by rosbags and the definitions stored in the bag; needs no message package."""

import struct
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from heapq import merge
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag2 import Reader, ReaderError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from mauve_rt.trace.cdr import Batch, decode_batch
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.records import RECORD, Records
from mauve_rt.trace.trace import Loss, Message, Trace

_BATCH_TYPE = "mauve_msgs/msg/TraceBatch"
_NAMES_TYPE = "mauve_msgs/msg/TraceNames"
_UNREADABLE = (
    ReaderError, OSError, AssertionError, TypeError, ValueError, KeyError, IndexError, OverflowError,
    MemoryError, EOFError, struct.error,
)  # fmt: skip
"""What rosbags raises for damaged files."""


def read_bag(path: str | Path) -> Trace:
    """Read the trace in a bag: a rosbag2 folder with MCAP files, or one such file.

    metadata.yaml is not consulted: the files tell the same, and are never older. The bag of a running
    recorder is whole between two flushes; who meets one finds it damaged, and may try again.

    Raises:
        TraceError: not a bag, a bag without a trace or with several executors', or one that cannot be read.

    """
    files = _files(Path(path))
    batches: list[Batch] = []
    words: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    topics: set[str] = set()
    for file in files:
        with _OpenFile(file) as bag:
            topics.update(bag.topics(_BATCH_TYPE))
            batches += [decode_batch(data) for _, _, data in bag.raw(_BATCH_TYPE)]
            for connection, _, data in bag.raw(_NAMES_TYPE):
                said = bag.decoded(connection, data)
                words = (tuple(said.components), tuple(said.names))
    if len(topics) != 1:
        found = " and ".join(sorted(topics)) or f"no topic of type {_BATCH_TYPE}"
        msg = f"bag {path}: expected the trace of one executor, found {found}"
        raise TraceError(msg)
    pairs = np.array([(batch.monotonic_ns, batch.realtime_ns) for batch in batches], np.int64).reshape(-1, 2)
    pairs = pairs[np.argsort(pairs[:, 1], kind="stable")]
    records, losses = _per_component(batches, words[0])

    def messages(wanted: tuple[str, ...]) -> Iterator[Message]:
        return _messages(files, wanted, pairs)

    return Trace(records, words[1], losses, pairs, messages)


class _OpenFile:
    """One MCAP file of a bag, with its message types."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._reader = Reader(path)
        self._store: Typestore = get_typestore(Stores.EMPTY)

    def __enter__(self) -> Self:
        try:
            self._reader.open()
        except _UNREADABLE as error:
            msg = f"bag file {self._path}: cannot be read ({error})"
            raise TraceError(msg) from error
        types: dict[str, Any] = {}
        for connection in self._reader.connections:
            if connection.msgdef.format == MessageDefinitionFormat.MSG:
                types.update(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        self._store.register(types)
        return self

    def __exit__(self, *_: object) -> None:
        self._reader.close()

    def topics(self, type_name: str) -> set[str]:
        """Topics of one type."""
        return {item.topic for item in self._reader.connections if item.msgtype == type_name}

    def raw(self, type_name: str) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages of one type, by log time."""
        return self.raw_of([item for item in self._reader.connections if item.msgtype == type_name])

    def raw_of_topics(self, topics: Iterable[str]) -> Iterator[tuple[Connection, int, bytes]]:
        """Messages of these topics; of all but the trace's own when there is none."""
        wanted = set(topics)
        own = {_BATCH_TYPE, _NAMES_TYPE}
        chosen = [
            item
            for item in self._reader.connections
            if (item.topic in wanted if wanted else item.msgtype not in own)
        ]
        return self.raw_of(chosen)

    def raw_of(self, connections: list[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        if not connections:  # to rosbags an empty list means all
            return
        try:
            yield from self._reader.messages(connections)
        except _UNREADABLE as error:
            msg = f"bag file {self._path}: cannot be read ({error})"
            raise TraceError(msg) from error

    def decoded(self, connection: Connection, data: bytes) -> Any:
        """Return the message as an object of a class that rosbags made from the bag's definition."""
        return self._store.deserialize_cdr(data, connection.msgtype)


def _files(path: Path) -> list[Path]:
    if path.is_file() and path.suffix == ".mcap":
        return [path]
    found = sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name)) if path.is_dir() else []
    if not found:
        what = "no .mcap file in it" if path.is_dir() else "not a folder" if path.exists() else "not there"
        msg = f"bag {path}: expected a rosbag2 folder with MCAP files; {what}"
        raise TraceError(msg)
    return found


def _per_component(
    batches: list[Batch], components: tuple[str, ...]
) -> tuple[dict[str, Records], dict[str, Loss]]:
    arrays = [np.frombuffer(batch.records, RECORD) for batch in batches]
    everything: Records = np.concatenate(arrays or [np.empty(0, RECORD)])
    last = max(batches, key=lambda batch: batch.monotonic_ns) if batches else Batch(0, 0, (), (), b"")
    named = len(last.written)
    highest = int(everything["component"].max(initial=0)) if len(everything) else -1
    names = [*components, *(f"component {i}" for i in range(len(components), max(named, highest + 1)))]
    records: dict[str, Records] = {}
    losses: dict[str, Loss] = {}
    for index, name in enumerate(names):
        rows = everything[everything["component"] == index]
        rows = rows[np.argsort(rows["sequence"], kind="stable")]
        gaps = int(rows["sequence"][-1]) + 1 - len(rows) if len(rows) else 0
        written = last.written[index] if index < named else 0
        dropped = last.dropped[index] if index < len(last.dropped) else 0
        if name in records:  # removed and added again: the same component's next life
            rows = np.concatenate([records[name], rows])
            before = losses[name]
            written, dropped, gaps = before.written + written, before.dropped + dropped, before.gaps + gaps
        records[name] = rows
        losses[name] = Loss(written, len(rows), dropped, gaps)
    return records, losses


def _messages(files: list[Path], topics: tuple[str, ...], pairs: npt.NDArray[np.int64]) -> Iterator[Message]:
    def of_file(bag: _OpenFile) -> Iterator[Message]:
        for connection, log_time_ns, data in bag.raw_of_topics(topics):
            monotonic_ns = _monotonic_ns(log_time_ns, pairs)
            yield Message(connection.topic, log_time_ns, monotonic_ns, bag.decoded(connection, data))

    with ExitStack() as stack:
        sources = [of_file(stack.enter_context(_OpenFile(file))) for file in files]
        yield from merge(*sources, key=lambda message: message.log_time_ns)


def _monotonic_ns(log_time_ns: int, pairs: npt.NDArray[np.int64]) -> int:
    """Undo the recorder's mapping: it used the pair of the drain that followed the message."""
    if not len(pairs):
        return log_time_ns
    index = min(int(np.searchsorted(pairs[:, 1], log_time_ns)), len(pairs) - 1)
    return log_time_ns - int(pairs[index, 1] - pairs[index, 0])
