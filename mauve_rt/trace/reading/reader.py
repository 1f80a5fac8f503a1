"""Reads a recorded trace back by the definitions stored in the bag; needs no message package.

Files are read from their begin and not by their summary, so that the bag of a recorder that runs, or that was
killed, gives all it has. Of metadata.yaml only the names of the files count: what they hold is never older.
"""

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mauve_rt.trace.bag.deletion import Deleted, deleted_of
from mauve_rt.trace.bag.files import bag_files
from mauve_rt.trace.bag.mcap_library import Channel
from mauve_rt.trace.bag.mcap_scan import McapScan
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.cdr import decode_batch
from mauve_rt.trace.format.kinds import RecordKind, kinds_told
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.architecture import ComponentInfo, with_known_policies
from mauve_rt.trace.reading.decisions import RULES, traced_decisions
from mauve_rt.trace.reading.facts import OWN_TYPES, BagFile, Deployment
from mauve_rt.trace.reading.messages import MessageTypes, messages, monotonic_ns, payloads
from mauve_rt.trace.reading.records_read import NO_RECORDS, RecordsRead
from mauve_rt.trace.reading.shadows import SHADOW_TYPE, Shadow
from mauve_rt.trace.reading.stored_messages import MessagesOf, StoredMessages, scan_of
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.ledger import Entry, ledger_of

if TYPE_CHECKING:
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan

_BATCH_TYPE, _NAMES_TYPE, _ARCHITECTURE_TYPE = OWN_TYPES
_READ_TYPES = frozenset({*OWN_TYPES, SHADOW_TYPE})
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
    done, total = 0, max(sum(sizes.values()), 1)
    for file, size in sizes.items():
        if len(sizes) > 1 and not file.exists():  # deleted since, for the size of the bag
            continue
        stored = StoredMessages(file)
        with scan_of(file) as scan:
            for counts, messages_of in stored.first_pass(scan):
                content.add(scan, counts, messages_of)
                progress((done + scan.whole_bytes) / total, "reading")
            content.ledger = ledger_of(scan.custom_data) or content.ledger
            content.deleted = deleted_of(scan.custom_data) or content.deleted
            content.files.append(BagFile(file, scan.library, scan.whole_bytes, scan.damage))
        content.stored.append(stored)
        done += size
    return content.trace()


def _size(file: Path) -> int:
    try:
        return file.stat().st_size
    except FileNotFoundError:  # the recorder has just deleted it: the bag has a limit of size
        return 0


class _Content:
    """What was read of a bag, message by message."""

    def __init__(self, path: Path) -> None:
        self.files: list[BagFile] = []
        self.stored: list[StoredMessages] = []
        self.ledger: dict[str, Entry] = {}  # as the last file tells
        self.deleted: Deleted | None = None  # likewise
        self._path = path
        self._topics: set[str] = set()
        self._all_topics: dict[str, tuple[str, int]] = {}
        self._records = RecordsRead()
        self._components: tuple[str, ...] = ()
        self._names: tuple[str, ...] = ()
        self._architecture: tuple[ComponentInfo, ...] = ()
        self._threads: Any = None
        self._first_grids: dict[str, Deployment] | None = None
        self._known: set[tuple[Path, int]] = set()
        self._types = MessageTypes()
        self._kinds: dict[int, RecordKind] = {}
        self._shadows: list[Shadow] = []  # with times of CLOCK_REALTIME

    def add(self, scan: "McapScan | SqliteScan", counts: Mapping[int, int], messages_of: MessagesOf) -> None:
        own: dict[int, tuple[Channel, str]] = {}
        for number, count in counts.items():
            channel = scan.channels[number]
            type_name = scan.type_of(channel)
            before = self._all_topics.get(channel.topic, ("", 0))[1]
            self._all_topics[channel.topic] = (type_name, before + count)
            if type_name in _READ_TYPES:
                own[number] = (channel, type_name)
        if own:
            for message in messages_of(own):
                self._add_own(scan, *own[message.channel_id], message.data, published_ns=message.publish_time)

    def _add_own(
        self,
        scan: "McapScan | SqliteScan",
        channel: Channel,
        type_name: str,
        data: bytes,
        *,
        published_ns: int,
    ) -> None:
        if (scan.path, channel.id) not in self._known:
            self._known.add((scan.path, channel.id))
            if type_name == _BATCH_TYPE:
                self._kinds.update(kinds_told(_record_definition(scan, channel)))
        schema = scan.schemas.get(channel.schema_id)
        try:
            # Not by rosbags: it makes an object of each record, in 1.0 us; here a record takes 0.002 us.
            if type_name == _BATCH_TYPE:
                self._topics.add(channel.topic)
                self._records.add(decode_batch(data))
            elif type_name == _NAMES_TYPE:
                said = self._types.decoded(channel, schema, data)
                self._components, self._names = tuple(said.components), tuple(said.names)
            elif type_name == SHADOW_TYPE:
                said = self._types.decoded(channel, schema, data)
                self._shadows.append(Shadow.of_message(said, published_ns))
            else:
                self._add_architecture(self._types.decoded(channel, schema, data))
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

    def trace(self) -> Trace:
        if len(self._topics) != 1:
            found = " and ".join(sorted(self._topics)) or f"no topic of type {_BATCH_TYPE}"
            if not self._topics and self._all_topics:
                libraries = {file.library for file in self.files if file.library}
                by = f" (written by {', '.join(sorted(libraries))})" if libraries else ""
                others = [f"{topic} ({kind})" for topic, (kind, _) in sorted(self._all_topics.items())]
                found += f" but {', '.join(others[:3])}{by}"
            msg = f"bag {self._path}: expected the trace of one executor, found {found}"
            raise TraceError(msg)
        pairs = self._records.clock_pairs()
        records, losses = self._records.per_component(self._components)
        losses.pop(RULES, None)
        decided = records.pop(RULES, NO_RECORDS)
        return Trace(
            records,
            self._names,
            losses,
            pairs,
            lambda topics: messages(self.stored, topics, pairs),
            payload_source=lambda topics: payloads(self.stored, topics, pairs),
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
                replace(one, time_ns=monotonic_ns(one.time_ns, pairs)) for one in self._shadows
            ),
        )


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
