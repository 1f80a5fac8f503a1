"""Messages of one file of a bag as bytes. A pass leaves out the chunks that hold none of the wanted topics.

The first pass over a file notes which chunk holds which channels. Later passes read only the chunks that they
need: a report asks for topics with some ten messages in a file of some hundred megabytes.
"""

import functools
import os
import struct
from array import array
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.bag.files import MCAP
from mauve_rt.trace.bag.mcap_columns import Integers, MessageColumns, rows_at
from mauve_rt.trace.bag.mcap_library import Channel, Chunk, McapError, Message, Opcode, Schema, read_record
from mauve_rt.trace.bag.mcap_limits import McapLimits
from mauve_rt.trace.bag.mcap_scan import Found, McapScan
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.mcap_records import HEAD

if TYPE_CHECKING:
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan

IsWanted = Callable[[str, str], bool]
"""Of a topic and its type."""
MessagesOf = Callable[[Collection[int]], Iterator[Message]]
"""Of the channels with these numbers."""

_RECORD = struct.Struct("<BQHIQQ")  # opcode, length; of a message: channel, sequence, log time, publish time
_CHUNK, _MESSAGE = int(Opcode.CHUNK), int(Opcode.MESSAGE)
_BLOCK_BYTES = 16 << 20
_OBJECT_BYTES = 100  # what a message costs besides its own bytes, about
_RUN_BYTES = 1 << 20  # messages outside of chunks are read together, about so many bytes at once


class StoredMessage(NamedTuple):
    """A message as the file has it. Times in ns of CLOCK_REALTIME."""

    channel: Channel
    schema: Schema | None
    log_time_ns: int
    published_ns: int
    data: bytes


class PackedData(NamedTuple):
    """Payloads of messages, as places in one buffer."""

    buffer: bytes
    begins: Integers
    sizes: Integers

    def __len__(self) -> int:
        """How many there are."""
        return len(self.begins)

    def one(self, index: int) -> bytes:
        """Return the bytes of one of them."""
        begin = int(self.begins[index])
        return self.buffer[begin : begin + int(self.sizes[index])]

    def together(self, indices: Integers) -> npt.NDArray[np.uint8]:
        """Return some, all of one size, as an array of a row each."""
        return rows_at(self.buffer, self.begins[indices], int(self.sizes[indices[0]]))


class MessageBlock(NamedTuple):
    """Messages of one channel, in the order of the file. Times in ns of CLOCK_REALTIME, without a sign."""

    channel: Channel
    schema: Schema | None
    log_time_ns: npt.NDArray[np.uint64]
    published_ns: npt.NDArray[np.uint64]
    data: PackedData


def scan_of(file: Path) -> "McapScan | SqliteScan":
    """Open a file for one pass from its begin."""
    if file.suffix == MCAP:
        return McapScan(file)
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan  # noqa: PLC0415 - 50 ms, and seldom needed

    return SqliteScan(file)


class StoredMessages:
    """What the first pass over a file found, and the later passes, which read no more than the first."""

    def __init__(self, path: Path) -> None:
        """Know nothing yet."""
        self._path = path
        self._ends: list[tuple[int, int, bool]] = []  # begin, end, whether a chunk
        self._of_channel: dict[int, array[int]] = {}  # indices into _ends, in order
        self._defined: dict[tuple[type, int], Schema | Channel] = {}
        self._needs_scan = path.suffix != MCAP

    def first_pass(self, scan: "McapScan | SqliteScan") -> Iterator[tuple[Mapping[int, int], MessagesOf]]:
        """Yield how many messages each channel has, some at a time, and what returns these messages.

        Raises:
            TraceError: the file cannot be read.

        """
        if isinstance(scan, McapScan):
            for found in scan.found():
                self._define(found.definitions)
                counts = found.messages.counts()
                if counts:
                    self._note(found, counts)
                    yield counts, found.messages.messages
        else:
            for _, message in scan.messages():
                yield {message.channel_id: 1}, functools.partial(_only, message)

    def messages(self, is_wanted: IsWanted) -> Iterator[StoredMessage]:
        """Yield the messages whose topic and type are wanted, in the order of the file.

        Raises:
            TraceError: the file cannot be read.

        """
        wanted = self._wanted(is_wanted)
        if wanted is None:
            yield from _scanned(self._path, is_wanted)
            return
        for data in self._pieces(wanted):
            at, size = 0, len(data)
            while at + _RECORD.size <= size:  # a shorter record is no message
                opcode, length, number, _, log_time_ns, published_ns = _RECORD.unpack_from(data, at)
                end = at + HEAD.size + length
                if opcode == _MESSAGE and number in wanted:
                    payload = data[at + _RECORD.size : end]
                    yield StoredMessage(*wanted[number], log_time_ns, published_ns, payload)
                at = end

    def blocks(self, is_wanted: IsWanted) -> Iterator[MessageBlock]:
        """Yield the wanted messages in blocks of one channel each, made of some megabytes of the file.

        Raises:
            TraceError: the file cannot be read.

        """
        wanted = self._wanted(is_wanted)
        if wanted is None:
            yield from _blocks_of(_scanned(self._path, is_wanted))
            return
        for data in _joined(self._pieces(wanted)):
            found = _columns_of(data)
            begins, sizes = found.begins, found.sizes
            for number in sorted(found.firsts):
                if number in wanted:
                    rows = found.of_channel(number)
                    yield MessageBlock(
                        *wanted[number],
                        found.heads["log_time_ns"][rows],
                        found.heads["published_ns"][rows],
                        PackedData(data, begins[rows], sizes[rows]),
                    )

    def _wanted(self, is_wanted: IsWanted) -> dict[int, tuple[Channel, Schema | None]] | None:
        """Return the channels that are wanted, by number; None where only a pass over the file tells."""
        if self._needs_scan:
            return None
        schemas = {number: one for (_, number), one in self._defined.items() if isinstance(one, Schema)}
        channels = [one for one in self._defined.values() if isinstance(one, Channel)]
        described = {one.id: (one, schemas.get(one.schema_id)) for one in channels}
        return {
            number: (channel, schema)
            for number, (channel, schema) in described.items()
            if is_wanted(channel.topic, "" if schema is None else schema.name)
        }

    def _define(self, definitions: Iterable[Schema | Channel]) -> None:
        for one in definitions:
            if self._defined.setdefault((type(one), one.id), one) != one:
                self._needs_scan = True  # a number with two meanings: only a pass in order knows which

    def _note(self, found: Found, channels: Collection[int]) -> None:
        """Keep where a record of the data section is, and whose messages it holds."""
        is_chunk = found.opcode == _CHUNK
        begin, end, was_chunk = self._ends[-1] if self._ends else (0, 0, True)
        if is_chunk or was_chunk or end - begin >= _RUN_BYTES:
            self._ends.append((found.offset, found.end, is_chunk))
        else:
            self._ends[-1] = (begin, found.end, False)
        at = len(self._ends) - 1
        for number in channels:
            places = self._of_channel.setdefault(number, array("Q"))
            if not places or places[-1] != at:
                places.append(at)

    def _pieces(self, channels: Collection[int]) -> Iterator[bytes]:
        """Yield the parts of the file that hold these channels: records, other channels' too."""
        places = sorted({*chain.from_iterable(self._of_channel.get(number, ()) for number in channels)})
        if not places:
            return
        limits = McapLimits(f"bag file {self._path}", self._ends[-1][1])
        try:
            with self._path.open("rb") as file:
                for begin, end, is_chunk in (self._ends[at] for at in places):
                    data = os.pread(file.fileno(), end - begin, begin)
                    if len(data) < end - begin:
                        msg = f"bag file {self._path}: byte {begin:,}: the file became shorter"
                        raise TraceError(msg)
                    if is_chunk:
                        chunk = read_record(_CHUNK, data[HEAD.size :])
                        assert isinstance(chunk, Chunk)  # noqa: S101 - for mypy
                        data = limits.unpacked(chunk)
                    yield data
        except OSError as error:
            msg = f"bag file {self._path}: cannot be read ({error.strerror})"
            raise TraceError(msg) from error
        except (McapError, ValueError) as error:
            msg = f"bag file {self._path}: the file changed while it was read ({error})"
            raise TraceError(msg) from error


def _joined(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """Yield several of them as one."""
    waiting: list[bytes] = []
    size = 0
    for piece in pieces:
        waiting.append(piece)
        size += len(piece)
        if size > _BLOCK_BYTES:
            yield b"".join(waiting)
            waiting, size = [], 0
    yield b"".join(waiting)


def _columns_of(data: bytes) -> MessageColumns:
    """Return the messages among these records."""
    places: list[int] = []
    at, size = 0, len(data)
    while at + _RECORD.size <= size:
        opcode, length = HEAD.unpack_from(data, at)
        if opcode == _MESSAGE:
            places.append(at)
        at += HEAD.size + length
    return MessageColumns.of_places(data, places)


def _blocks_of(messages: Iterator[StoredMessage]) -> Iterator[MessageBlock]:
    waiting: dict[tuple[str, int], list[StoredMessage]] = {}
    size = 0
    for one in messages:
        waiting.setdefault((one.channel.topic, one.channel.id), []).append(one)
        size += len(one.data) + _OBJECT_BYTES
        if size > _BLOCK_BYTES:
            yield from map(_block_of, waiting.values())
            waiting, size = {}, 0
    yield from map(_block_of, waiting.values())


def _block_of(found: list[StoredMessage]) -> MessageBlock:
    sizes = np.array([len(one.data) for one in found], np.int64)
    return MessageBlock(
        found[0].channel,
        found[0].schema,
        np.array([one.log_time_ns for one in found], np.uint64),
        np.array([one.published_ns for one in found], np.uint64),
        PackedData(b"".join(one.data for one in found), np.cumsum(sizes) - sizes, sizes),
    )


def _only(message: Message, _channels: Collection[int]) -> Iterator[Message]:
    yield message


def _scanned(path: Path, is_wanted: IsWanted) -> Iterator[StoredMessage]:
    """Yield the wanted messages by a pass over the whole file."""
    with scan_of(path) as scan:
        for channel, message in scan.messages():
            if is_wanted(channel.topic, scan.type_of(channel)):
                schema = scan.schemas.get(channel.schema_id)
                yield StoredMessage(channel, schema, message.log_time, message.publish_time, message.data)
