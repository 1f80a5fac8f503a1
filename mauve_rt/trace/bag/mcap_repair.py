"""Tells whether an MCAP file is one that every reader reads, and makes one of it.

Readers that go by the summary (rosbag2's libmcap, mcap, rosbags) ask this of it: its CRC fits; its statistics
count what the chunks hold; it has an index of each chunk that holds messages, with the place of a message
index for each of their channels, and of no chunk without messages. libmcap gives up a file whose first chunk
index has no message index, and says so only in its log.
"""

import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from mauve_rt.trace.bag.disk import Disk
from mauve_rt.trace.bag.mcap_file import Summary, build_tail
from mauve_rt.trace.bag.mcap_library import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    MessageIndex,
    Opcode,
    Schema,
    serialized,
)
from mauve_rt.trace.bag.mcap_scan import Found, McapScan, Told
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.mcap_chunk import Counts
from mauve_rt.trace.progress import Progress, silent

_BLOCK_BYTES = 1 << 20


Entries = dict[int, list[tuple[int, int]]]
"""Per channel: log time of each message, and its offset in the chunk."""


class _ChunkSeen:
    """A chunk of the data section, and the message indexes behind it."""

    def __init__(self, found: Found, chunk: Chunk) -> None:
        self._found = found
        self.indexed: Entries = {}
        """As the indexes tell."""
        self.is_followed = False
        """By anything but its indexes."""
        self.end = found.end
        self._index = ChunkIndex(
            chunk_length=found.end - found.offset,
            chunk_start_offset=found.offset,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            message_end_time=chunk.message_end_time,
            message_index_length=0,
            message_index_offsets={},
            message_start_time=chunk.message_start_time,
            uncompressed_size=chunk.uncompressed_size,
        )

    def messages(self) -> Entries:
        """As the chunk itself tells."""
        found = self._found.messages
        log_times = found.heads["log_time_ns"]
        entries: Entries = {}
        for channel in found.firsts:
            rows = found.of_channel(channel)
            entries[channel] = list(zip(log_times[rows].tolist(), found.at[rows].tolist(), strict=True))
        return entries

    def add_index(self, offset: int, end: int, index: MessageIndex) -> None:
        """Take note of a message index behind it."""
        self.indexed[index.channel_id] = index.records
        self._index.message_index_offsets[index.channel_id] = offset
        self._index.message_index_length = end - self.end

    def is_indexed(self) -> bool:
        """Whether the indexes behind it are those of this chunk."""
        return _sorted(self.indexed) == _sorted(self.messages())

    def index_again(self) -> bytes:
        """Return message indexes to be written right behind it."""
        self._index.message_index_offsets = {}
        out = b""
        for channel, entries in self.messages().items():
            self._index.message_index_offsets[channel] = self.end + len(out)
            out += serialized(MessageIndex(channel, entries))
        self._index.message_index_length = len(out)
        return out

    def entry(self) -> ChunkIndex | None:
        """Return its record in the summary; None: it has no place there, as it holds no message."""
        return self._index if len(self._found.messages) else None


class _Chunks:
    """All chunks of a data section."""

    def __init__(self) -> None:
        self.last: _ChunkSeen | None = None
        self._before: list[ChunkIndex] = []  # of those before the last one

    def note(self, found: Found) -> None:
        """Take note of the next record of the data section."""
        record = found.record
        if isinstance(record, Chunk):
            self._before = self.entries()
            self.last = _ChunkSeen(found, record)
        elif self.last is not None and isinstance(record, MessageIndex):
            self.last.add_index(found.offset, found.end, record)
        elif self.last is not None and not isinstance(record, DataEnd):
            self.last.is_followed = True

    def entries(self) -> list[ChunkIndex]:
        """Their records in the summary."""
        if self.last is not None and (entry := self.last.entry()) is not None:
            self._before.append(entry)
        self.last = None
        return self._before


@dataclass
class FileState:
    """What a pass over a file found."""

    path: Path
    library: str
    damage: str
    """Why it is no finished file; empty when it is one."""
    size: int
    whole_bytes: int
    """Bytes of the data section that are whole."""
    is_closed: bool
    """Whether it has an end that can be read; if there is damage, that end does not tell the truth."""
    is_data_whole: bool
    """Whether that is all of the data section: only what closes the file is missing or damaged."""
    schemas: list[Schema]
    channels: list[Channel]
    counts: Counts
    is_in_order: bool
    """Whether its chunks are in order of log time."""
    custom_data: Mapping[str, str]
    """What its last metadata record of CUSTOM_DATA tells."""
    _chunk_indexes: list[ChunkIndex]
    _chunk_count: int
    _missing_indexes: bytes
    """What has to be written behind the last chunk."""
    _attachments: int
    _metadata: int

    @property
    def is_finished(self) -> bool:
        """Whether every reader opens it."""
        return not self.damage

    @property
    def left_out_bytes(self) -> int:
        """Bytes that a repair cuts off, but for the file's old end."""
        return max(self.size - self.whole_bytes, 0)

    def repair(self) -> None:
        """Write what closes the file behind what is whole of it.

        Raises:
            TraceError: it cannot be written.

        """
        try:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CLOEXEC)
            try:
                crc = _crc(descriptor, self.whole_bytes)
                data_end = self.whole_bytes + len(self._missing_indexes)
                summary = Summary(
                    [serialized(one) for one in self.schemas],
                    [serialized(one) for one in self.channels],
                    self.counts,
                    self._chunk_count,
                    serialized(*self._chunk_indexes),
                    self._attachments,
                    self._metadata,
                )
                crc = zlib.crc32(self._missing_indexes, crc)
                tail = self._missing_indexes + build_tail(summary, data_end=data_end, data_crc=crc)
                size = self.whole_bytes + len(tail)
                Disk().write(descriptor, (tail,), self.whole_bytes, size=size, sync=True)
            finally:
                os.close(descriptor)
        except OSError as error:
            msg = f"bag file {self.path}: cannot be repaired ({error.strerror}); it is damaged still"
            raise TraceError(msg) from error


def examine(path: Path, *, progress: Progress = silent) -> FileState:
    """Read a whole file, and tell what is wrong with it.

    Raises:
        TraceError: it cannot be read, or is no MCAP file.

    """
    counts = Counts()
    chunks = _Chunks()
    chunk_count = 0
    others = {int(Opcode.ATTACHMENT): 0, int(Opcode.METADATA): 0}
    with McapScan(path) as scan:
        for found in scan.found():
            record = found.record
            chunks.note(found)
            chunk_count += isinstance(record, Chunk)
            if found.opcode in others:
                others[found.opcode] += 1
            if len(found.messages):
                times = found.messages.heads["log_time_ns"]
                start_ns, end_ns = int(times.min()), int(times.max())
                for channel, count in found.messages.counts().items():
                    counts.add_many(channel, count, start_ns=start_ns, end_ns=end_ns)
            progress(scan.whole_bytes / max(scan.size, 1), "examining")
        told = scan.summary()
        whole_bytes, missing = scan.whole_bytes, b""
        last = chunks.last
        is_last_torn = last is not None and not last.is_followed and not last.is_indexed()
        if last is not None and is_last_torn and (scan.damage or told.damage):
            whole_bytes, missing = last.end, last.index_again()
        entries = chunks.entries()
        damage = scan.damage or told.damage or _untrue(told, counts, entries)
        return FileState(
            path=path,
            library=scan.library,
            damage=damage,
            size=scan.size,
            whole_bytes=whole_bytes,
            is_closed=not (scan.damage or told.damage),
            is_data_whole=scan.data_end is not None,
            schemas=list(scan.schemas.values()),
            channels=list(scan.channels.values()),
            counts=counts,
            is_in_order=all(
                one.message_start_time <= other.message_start_time for one, other in pairwise(entries)
            ),
            custom_data=scan.custom_data,
            _chunk_indexes=entries,
            _chunk_count=chunk_count,
            _missing_indexes=missing,
            _attachments=others[int(Opcode.ATTACHMENT)],
            _metadata=others[int(Opcode.METADATA)],
        )


def _untrue(told: Told, counts: Counts, entries: list[ChunkIndex]) -> str:
    """Say what the summary tells other than the data section; empty where it tells the same."""
    statistics = told.statistics
    if statistics is None:
        return "the summary has no statistics"
    expected = (counts.messages, counts.by_channel, counts.start_ns, counts.end_ns)
    by_channel = {channel: count for channel, count in statistics.channel_message_counts.items() if count}
    times = (statistics.message_start_time, statistics.message_end_time)
    if (statistics.message_count, by_channel, *times) != expected:
        return f"its statistics tell of {statistics.message_count:,} messages other than those there are"
    places = {one.chunk_start_offset for one in entries}
    for one in told.chunk_indexes:
        if one.chunk_start_offset not in places:
            where = f"the chunk at byte {one.chunk_start_offset:,}"
            return f"{where} holds no message: rosbag2 reads nothing of a file that begins with such a chunk"
    if sorted(told.chunk_indexes, key=lambda one: one.chunk_start_offset) != entries:
        return "the summary's indexes are not those of its chunks"
    return ""


def _sorted(entries: Entries) -> Entries:
    return {channel: sorted(found) for channel, found in entries.items() if found}


def _crc(descriptor: int, size: int) -> int:
    """Return the CRC of a file's first bytes."""
    crc = at = 0
    while at < size:
        block = os.pread(descriptor, min(_BLOCK_BYTES, size - at), at)
        if not block:
            break
        crc = zlib.crc32(block, crc)
        at += len(block)
    return crc
