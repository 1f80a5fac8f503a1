"""An MCAP file that is a finished one after every flush.

On disk, always:

    magic, Header | Chunk, MessageIndex..., Chunk, MessageIndex..., | Metadata..., DataEnd, summary,
    summary offsets, Footer, magic
                                                                      '------------------- the tail
                                                                      ----------------'

A flush turns the waiting messages into one chunk and writes it, followed by the new tail, over the old
tail, in one write. The file is complete before and after it; a process killed between two flushes leaves
all that was flushed. Inside of the write it takes a `KeptDisk`: Linux gives up a write between two pages
when its process is killed. A power loss costs what was written since the last fdatasync (`disk.py`), and the
tail: a repair writes a new one.

The tail can keep room for last words (`write_into_room`): a disk that is full, or a file that may not grow,
takes no more, but what is in the file already can be written over.

The summary is kept as bytes that only grow, so a flush costs the new messages plus the chunk indexes, never
the file. Format: https://mcap.dev/spec.
"""

import contextlib
import errno
import functools
import os
import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.counts import counted
from mauve_rt.trace.bag.compression import Compress, compressed
from mauve_rt.trace.bag.disk import METADATA, Disk, Metadata, MetadataError
from mauve_rt.trace.bag.recorded import ReceivedBatch
from mauve_rt.trace.errors import DiskError, TraceError
from mauve_rt.trace.format.mcap_chunk import Counts, PendingChunk
from mauve_rt.trace.format.mcap_records import Opcode, record, room
from mauve_rt.unfinished import discard

MAGIC = b"\x89MCAP0\r\n"


class McapFile:
    """Writes one MCAP file. For one thread at a time."""

    def __init__(
        self,
        path: Path,
        *,
        profile: str,
        library: str,
        disk: Disk | None = None,
        room_bytes: int = 0,
        compress: Compress | None = None,
    ) -> None:
        """Create the file, which is a complete empty one as soon as there is one of that name.

        `room_bytes`: kept in it for last words, until finish(); `compress`: each chunk, at its flush.

        Raises:
            DiskError: it exists already or cannot be written.

        """
        self.path = path
        self._schemas: list[bytes] = []
        self._channels: list[bytes] = []
        self._metadata: dict[str, dict[str, str]] = {}
        self._chunk = self._written = PendingChunk()
        self._chunk_indexes = bytearray()
        start = MAGIC + record(Opcode.HEADER, profile=profile, library=library)
        self._room_bytes = room_bytes
        self._compress = compress
        self._now = self._finished(Counts(), 0, len(start), zlib.crc32(start), room_bytes)
        self._before = self._now
        self._descriptor = -1
        self._is_lost = False
        self._lacks_end = False  # a flush failed, and what it wrote may still be in the file
        self._disk = disk or Disk()
        unfinished = path.with_name(f".{path.name}.new")
        try:
            if path.exists():
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
            flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC
            self._descriptor = os.open(unfinished, flags, 0o644)
            self._disk.write(self._descriptor, (start, self._now.tail), 0)
            unfinished.rename(path)
        except OSError as error:
            if self._descriptor >= 0:
                discard(unfinished)
            self.abort()
            msg = f"bag file {path}: cannot be created ({error.strerror})"
            raise DiskError(msg) from error

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._now.data_end + len(self._now.tail)

    @property
    def flushed(self) -> Counts:
        """What the file on disk holds now; nothing once it is lost."""
        return Counts() if self._is_lost else self._now.counts

    @property
    def is_waiting(self) -> bool:
        """Whether there are messages for the next flush."""
        return bool(self._chunk.counts.messages)

    def add_schema(self, name: str, *, encoding: str, data: bytes) -> int:
        """Declare a schema; returns its id."""
        schema_id = len(self._schemas) + 1
        schema = record(Opcode.SCHEMA, id=schema_id, data=data, encoding=encoding, name=name)
        self._schemas.append(schema)
        self._chunk.records += schema
        return schema_id

    def add_channel(self, topic: str, *, schema_id: int, encoding: str, metadata: dict[str, str]) -> int:
        """Declare a channel; returns its id."""
        channel_id = len(self._channels) + 1
        channel = record(
            Opcode.CHANNEL,
            id=channel_id,
            topic=topic,
            message_encoding=encoding,
            metadata=metadata,
            schema_id=schema_id,
        )
        self._channels.append(channel)
        self._chunk.records += channel
        return channel_id

    def set_metadata(self, name: str, fields: dict[str, str]) -> None:
        """Let the next flush that writes messages put a metadata record of that name into the file."""
        self._metadata[name] = dict(fields)

    def add_message(self, channel_id: int, log_time_ns: int, data: bytes, *, publish_time_ns: int) -> None:
        """Keep a message for the next flush. Times in ns of CLOCK_REALTIME."""
        self._chunk.add(channel_id, log_time_ns, data, publish_time_ns=publish_time_ns)

    def add_batch(
        self, batch: ReceivedBatch, channels: Sequence[int], *, ahead_ns: tuple[int, int], earliest_ns: int
    ) -> None:
        """Keep the messages of a batch for the next flush; `ahead_ns`: of log and of publish times."""
        packed = batch.pack(
            channels,
            log_ahead_ns=ahead_ns[0],
            publish_ahead_ns=ahead_ns[1],
            earliest_log_ns=earliest_ns,
            offset=len(self._chunk.records),
        )
        self._chunk.add_packed(*packed)

    def flush(self, *, metadata: Callable[[], Metadata] | None = None, sync: bool = False) -> None:
        """Write what waits, then the metadata.yaml that tells of it; the file is complete before and after.

        `sync`: all of it is on the disk afterwards.

        Schemas and channels wait for a message: a chunk without one has no message index, and where the first
        chunk has none, libmcap (rosbag2's reader) gives up the whole file.

        Raises:
            DiskError: the system refused, e.g. the disk is full. What was flushed before is still there
            and complete.
            TraceError: the file is no longer in its place: all of it is lost.

        """
        chunk, before = self._written, self._before = self._chunk, self._now
        parts = self._build(chunk, before) if self.is_waiting else ()
        if parts or metadata is not None or sync:
            text = None if metadata is None else metadata()
            self._write(parts, before.data_end, text, size=self._less_than(before), sync=sync)
        if parts:
            self._chunk = PendingChunk()
        self._check_place()

    def finish(self, *, metadata: Callable[[], Metadata] | None = None) -> None:
        """As flush(), for the last time: the file keeps no room, and is on the disk."""
        self._room_bytes = 0
        if self.is_waiting:
            self.flush(metadata=metadata, sync=True)
        elif self._now.room_bytes or metadata is not None:
            self._write_tail(0, metadata, sync=True)

    def write_into_room(self, metadata: Metadata) -> None:
        """Write what set_metadata() noted into the room that the end of the file keeps: it takes no other.

        Raises:
            DiskError: it does not fit, or the system refused; the file is as before.

        """
        room_bytes = self._now.room_bytes + len(self._now.tail) - len(self._tail_of_now())
        if room_bytes < 0:
            msg = f"bag file {self.path}: no room is left in it for last words, {-room_bytes} bytes too few"
            raise DiskError(msg)
        self._write_tail(room_bytes, lambda: metadata, sync=False)

    def drop_waiting(self) -> Counts:
        """Give up what waits for the next flush. Write no more messages then: topics are given up, too."""
        dropped, self._chunk = self._chunk.counts, PendingChunk()
        del self._schemas[self._now.schema_count :], self._channels[self._now.channel_count :]
        return dropped

    def _tail_of_now(self) -> bytes:
        now = self._now
        room = now.room_bytes
        return self._finished(now.counts, now.chunk_count, now.data_end, now.data_crc, room).tail

    def _write_tail(self, room_bytes: int, metadata: Callable[[], Metadata] | None, *, sync: bool) -> None:
        now, self._written = self._now, self._chunk
        self._before = now
        self._now = self._finished(now.counts, now.chunk_count, now.data_end, now.data_crc, room_bytes)
        text = None if metadata is None else metadata()
        self._write((self._now.tail,), now.data_end, text, size=self._less_than(now), sync=sync)
        self._check_place()

    def _less_than(self, before: "_Finished") -> int | None:
        """The size that the file is cut to, where it is, or may be, less than it was."""
        return self.size if self._lacks_end or self.size < before.data_end + len(before.tail) else None

    def _build(self, chunk: PendingChunk, before: "_Finished") -> Sequence[bytes | bytearray]:
        """Let `_now` be the file with that chunk; returns what is to be written behind its data."""
        compression, data = compressed(chunk.records, self._compress)
        parts, index = chunk.build(before.data_end, data, compression)
        self._chunk_indexes += index
        self._now = self._finished(
            before.counts.plus(chunk.counts),
            before.chunk_count + 1,
            before.data_end + sum(map(len, parts)),
            functools.reduce(lambda crc, part: zlib.crc32(part, crc), parts, before.data_crc),
            self._room_bytes,
        )
        return (*parts, self._now.tail)

    def _write(
        self,
        parts: Sequence[bytes | bytearray],
        offset: int,
        metadata: Metadata | None,
        *,
        size: int | None,
        sync: bool,
    ) -> None:
        try:
            self._disk.write(self._descriptor, parts, offset, size=size, metadata=metadata, sync=sync)
        except MetadataError as error:
            what = f"bag {self.path.parent}: {METADATA} cannot be written ({error.strerror})"
            raise DiskError(f"{what}; {self.undo_flush()}") from error
        except OSError as error:
            msg = f"bag file {self.path}: writing failed ({error.strerror}); {self.undo_flush()}"
            raise DiskError(msg) from error
        self._lacks_end = False

    def _check_place(self) -> None:
        """The system lets a file be written that has no name any longer."""
        try:
            self._is_lost = not os.path.samestat(self.path.stat(), os.fstat(self._descriptor))
        except FileNotFoundError:
            self._is_lost = True
        except OSError:  # not known
            return
        if self._is_lost:
            lost = counted(self._now.counts.messages, "message")
            msg = f"bag file {self.path}: deleted or replaced while it was recorded; {lost} of it lost"
            raise TraceError(msg)

    def undo_flush(self) -> str:
        """Make the file what it was before the last flush, or attempt at one; says what came of it.

        What was flushed waits again. It needs no room on the disk: the old end's blocks are there already.
        """
        self._now, self._chunk = self._before, self._written
        del self._chunk_indexes[self._now.index_bytes :]
        self._lacks_end = True
        try:
            self.put_back()
        except DiskError as error:
            return f"{error}: the file needs repair"
        return f"the file is complete up to the flush before, {counted(self.flushed.messages, 'message')}"

    def put_back(self) -> None:
        """Write the old end, where a flush that failed may have left another one.

        Raises:
            DiskError: the system refused.

        """
        if not self._lacks_end:
            return
        try:
            self._disk.write(self._descriptor, (self._now.tail,), self._now.data_end, size=self.size)
        except OSError as error:
            msg = f"the old end could not be put back either ({error.strerror})"
            raise DiskError(msg) from error
        self._lacks_end = False

    def close(self) -> None:
        """Finish and close.

        Raises:
            TraceError: as flush; the file is closed all the same.

        """
        try:
            self.finish()
        finally:
            self.abort()

    def abort(self) -> None:
        """Close without writing what waits; the file stays as the last flush left it. May be called again."""
        if self._descriptor >= 0:
            with contextlib.suppress(DiskError):
                self.put_back()
            os.close(self._descriptor)
            self._descriptor = -1

    def _finished(
        self, counts: Counts, chunk_count: int, data_end: int, data_crc: int, room_bytes: int
    ) -> "_Finished":
        summary = Summary(self._schemas, self._channels, counts, chunk_count, bytes(self._chunk_indexes))
        kept = room(room_bytes)
        tail = build_tail(summary, data_end=data_end, data_crc=data_crc, metadata=self._metadata, kept=kept)
        indexed, schemas, channels = len(self._chunk_indexes), len(self._schemas), len(self._channels)
        return _Finished(counts, chunk_count, data_end, data_crc, indexed, schemas, channels, len(kept), tail)


class _Finished(NamedTuple):
    """The file as a flush left it."""

    counts: Counts
    chunk_count: int
    data_end: int
    data_crc: int
    index_bytes: int
    """Of `_chunk_indexes`."""
    schema_count: int
    channel_count: int
    room_bytes: int
    """Of `tail`."""
    tail: bytes


class Summary(NamedTuple):
    """What the end of a file tells of its data section."""

    schemas: Sequence[bytes]
    """Their records; so with the channels."""
    channels: Sequence[bytes]
    counts: Counts
    chunk_count: int
    chunk_indexes: bytes
    """ChunkIndex records, one behind the other."""
    attachment_count: int = 0
    metadata_count: int = 0
    """Records that stand before the end of the data section."""


def build_tail(
    summary: Summary,
    *,
    data_end: int,
    data_crc: int,
    metadata: Mapping[str, Mapping[str, str]] | None = None,
    kept: bytes = b"",
) -> bytes:
    """Return what closes a file whose data section ends at byte `data_end`; CRC 0: not known.

    `metadata`: records, by name, that it begins with; `kept`: the record behind them.
    """
    told = [record(Opcode.METADATA, name=name, metadata=fields) for name, fields in (metadata or {}).items()]
    indexes = b""
    for name, one in zip(metadata or (), told, strict=True):
        indexes += record(Opcode.METADATA_INDEX, offset=data_end, length=len(one), name=name)
        data_end += len(one)
        data_crc = data_crc and zlib.crc32(one, data_crc)
    data_end += len(kept)
    data_crc = data_crc and zlib.crc32(kept, data_crc)
    end = record(Opcode.DATA_END, data_section_crc=data_crc)
    statistics = record(
        Opcode.STATISTICS,
        attachment_count=summary.attachment_count,
        channel_count=len(summary.channels),
        channel_message_counts=summary.counts.by_channel,
        chunk_count=summary.chunk_count,
        message_count=summary.counts.messages,
        message_end_time=summary.counts.end_ns,
        message_start_time=summary.counts.start_ns,
        metadata_count=summary.metadata_count + len(told),
        schema_count=len(summary.schemas),
    )
    groups = (
        (Opcode.SCHEMA, b"".join(summary.schemas)),
        (Opcode.CHANNEL, b"".join(summary.channels)),
        (Opcode.STATISTICS, statistics),
        (Opcode.CHUNK_INDEX, summary.chunk_indexes),
        (Opcode.METADATA_INDEX, indexes),
    )
    at = summary_start = data_end + len(end)
    offsets = []
    for opcode, group in groups:
        if group:
            place = record(
                Opcode.SUMMARY_OFFSET, group_opcode=opcode, group_start=at, group_length=len(group)
            )
            offsets.append(place)
        at += len(group)
    body = b"".join((*(group for _, group in groups), *offsets))
    footer = record(Opcode.FOOTER, summary_start=summary_start, summary_offset_start=at, summary_crc=0)[:-4]
    crc = zlib.crc32(footer, zlib.crc32(body))
    return b"".join((*told, kept, end, body, footer, struct.pack("<I", crc), MAGIC))
