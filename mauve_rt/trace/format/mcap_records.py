"""Builds the records of an MCAP file. Format: https://mcap.dev/spec.

Recording builds records itself, for no distribution packages the mcap library: an executor from a colcon
workspace records without it. Reading takes the library's records (`mauve_rt.trace.bag.mcap_library`).
"""

import struct
from enum import IntEnum
from typing import Any

HEAD = struct.Struct("<BQ")
"""What a record begins with: opcode, length."""
_ROOM = 0x80  # the first opcode that the format leaves to applications; readers pass over it


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
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    SUMMARY_OFFSET = 0x0E
    DATA_END = 0x0F


_LAYOUTS = {
    Opcode.HEADER: "profile:s library:s",
    Opcode.FOOTER: "summary_start:Q summary_offset_start:Q summary_crc:I",
    Opcode.SCHEMA: "id:H name:s encoding:s data:b",
    Opcode.CHANNEL: "id:H schema_id:H topic:s message_encoding:s metadata:t",
    Opcode.CHUNK_INDEX: "message_start_time:Q message_end_time:Q chunk_start_offset:Q chunk_length:Q"
    " message_index_offsets:n message_index_length:Q compression:s compressed_size:Q uncompressed_size:Q",
    Opcode.STATISTICS: "message_count:Q schema_count:H channel_count:I attachment_count:I metadata_count:I"
    " chunk_count:I message_start_time:Q message_end_time:Q channel_message_counts:n",
    Opcode.METADATA: "name:s metadata:t",
    Opcode.METADATA_INDEX: "offset:Q length:Q name:s",
    Opcode.SUMMARY_OFFSET: "group_opcode:B group_start:Q group_length:Q",
    Opcode.DATA_END: "data_section_crc:I",
}
"""Fields: numbers as struct has them; s: text; b: bytes; t: text by text; n: number by number."""
_FIELDS = {opcode: [field.split(":") for field in layout.split()] for opcode, layout in _LAYOUTS.items()}


def record(opcode: Opcode, **fields: Any) -> bytes:
    """Return a whole record, its opcode and length before it. Fields are named as in the library."""
    body = b"".join(_built(code, fields[name]) for name, code in _FIELDS[opcode])
    return HEAD.pack(opcode, len(body)) + body


def room(size: int) -> bytes:
    """Return a record of that size that tells nothing; none where the size is less than a record's."""
    length = size - HEAD.size
    return HEAD.pack(_ROOM, length) + bytes(length) if length >= 0 else b""


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
