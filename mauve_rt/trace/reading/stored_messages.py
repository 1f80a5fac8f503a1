"""Messages of one file of a bag as bytes, without the parts of the file that hold none of the wanted topics.

The first pass over a file notes which chunk holds which channels. A later pass reads only the chunks it needs:
a report asks for topics with some ten messages in a file of some hundred megabytes.
"""

import os
import struct
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from mauve_rt.trace.bag.files import MCAP
from mauve_rt.trace.bag.mcap_library import Channel, Chunk, McapError, Message, Opcode, Schema, read_record
from mauve_rt.trace.bag.mcap_limits import McapLimits
from mauve_rt.trace.bag.mcap_scan import Found, McapScan
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.mcap_records import HEAD

if TYPE_CHECKING:
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan

_RECORD = struct.Struct("<BQHIQQ")  # opcode, length; of a message: channel, sequence, log time, publish time
_CHUNK, _MESSAGE = int(Opcode.CHUNK), int(Opcode.MESSAGE)
_RUN_BYTES = 1 << 20  # messages outside of chunks are read together, about so many bytes at once


class StoredMessage(NamedTuple):
    """A message as the file has it. Times in ns of CLOCK_REALTIME."""

    channel: Channel
    schema: Schema | None
    log_time_ns: int
    published_ns: int
    data: bytes


def scan_of(file: Path) -> "McapScan | SqliteScan":
    """Open a file for one pass from its begin."""
    if file.suffix == MCAP:
        return McapScan(file)
    from mauve_rt.trace.bag.sqlite_scan import SqliteScan  # noqa: PLC0415 - 50 ms, and seldom needed

    return SqliteScan(file)


class StoredMessages:
    """What the first pass over a file found, and the later passes. Later passes read no more than the first."""

    def __init__(self, path: Path) -> None:
        """Know nothing yet."""
        self._path = path
        self._ends: list[tuple[int, int, bool]] = []  # begin, end, whether a chunk
        self._of_channel: dict[int, array[int]] = {}  # indices into _ends, in order
        self._defined: dict[tuple[type, int], Schema | Channel] = {}
        self._needs_scan = path.suffix != MCAP

    def first_pass(
        self, scan: "McapScan | SqliteScan"
    ) -> Iterator[tuple[Counter[int], list[Message]]]:
        """Yield the messages of the file, some at a time, and how many each channel has among them.

        Raises:
            TraceError: the file cannot be read.

        """
        if isinstance(scan, McapScan):
            for found in scan.found():
                messages = [one for _, one in found.inside if type(one) is Message]
                counts = Counter([one.channel_id for one in messages])
                self._note(found, counts)
                yield counts, messages
        else:
            for _, message in scan.messages():
                yield Counter((message.channel_id,)), [message]

    def messages(self, is_wanted: Callable[[str, str], bool]) -> Iterator[StoredMessage]:
        """Yield the messages whose topic and type are wanted, in the order of the file.

        Raises:
            TraceError: the file cannot be read.

        """
        if self._needs_scan:
            yield from _scanned(self._path, is_wanted)
            return
        schemas = {number: one for (_, number), one in self._defined.items() if isinstance(one, Schema)}
        wanted: dict[int, tuple[Channel, Schema | None]] = {}
        for one in self._defined.values():
            if isinstance(one, Channel):
                schema = schemas.get(one.schema_id)
                if is_wanted(one.topic, "" if schema is None else schema.name):
                    wanted[one.id] = (one, schema)
        places = sorted({*chain.from_iterable(self._of_channel.get(number, ()) for number in wanted)})
        for data in self._pieces(places):
            for number, log_time_ns, published_ns, payload in _messages_in(data, wanted):
                yield StoredMessage(*wanted[number], log_time_ns, published_ns, payload)

    def _note(self, found: Found, channels: Collection[int]) -> None:
        """Keep where a record of the data section is, and what is in it."""
        if len(channels) < len(found.inside):
            for _, one in found.inside:
                if isinstance(one, Schema | Channel) and self._defined.setdefault((type(one), one.id), one) != one:
                    self._needs_scan = True  # a number with two meanings: only a pass in order knows which
        if not channels:
            return
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

    def _pieces(self, places: Collection[int]) -> Iterator[bytes]:
        """Yield the records at these places."""
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


def _messages_in(data: bytes, wanted: Collection[int]) -> Iterator[tuple[int, int, int, bytes]]:
    """Yield channel, times and payload of the wanted messages among records that a first pass has checked."""
    at, size = 0, len(data)
    while at + _RECORD.size <= size:  # a shorter record is no message
        opcode, length, number, _, log_time_ns, published_ns = _RECORD.unpack_from(data, at)
        end = at + HEAD.size + length
        if opcode == _MESSAGE and number in wanted:
            yield number, log_time_ns, published_ns, data[at + _RECORD.size : end]
        at = end


def _scanned(path: Path, is_wanted: Callable[[str, str], bool]) -> Iterator[StoredMessage]:
    """Yield the wanted messages by a pass over the whole file."""
    with scan_of(path) as scan:
        for channel, message in scan.messages():
            if is_wanted(channel.topic, scan.type_of(channel)):
                schema = scan.schemas.get(channel.schema_id)
                yield StoredMessage(
                    channel, schema, message.log_time, message.publish_time, message.data
                )
