"""The records of an MCAP file, between values and bytes. Format: https://mcap.dev/spec.

Not the mcap library's: no distribution packages that one, and whoever records needs these. The tests hold
what is written here against it.
"""

import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NamedTuple, Self

HEAD = struct.Struct("<BQ")
"""What a record begins with: opcode, length."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""What a message begins with: channel, sequence, log time, publish time."""
_LENGTH, _LONG_LENGTH = struct.Struct("<I"), struct.Struct("<Q")


Bytes = bytes | memoryview


class Opcode(IntEnum):
    """Kinds of records."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    STATISTICS = 0x0B
    METADATA = 0x0C
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


class McapError(ValueError):
    """Bytes that are no such record."""


class Record:
    """What all have in common: `_RECORDS` says how each is laid out."""

    __slots__: tuple[str, ...] = ()

    def to_bytes(self) -> bytes:
        """Return the whole record, its opcode and length before it."""
        opcode, layout = _LAYOUTS[type(self)]
        fields = zip(layout, type(self).__slots__, strict=True)
        body = b"".join(_PARTS[code].write(getattr(self, name)) for code, name in fields)
        return HEAD.pack(opcode, len(body)) + body

    @classmethod
    def from_bytes(cls, body: Bytes) -> Self:
        """Return the record whose opcode and length stood before these bytes; what is behind it is ignored.

        Raises:
            McapError: they end early, or a text is no UTF-8.

        """
        at, values = 0, []
        try:
            for code in _LAYOUTS[cls][1]:
                value, at = _PARTS[code].read(body, at)
                values.append(value)
        except (struct.error, UnicodeDecodeError) as error:
            msg = f"a {cls.__name__} of {len(body):,} bytes cannot be read ({error})"
            raise McapError(msg) from error
        return cls(*values)


@dataclass(slots=True)
class Header(Record):
    """The first record."""

    profile: str
    library: str


@dataclass(slots=True)
class Footer(Record):
    """The last record."""

    summary_start: int
    summary_offset_start: int
    summary_crc: int


@dataclass(slots=True)
class Schema(Record):
    """A type's definition."""

    id: int
    name: str
    encoding: str
    data: bytes


@dataclass(slots=True)
class Channel(Record):
    """A topic."""

    id: int
    schema_id: int
    topic: str
    message_encoding: str
    metadata: dict[str, str]


@dataclass(slots=True)
class Message(Record):
    """A message; times in ns."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes

    @classmethod
    def from_bytes(cls, body: Bytes) -> Self:
        """As of any record, but faster: there are many."""
        if len(body) < MESSAGE_HEAD.size:
            msg = f"a Message of {len(body):,} bytes is shorter than its head"
            raise McapError(msg)
        channel_id, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(body)
        return cls(channel_id, sequence, log_time, publish_time, bytes(body[MESSAGE_HEAD.size :]))


@dataclass(slots=True)
class Chunk(Record):
    """Schemas, channels and messages, compressed or not."""

    message_start_time: int
    message_end_time: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str
    data: bytes


@dataclass(slots=True)
class MessageIndex(Record):
    """Where the messages of one channel are in the chunk before: (log time, offset in it)."""

    channel_id: int
    records: list[tuple[int, int]]


@dataclass(slots=True)
class ChunkIndex(Record):
    """Where a chunk is, and its message indexes."""

    message_start_time: int
    message_end_time: int
    chunk_start_offset: int
    chunk_length: int
    message_index_offsets: dict[int, int]
    message_index_length: int
    compression: str
    compressed_size: int
    uncompressed_size: int


@dataclass(slots=True)
class Statistics(Record):
    """What the data section holds."""

    message_count: int
    schema_count: int
    channel_count: int
    attachment_count: int
    metadata_count: int
    chunk_count: int
    message_start_time: int
    message_end_time: int
    channel_message_counts: dict[int, int]


@dataclass(slots=True)
class SummaryOffset(Record):
    """Where the records of one kind are in the summary."""

    group_opcode: int
    group_start: int
    group_length: int


@dataclass(slots=True)
class DataEnd(Record):
    """What ends the data section."""

    data_section_crc: int


@dataclass(slots=True)
class OtherRecord(Record):
    """One that our bags do not have: an attachment, metadata, a record of a later version of the format."""

    opcode: int


class _Part(NamedTuple):
    """How one field is written and read."""

    write: Callable[[Any], bytes]
    read: Callable[[Bytes, int], tuple[Any, int]]
    """Of bytes from an offset: the value, and the offset behind it."""


def _number(code: str) -> _Part:
    coded = struct.Struct(f"<{code}")
    return _Part(coded.pack, lambda data, at: (coded.unpack_from(data, at)[0], at + coded.size))


def _sized(data: Bytes, at: int, length: struct.Struct = _LENGTH) -> tuple[Bytes, int]:
    begin = at + length.size
    end = begin + length.unpack_from(data, at)[0]
    if end > len(data):
        msg = f"a field of {end - begin:,} bytes does not fit into it"
        raise struct.error(msg)
    return data[begin:end], end


def _with_size(data: bytes, length: struct.Struct = _LENGTH) -> bytes:
    return length.pack(len(data)) + data


def _bytes(length: struct.Struct) -> _Part:
    def read(data: Bytes, at: int) -> tuple[bytes, int]:
        found, at = _sized(data, at, length)
        return bytes(found), at

    return _Part(lambda data: _with_size(data, length), read)


def _read_text(data: Bytes, at: int) -> tuple[str, int]:
    text, at = _sized(data, at)
    return str(text, "utf-8"), at


def _texts(texts: dict[str, str]) -> bytes:
    return _with_size(b"".join(_with_size(text.encode()) for pair in texts.items() for text in pair))


def _read_texts(data: Bytes, at: int) -> tuple[dict[str, str], int]:
    body, end = _sized(data, at)
    texts, at = {}, 0
    while at < len(body):
        key, at = _read_text(body, at)
        texts[key], at = _read_text(body, at)
    return texts, end


def _pairs(form: str, kind: type) -> _Part:
    """Return a field of pairs of numbers: a mapping, or a list."""
    pair = struct.Struct(form)

    def write(value: Any) -> bytes:
        items = value.items() if kind is dict else value
        return _with_size(b"".join(pair.pack(*item) for item in items))

    def read(data: Bytes, at: int) -> tuple[Any, int]:
        body, at = _sized(data, at)
        return kind(pair.iter_unpack(body)), at

    return _Part(write, read)


_PARTS = {code: _number(code) for code in "BHIQ"} | {
    "s": _Part(lambda text: _with_size(text.encode()), _read_text),
    "b": _bytes(_LENGTH),
    "d": _bytes(_LONG_LENGTH),
    "t": _Part(_texts, _read_texts),
    "n": _pairs("<HQ", dict),
    "e": _pairs("<QQ", list),
}
"""Fields: numbers as struct has them; s: text; b, d: bytes with a length of 4, of 8; t: text by text;
n: number by number; e: pairs of numbers."""

_LAYOUTS: dict[type[Record], tuple[Opcode, str]] = {
    Header: (Opcode.HEADER, "ss"),
    Footer: (Opcode.FOOTER, "QQI"),
    Schema: (Opcode.SCHEMA, "Hssb"),
    Channel: (Opcode.CHANNEL, "HHsst"),
    Chunk: (Opcode.CHUNK, "QQQIsd"),
    MessageIndex: (Opcode.MESSAGE_INDEX, "He"),
    ChunkIndex: (Opcode.CHUNK_INDEX, "QQQQnQsQQ"),
    Statistics: (Opcode.STATISTICS, "QHIIIIQQn"),
    SummaryOffset: (Opcode.SUMMARY_OFFSET, "BQQ"),
    DataEnd: (Opcode.DATA_END, "I"),
}
_READ: dict[int, type[Record]] = {int(opcode): kind for kind, (opcode, _) in _LAYOUTS.items()}
_READ[Opcode.MESSAGE] = Message
READ_OPCODES = frozenset(_READ)
"""Of records that are read; all others are an OtherRecord."""


def serialized(*records: Record) -> bytes:
    """Return the bytes of records, one behind the other."""
    return b"".join(record.to_bytes() for record in records)


def read_record(opcode: int, body: Bytes) -> Record:
    """Return the record with this opcode.

    Raises:
        McapError: the bytes are no such record.

    """
    kind = _READ.get(opcode)
    return OtherRecord(opcode) if kind is None else kind.from_bytes(body)


def split_records(data: Bytes) -> Iterator[tuple[int, int, int, int]]:
    """Yield the opcode of each record, and where the record, its body and the next one begin.

    Raises:
        McapError: the last one is not whole.

    """
    at, size = 0, len(data)
    while at < size:
        if at + HEAD.size > size:
            msg = f"{size - at} bytes behind the last record are none"
            raise McapError(msg)
        opcode, length = HEAD.unpack_from(data, at)
        body = at + HEAD.size
        if body + length > size:
            msg = f"a record of {length:,} bytes does not fit into {size - at:,}"
            raise McapError(msg)
        yield opcode, at, body, body + length
        at = body + length
