"""Reads a recorded trace back by the definitions stored in the bag; needs no message package.

Files are read from their begin and not by their summary, so that the bag of a recorder that runs, or that was
killed, gives all it has. metadata.yaml is not consulted: the files tell the same, and are never older.
"""

import heapq
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.bag.deletion import Deleted, deleted_of
from mauve_rt.trace.bag.files import MCAP, bag_files
from mauve_rt.trace.bag.mcap_library import Channel
from mauve_rt.trace.bag.mcap_scan import McapScan
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.cdr import Batch, decode_batch
from mauve_rt.trace.format.kinds import RecordKind, kinds_told
from mauve_rt.trace.format.message_decoding import Decoder
from mauve_rt.trace.format.records import RECORD, Records
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.architecture import ComponentInfo, with_known_policies
from mauve_rt.trace.reading.decisions import RULES, traced_decisions
from mauve_rt.trace.reading.facts import OWN_TYPES, BagFile, Deployment, Loss, Message
from mauve_rt.trace.reading.shadows import SHADOW_TYPE, Shadow
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.ledger import Entry, ledger_of

if TYPE_CHECKING:
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan

_BATCH_TYPE, _NAMES_TYPE, _ARCHITECTURE_TYPE = OWN_TYPES
_DISORDER_NS = 2_000_000_000  # messages of a bag are in order of log time but for the queues they waited in
_NOTHING = Batch(0, 0, (), (), b"")
_NO_RECORDS = np.empty(0, RECORD)
_RECORD_FIELDS = [
    ("uint64", "sequence"), ("int64", "time_ns"), ("int64", "a"), ("int64", "b"), ("int64", "c"),
    ("uint32", "name"), ("uint16", "kind"), ("uint16", "component"),
]  # fmt: skip
_RECORD_PART = re.compile(
    r"^MSG: mauve_msgs/(?:msg/)?TraceRecord\n(.*?)(?:^=+$|\Z)", re.MULTILINE | re.DOTALL
)
_FIELD = re.compile(r"^\s*([a-z]\w*)\s+([a-z]\w*)\s*(?:#.*)?$", re.MULTILINE)


def open_trace(path: str | Path, *, progress: Progress = silent) -> Trace:
    """Read the trace in a bag: a rosbag2 folder with MCAP files or sqlite3's, or one such file.

    Also of a recorder that runs. What a kill left half-written is left out, and told in `Trace.files`.

    Raises:
        TraceError: not a bag, a bag without a trace or with several executors', one of another version of
        mauve_rt, or one that cannot be read.

    """
    files = bag_files(Path(path))
    sizes = {file: size for file in files if (size := _size(file))}  # a kill leaves one just begun empty
    sizes = sizes or dict.fromkeys(files, 0)
    content = _Content(Path(path))
    done = 0
    for file, size in sizes.items():
        if len(sizes) > 1 and not file.exists():  # deleted since, for the size of the bag
            continue
        with _scan(file) as scan:
            for channel, message in scan.messages():
                content.add(scan, channel, message.data, published_ns=message.publish_time)
                progress((done + scan.whole_bytes) / max(sum(sizes.values()), 1), "reading")
            content.ledger = ledger_of(scan.custom_data) or content.ledger
            content.deleted = deleted_of(scan.custom_data) or content.deleted
            content.files.append(BagFile(file, scan.library, scan.whole_bytes, scan.damage))
        done += size
    return content.trace([file.path for file in content.files])


def _size(file: Path) -> int:
    try:
        return file.stat().st_size
    except FileNotFoundError:  # the recorder has just deleted it: the bag has a limit of size
        return 0


def _scan(file: Path) -> "McapScan | SqliteScan":
    if file.suffix == MCAP:
        return McapScan(file)
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan  # noqa: PLC0415 - 50 ms, and seldom needed

    return SqliteScan(file)


class _Content:
    """What was read of a bag, message by message."""

    def __init__(self, path: Path) -> None:
        self.files: list[BagFile] = []
        self.ledger: dict[str, Entry] = {}  # as the last file tells
        self.deleted: Deleted | None = None  # likewise
        self._path = path
        self._topics: set[str] = set()
        self._all_topics: dict[str, tuple[str, int]] = {}
        self._batches: list[Batch] = []
        self._components: tuple[str, ...] = ()
        self._names: tuple[str, ...] = ()
        self._architecture: tuple[ComponentInfo, ...] = ()
        self._threads: Any = None
        self._first_grids: dict[str, Deployment] | None = None
        self._known: set[tuple[Path, int]] = set()
        self._types = _Types()
        self._kinds: dict[int, RecordKind] = {}
        self._shadows: list[Shadow] = []  # with times of CLOCK_REALTIME

    def add(self, scan: "McapScan | SqliteScan", channel: Channel, data: bytes, *, published_ns: int) -> None:
        type_name = scan.type_of(channel)
        self._all_topics[channel.topic] = (type_name, self._all_topics.get(channel.topic, ("", 0))[1] + 1)
        if type_name not in (*OWN_TYPES, SHADOW_TYPE):
            return
        if (scan.path, channel.id) not in self._known:
            self._known.add((scan.path, channel.id))
            if type_name == _BATCH_TYPE:
                self._kinds.update(kinds_told(_record_definition(scan, channel)))
        try:
            # Not by rosbags: it makes an object of each record, in 1.0 us; here a record takes 0.002 us.
            if type_name == _BATCH_TYPE:
                self._topics.add(channel.topic)
                self._batches.append(decode_batch(data))
            elif type_name == _NAMES_TYPE:
                said = self._types.decoded(scan, channel, data)
                self._components, self._names = tuple(said.components), tuple(said.names)
            elif type_name == SHADOW_TYPE:
                said = self._types.decoded(scan, channel, data)
                self._shadows.append(Shadow.of_message(said, published_ns))
            else:
                self._add_architecture(self._types.decoded(scan, channel, data))
        except TraceError as error:
            msg = f"bag file {scan.path}: {error}"
            raise TraceError(msg) from error
        except (AttributeError, TypeError, ValueError) as error:
            msg = f"bag file {scan.path}: topic {channel.topic}: its messages are no {type_name} ({error})"
            raise TraceError(msg) from error

    def _add_architecture(self, said: Any) -> None:
        told = tuple(ComponentInfo.of_message(component) for component in said.components)
        self._architecture = with_known_policies(told, self._architecture)
        self._threads = getattr(said, "threads", None)
        if self._first_grids is None:  # later ones are told by the records themselves
            epoch_ns = int(said.epoch_ns)
            self._first_grids = {
                one.name: Deployment(0, epoch_ns, one.offset_ns, one.period_ns)
                for one in (self._architecture if epoch_ns else ())
            }

    def trace(self, files: list[Path]) -> Trace:
        if len(self._topics) != 1:
            found = " and ".join(sorted(self._topics)) or f"no topic of type {_BATCH_TYPE}"
            if not self._topics and self._all_topics:
                libraries = {file.library for file in self.files if file.library}
                by = f" (written by {', '.join(sorted(libraries))})" if libraries else ""
                others = [f"{topic} ({kind})" for topic, (kind, _) in sorted(self._all_topics.items())]
                found += f" but {', '.join(others[:3])}{by}"
            msg = f"bag {self._path}: expected the trace of one executor, found {found}"
            raise TraceError(msg)
        pairs = np.array([(one.monotonic_ns, one.realtime_ns) for one in self._batches], np.int64)
        pairs = pairs.reshape(-1, 2)
        pairs = pairs[np.argsort(pairs[:, 1], kind="stable")]
        records, losses = _per_component(self._batches, self._components)
        losses.pop(RULES, None)
        decided = records.pop(RULES, _NO_RECORDS)
        return Trace(
            records,
            self._names,
            losses,
            pairs,
            lambda topics: _messages(files, topics, pairs),
            architecture=self._architecture,
            threads=self._threads,
            first_grids=self._first_grids or {},
            files=tuple(self.files),
            topics=self._all_topics,
            ledger=self.ledger,
            deleted=(self.deleted,) if self.deleted is not None else (),
            kinds=self._kinds,
            decisions=traced_decisions(decided, self._names, self._kinds),
            shadow_reports=tuple(
                replace(one, time_ns=_monotonic_ns(one.time_ns, pairs)) for one in self._shadows
            ),
        )


class _Types:
    """What reads the messages of a bag, by the definitions in it."""

    def __init__(self) -> None:
        self._decoders: dict[tuple[str, bytes], Decoder] = {}

    def decoded(self, scan: "McapScan | SqliteScan", channel: Channel, data: bytes) -> Any:
        """Return a message as an object.

        Raises:
            TraceError: the definition or the message is not what it should be.

        """
        schema = scan.schemas.get(channel.schema_id)
        if schema is None or schema.encoding != "ros2msg" or channel.message_encoding != "cdr":
            msg = f"topic {channel.topic}: expected CDR with a ros2msg definition"
            raise TraceError(msg)
        key = (schema.name, schema.data)
        try:
            if key not in self._decoders:
                self._decoders[key] = Decoder(schema.name, schema.data.decode())
            return self._decoders[key].decode(data)
        except ValueError as error:
            msg = f"topic {channel.topic}: a message cannot be read as {schema.name} ({error})"
            raise TraceError(msg) from error


def _record_definition(scan: "McapScan | SqliteScan", channel: Channel) -> str:
    """Return the text of TraceRecord.msg in the definition of a topic of batches.

    Raises:
        TraceError: the bag's records are not those that this version reads.

    """
    schema = scan.schemas[channel.schema_id]
    part = _RECORD_PART.search(schema.data.decode(errors="replace"))
    text = part[1] if part else ""
    found = _FIELD.findall(text)
    if found != _RECORD_FIELDS:
        shown = ", ".join(" ".join(field) for field in found) or "no TraceRecord"
        expected = ", ".join(" ".join(field) for field in _RECORD_FIELDS)
        msg = (
            f"bag file {scan.path}: topic {channel.topic} was written by another version of mauve_rt "
            f"('{scan.library}'): expected records of {expected}; found {shown}; read it with that one"
        )
        raise TraceError(msg)
    return text


def _per_component(
    batches: Sequence[Batch], components: tuple[str, ...]
) -> tuple[dict[str, Records], dict[str, Loss]]:
    parts: dict[int, list[memoryview]] = {}
    for batch in batches:
        rows = np.frombuffer(batch.records, RECORD)
        numbers = rows["component"]
        cuts = [0, *(np.flatnonzero(numbers[1:] != numbers[:-1]) + 1).tolist(), len(rows)]
        for begin, end in pairwise(cuts):
            if end > begin:
                data = memoryview(batch.records)[begin * RECORD.itemsize : end * RECORD.itemsize]
                parts.setdefault(int(numbers[begin]), []).append(data)
    first = min(batches, key=lambda batch: batch.monotonic_ns)
    last = max(batches, key=lambda batch: batch.monotonic_ns)
    told = dict(enumerate(components))
    present = sorted({*told, *parts})  # one damaged number is no reason for 65,535 components
    records: dict[str, Records] = {}
    losses: dict[str, Loss] = {}
    for number in present:
        name = told.get(number, f"component {number}")
        rows = _in_order(np.frombuffer(bytearray().join(parts.pop(number, [])), RECORD))
        loss = _loss(rows, number, first, last)
        if name in records:  # removed and added again: the same component's next life
            rows = np.concatenate([records[name], rows])
            loss = losses[name].plus(loss)
        records[name], losses[name] = rows, loss
    return records, losses


def _in_order(rows: Records) -> Records:
    """Return the records by sequence number."""
    sequence = rows["sequence"]
    if np.all(sequence[1:] > sequence[:-1]):
        return rows
    return rows[np.argsort(sequence, kind="stable")]


def _loss(rows: Records, number: int, first: Batch, last: Batch) -> Loss:
    # A file that does not begin with the trace begins with a batch without records: what was before it.
    before = first if not len(first.records) else _NOTHING
    base_written, base_dropped = _of(before.written, number), _of(before.dropped, number)
    gaps = int(rows["sequence"][-1]) + 1 - base_written - len(rows) if len(rows) else 0
    return Loss(
        written=max(_of(last.written, number) - base_written, len(rows)),
        received=len(rows),
        dropped=_of(last.dropped, number) - base_dropped,
        gaps=max(gaps, 0),
    )


def _of(counts: Sequence[int], number: int) -> int:
    return counts[number] if number < len(counts) else 0


def _messages(files: list[Path], topics: tuple[str, ...], pairs: npt.NDArray[np.int64]) -> Iterator[Message]:
    """Yield decoded messages by log time."""
    types = _Types()
    waiting: list[tuple[int, int, Message]] = []
    count = 0
    for file in files:
        with _scan(file) as scan:
            for channel, message in scan.messages():
                type_name = scan.type_of(channel)
                if not ({channel.topic, type_name} & set(topics) if topics else type_name not in OWN_TYPES):
                    continue
                log_time_ns = message.log_time
                said = types.decoded(scan, channel, message.data)
                monotonic_ns = _monotonic_ns(message.publish_time, pairs)
                one = Message(channel.topic, log_time_ns, monotonic_ns, said)
                heapq.heappush(waiting, (log_time_ns, count, one))
                count += 1
                while waiting[0][0] < log_time_ns - _DISORDER_NS:
                    yield heapq.heappop(waiting)[-1]
    while waiting:
        yield heapq.heappop(waiting)[-1]


def _monotonic_ns(published_ns: int, pairs: npt.NDArray[np.int64]) -> int:
    """Undo the recorder's mapping: it used the pair of the drain that followed the message."""
    if not len(pairs):
        return published_ns
    index = min(int(np.searchsorted(pairs[:, 1], published_ns)), len(pairs) - 1)
    return published_ns - int(pairs[index, 1] - pairs[index, 0])
