"""Builds the records of an MCAP file. Format: https://mcap.dev/spec.

Recording builds records itself, for no distribution packages the mcap library: an executor from a colcon
workspace records without it. Reading takes the library's records (`mauve_rt.trace.bag.mcap_library`).
"""

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

HEAD = struct.Struct("<BQ")
"""What a record begins with: opcode, length."""


class Opcode(IntEnum):
    """Kinds of records that a recording has."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


class Record:
    """What all have in common: `_LAYOUTS` says how each is laid out."""

    __slots__: tuple[str, ...] = ()

    def to_bytes(self) -> bytes:
        """Return the whole record, its opcode and length before it."""
        opcode, layout = _LAYOUTS[type(self)]
        fields = zip(layout, type(self).__slots__, strict=True)
        body = b"".join(_built(code, getattr(self, name)) for code, name in fields)
        return HEAD.pack(opcode, len(body)) + body


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


_LAYOUTS: dict[type[Record], tuple[Opcode, str]] = {
    Header: (Opcode.HEADER, "ss"),
    Footer: (Opcode.FOOTER, "QQI"),
    Schema: (Opcode.SCHEMA, "Hssb"),
    Channel: (Opcode.CHANNEL, "HHsst"),
    ChunkIndex: (Opcode.CHUNK_INDEX, "QQQQnQsQQ"),
    Statistics: (Opcode.STATISTICS, "QHIIIIQQn"),
    SummaryOffset: (Opcode.SUMMARY_OFFSET, "BQQ"),
    DataEnd: (Opcode.DATA_END, "I"),
}
"""Opcode and fields: numbers as struct has them; s: text; b: bytes; t: text by text; n: number by number."""


def serialized(*records: Record) -> bytes:
    """Return the bytes of records, one behind the other."""
    return b"".join(record.to_bytes() for record in records)


def _built(code: str, value: Any) -> bytes:
    if code == "s":
        return _with_size(value.encode())
    if code == "b":
        return _with_size(value)
    if code == "t":
        return _with_size(b"".join(_with_size(text.encode()) for pair in value.items() for text in pair))
    if code == "n":
        return _with_size(b"".join(struct.pack("<HQ", *pair) for pair in value.items()))
    return struct.pack(f"<{code}", value)


def _with_size(data: bytes) -> bytes:
    return struct.pack("<I", len(data)) + data
