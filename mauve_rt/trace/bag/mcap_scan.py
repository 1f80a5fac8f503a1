"""Reads an MCAP file from its begin to where it is whole; needs neither its end nor its summary.

So the bag of a process that was killed in the middle of a write, or that is still writing, is read up to
its last whole chunk.
"""

import os
import time
import zlib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, Self

from mauve_rt.trace.bag.mcap_columns import NO_MESSAGES, MessageColumns
from mauve_rt.trace.bag.mcap_file import MAGIC
from mauve_rt.trace.bag.mcap_library import (
    MESSAGE_BYTES,
    READ_OPCODES,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapError,
    McapRecord,
    Message,
    Metadata,
    Opcode,
    Schema,
    Statistics,
    read_message,
    read_record,
    split_records,
)
from mauve_rt.trace.bag.mcap_limits import MAX_DEFINITION_BYTES, McapLimits
from mauve_rt.trace.bag.metadata import CUSTOM_DATA
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.mcap_records import HEAD

_FOOTER_BYTES = HEAD.size + 20
_ATTEMPTS, _PAUSE_S = 3, 0.02  # a flush takes some hundred microseconds
_UNREADABLE = (McapError, ValueError, KeyError, IndexError, EOFError, OverflowError)
_DEFINITIONS = (int(Opcode.SCHEMA), int(Opcode.CHANNEL))
_MESSAGE = int(Opcode.MESSAGE)  # an enum is compared more slowly, and there are many


class Found(NamedTuple):
    """A record of the data section, and where it is."""

    offset: int
    end: int
    opcode: int
    record: McapRecord | None
    """None: one that nobody asks about, of an attachment or a later version of the format."""
    definitions: list[Schema | Channel]
    """Those of a chunk, or the record itself."""
    messages: MessageColumns
    """Likewise."""


@dataclass
class Told:
    """What the summary tells, by which other readers find their way."""

    damage: str = ""
    """Why it cannot be read; empty when it can."""
    statistics: Statistics | None = None
    chunk_indexes: list[ChunkIndex] = field(default_factory=list)


class McapScan:
    """One pass over a file. `header`, `schemas` and `channels` fill up as it goes."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            TraceError: it cannot be read, or is no MCAP file.

        """
        self.path = path
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.whole_bytes = 0
        """The file is whole up to here: behind the last whole record of the data section."""
        self.data_end: DataEnd | None = None
        """The record that ends the data, once the pass has come to it."""
        self.damage = ""
        """Why the pass ended early; empty when it did not."""
        self.custom_data: Mapping[str, str] = {}
        """What the last metadata record of CUSTOM_DATA tells, once the pass has come to it."""
        try:
            self._file = path.open("rb")
        except OSError as error:
            msg = f"bag file {path}: cannot be read ({error.strerror})"
            raise TraceError(msg) from error
        self._known_size = self.size
        self._limits = McapLimits(f"bag file {path}", self._known_size)
        try:
            self.header = self._read_header()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Self:
        """Return the pass itself: the file is open from its construction."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._file.close()

    @property
    def library(self) -> str:
        """What wrote the file, by its own words."""
        return str(self.header.library)

    @property
    def size(self) -> int:
        """Bytes of the file now."""
        return os.fstat(self._file.fileno()).st_size

    def found(self) -> Iterator[Found]:
        """Yield the records of the data section up to its end or the first damage; chunks fit their CRC.

        Raises:
            TraceError: what comes next would take more memory than its bytes justify, or than there is.

        """
        while self.data_end is None:
            offset = self.whole_bytes
            try:
                found = self._next(offset)
            except _UNREADABLE as error:
                self.damage = f"byte {offset:,}: {_reason(error)}"
                return
            except MemoryError as error:
                msg = f"bag file {self.path}: byte {offset:,}: there is not enough memory for what comes here"
                raise TraceError(msg) from error
            self.whole_bytes = found.end
            if isinstance(found.record, DataEnd):
                self.data_end = found.record
                self.whole_bytes = found.offset
            if isinstance(found.record, Metadata) and found.record.name == CUSTOM_DATA:
                self.custom_data = found.record.metadata
            for one in found.definitions:
                if isinstance(one, Schema):
                    self.schemas[one.id] = one
                else:
                    self.channels[one.id] = one
            yield found

    def messages(self) -> Iterator[tuple[Channel, Message]]:
        """Yield all messages in the order of the file.

        Raises:
            TraceError: as found().

        """
        for found in self.found():
            for message in found.messages.messages():
                yield self.channels[message.channel_id], message

    def type_of(self, channel: Channel) -> str:
        """Type of a channel's messages, package/msg/Name."""
        schema = self.schemas.get(channel.schema_id)
        return "" if schema is None else schema.name

    def summary(self) -> Told:
        """Read what stands behind the data section."""
        if self.data_end is None:
            return Told("the end is missing")
        size = self.size
        try:
            tail = os.pread(self._file.fileno(), size - self.whole_bytes, self.whole_bytes)
            if not tail.endswith(MAGIC):
                return Told("the closing magic bytes are missing")
            at = len(tail) - len(MAGIC) - _FOOTER_BYTES
            if tail[at] != Opcode.FOOTER:
                return Told("the footer is missing")
            footer = read_record(int(Opcode.FOOTER), tail[at + HEAD.size : -len(MAGIC)])
            assert isinstance(footer, Footer)  # noqa: S101 - for mypy
            begin = footer.summary_start - self.whole_bytes if footer.summary_start else at
            crc = zlib.crc32(tail[begin : at + _FOOTER_BYTES - 4])
            if footer.summary_crc not in (0, crc):
                return Told("the summary's CRC does not fit")
            return _told(tail[begin:at])
        except (*_UNREADABLE, OSError, MemoryError) as error:
            return Told(f"the summary cannot be read ({_reason(error)})")

    def _read_header(self) -> Header:
        if self._file.read(len(MAGIC)) != MAGIC:
            msg = f"bag file {self.path}: not an MCAP file (it does not begin with the magic bytes of one)"
            raise TraceError(msg)
        try:
            found = self._once(len(MAGIC))
        except _UNREADABLE as error:
            msg = f"bag file {self.path}: the MCAP header cannot be read ({_reason(error)})"
            raise TraceError(msg) from error
        if not isinstance(found.record, Header):
            msg = f"bag file {self.path}: expected an MCAP header, found opcode {found.opcode}"
            raise TraceError(msg)
        self.whole_bytes = found.end
        return found.record

    def _next(self, offset: int) -> Found:
        """Read the record there; again when it is not whole, for a recorder may be just writing it."""
        for _ in range(_ATTEMPTS - 1):
            try:
                return self._once(offset)
            except _UNREADABLE:
                time.sleep(_PAUSE_S)
        return self._once(offset)

    def _once(self, offset: int) -> Found:
        self._file.seek(offset)
        head = self._file.read(HEAD.size)
        if len(head) < HEAD.size:
            msg = "the file ends in the middle of a record"
            raise EOFError(msg)
        opcode, length = HEAD.unpack(head)
        end = offset + HEAD.size + length
        if end > self._known_size:
            self._known_size = self.size  # it may have grown
        if end > self._known_size:
            msg = f"a record of {length:,} bytes does not fit into the file's {self._known_size:,}"
            raise EOFError(msg)
        if opcode == 0:
            msg = "no record begins here"
            raise ValueError(msg)
        if opcode not in READ_OPCODES or (opcode == Opcode.METADATA and length > MAX_DEFINITION_BYTES):
            return Found(offset, end, opcode, None, [], NO_MESSAGES)
        data = self._file.read(length)
        if len(data) < length:
            msg = "the file became shorter"
            raise EOFError(msg)
        if opcode in _DEFINITIONS:
            self._limits.define(opcode, data[:2], length)
        record = read_record(opcode, data)
        if isinstance(record, Chunk):
            return self._chunk(offset, end, record)
        if isinstance(record, Message):
            self._check_channel(record.channel_id, self.channels)
            return Found(offset, end, opcode, record, [], MessageColumns.of_record(head + data))
        definitions = [record] if isinstance(record, Schema | Channel) else []
        return Found(offset, end, opcode, record, definitions, NO_MESSAGES)

    def _chunk(self, offset: int, end: int, chunk: Chunk) -> Found:
        """See that a chunk is what its head promises.

        Raises:
            ValueError: it is not.

        """
        data = self._limits.unpacked(chunk)
        crc = zlib.crc32(data)
        if chunk.uncompressed_crc not in (0, crc):
            msg = f"a chunk's CRC does not fit: expected {chunk.uncompressed_crc:08x}, found {crc:08x}"
            raise ValueError(msg)
        walk = _Walk(data, self._limits, most=self._limits.records_left(chunk))
        try:
            walk.run()
        finally:  # a message of an unknown channel comes before what ended the walk
            messages = MessageColumns.of_places(data, walk.places)
            self._check_channels(messages, walk.defined)
        self._limits.count(chunk, walk.count)
        return Found(offset, end, int(Opcode.CHUNK), chunk, walk.definitions, messages)

    def _check_channels(self, messages: MessageColumns, defined: Mapping[int, int]) -> None:
        """See that each channel is defined before its messages; `defined`: as of the chunk's _Walk."""
        for channel, first in messages.firsts.items():
            if channel not in self.channels and first < defined.get(channel, len(messages)):
                self._check_channel(channel, self.channels)

    @staticmethod
    def _check_channel(channel_id: int, channels: Collection[int]) -> None:
        if channel_id not in channels:
            msg = f"a message of channel {channel_id}, of which the file has not told before"
            raise McapError(msg)


class _Walk:
    """Over the records of a chunk, in their order."""

    def __init__(self, data: bytes, limits: McapLimits, *, most: int) -> None:
        self.places: list[int] = []
        """Where the records of messages begin."""
        self.definitions: list[Schema | Channel] = []
        self.defined: dict[int, int] = {}
        """Before how many messages each channel is defined first."""
        self.count = 0
        self._data = data
        self._limits = limits
        self._most = most

    def run(self) -> None:
        """Find all.

        Raises:
            McapError: a record is not whole.
            TraceError: there are more than is read.

        """
        # Not by split_records(): there are millions, and so a record takes 0.2 us in place of 0.5 us.
        data, most, note, unpack = self._data, self._most, self.places.append, HEAD.unpack_from
        head, size = HEAD.size, len(self._data)
        at, last, count = 0, size - head, 0
        while at <= last:
            opcode, length = unpack(data, at)
            begin = at + head
            stop = begin + length
            if stop > size:
                break
            count += 1
            if count > most:
                self._limits.refuse_records()
            if opcode == _MESSAGE:
                if length < MESSAGE_BYTES:
                    read_message(data, begin, stop)
                note(at)
            elif opcode in _DEFINITIONS:  # nothing else belongs here
                self._define(opcode, begin, stop)
            at = stop
        for _ in split_records(data[at:]):  # says why the last one is not whole
            pass
        self.count = count

    def _define(self, opcode: int, begin: int, stop: int) -> None:
        self._limits.define(opcode, self._data[begin : begin + 2], stop - begin)
        record = read_record(opcode, self._data[begin:stop])
        assert isinstance(record, Schema | Channel)  # noqa: S101 - for mypy
        if isinstance(record, Channel):
            self.defined.setdefault(record.id, len(self.places))
        self.definitions.append(record)


def _told(summary: bytes) -> Told:
    told = Told()
    for opcode, _, body, end in split_records(summary):
        record = read_record(opcode, summary[body:end]) if opcode in READ_OPCODES else None
        if isinstance(record, Statistics):
            told.statistics = record
        elif isinstance(record, ChunkIndex):
            told.chunk_indexes.append(record)
    return told


def _reason(error: BaseException) -> str:
    return str(error) or type(error).__name__
