"""The parts of the Python package mcap by which bags are read; recording does not load this file.

Two things stay ours:

- Bounds. The library frames no record by the size of its file, and takes fewer bytes than a field claims for
  the whole field. So `split_records` and `read_record` hold each record and each field to the bytes there
  are.
- Messages and their indexes, of which a bag has many. A message takes 0.27 us here and 1.2 us by the library,
  an entry of an index 0.02 us and 0.53 us.
"""

import struct
from collections.abc import Iterator
from io import BytesIO
from typing import Any

from mauve_rt.trace.errors import libraries_missing
from mauve_rt.trace.format.mcap_records import HEAD

try:
    from lz4.frame import LZ4FrameDecompressor
    from mcap.data_stream import ReadDataStream, RecordBuilder
    from mcap.exceptions import McapError
    from mcap.opcode import Opcode
    from mcap.records import (
        Channel,
        Chunk,
        ChunkIndex,
        DataEnd,
        Footer,
        Header,
        McapRecord,
        Message,
        MessageIndex,
        Metadata,
        Schema,
        Statistics,
    )
    from zstandard import ZstdDecompressor
except ImportError as error:
    raise libraries_missing(error) from error

__all__ = [
    "MESSAGE_BYTES",
    "READ_OPCODES",
    "Channel",
    "Chunk",
    "ChunkIndex",
    "DataEnd",
    "Footer",
    "Header",
    "LZ4FrameDecompressor",
    "McapError",
    "McapRecord",
    "Message",
    "MessageIndex",
    "Metadata",
    "Opcode",
    "Schema",
    "Statistics",
    "ZstdDecompressor",
    "read_message",
    "read_record",
    "serialized",
    "split_records",
]

_MESSAGE = int(Opcode.MESSAGE)  # an enum is compared more slowly, and there are many
_MESSAGE_INDEX = int(Opcode.MESSAGE_INDEX)
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
MESSAGE_BYTES = _MESSAGE_HEAD.size
"""The least of a message, without opcode and length."""
_INDEX_HEAD = struct.Struct("<HI")  # channel, bytes of entries
_INDEX_ENTRY = struct.Struct("<QQ")  # log time, offset in the chunk
_KINDS: dict[int, Any] = {
    int(Opcode.HEADER): Header,
    int(Opcode.FOOTER): Footer,
    int(Opcode.SCHEMA): Schema,
    int(Opcode.CHANNEL): Channel,
    int(Opcode.CHUNK): Chunk,
    int(Opcode.CHUNK_INDEX): ChunkIndex,
    int(Opcode.STATISTICS): Statistics,
    int(Opcode.METADATA): Metadata,
    int(Opcode.DATA_END): DataEnd,
}
READ_OPCODES = frozenset({*_KINDS, _MESSAGE, _MESSAGE_INDEX})
"""Of records that are read; attachments and those of later versions are passed over."""


class _Body(ReadDataStream):
    """The bytes of one record."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) < length:
            msg = f"a field of {length:,} bytes does not fit into its record"
            raise McapError(msg)
        return data


def read_record(opcode: int, body: bytes) -> McapRecord:
    """Return the record of one of READ_OPCODES; what is behind it is ignored.

    Raises:
        McapError, ValueError: the bytes are no such record.

    """
    if opcode == _MESSAGE:
        return read_message(body, 0, len(body))
    if opcode == _MESSAGE_INDEX:
        return _message_index(body)
    record: McapRecord = _KINDS[opcode].read(_Body(BytesIO(body)))
    return record


def read_message(data: bytes, begin: int, end: int) -> Message:
    """Return the message in these bytes.

    Raises:
        McapError: they are fewer than a message begins with.

    """
    if end - begin < _MESSAGE_HEAD.size:
        msg = f"a Message of {end - begin:,} bytes is shorter than its head"
        raise McapError(msg)
    channel_id, sequence, log_time, publish_time = _MESSAGE_HEAD.unpack_from(data, begin)
    return Message(channel_id, log_time, data[begin + _MESSAGE_HEAD.size : end], publish_time, sequence)


def _message_index(body: bytes) -> MessageIndex:
    try:
        channel_id, size = _INDEX_HEAD.unpack_from(body)
        entries = memoryview(body)[_INDEX_HEAD.size : _INDEX_HEAD.size + size]
        if len(entries) == size:
            return MessageIndex(channel_id, list(_INDEX_ENTRY.iter_unpack(entries)))
    except struct.error as error:
        msg = f"a MessageIndex of {len(body):,} bytes cannot be read ({error})"
        raise McapError(msg) from error
    msg = f"a MessageIndex of {len(body):,} bytes claims entries of {size:,}"
    raise McapError(msg)


def serialized(*records: McapRecord) -> bytes:
    """Return the bytes of records, one behind the other."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())


def split_records(data: bytes) -> Iterator[tuple[int, int, int, int]]:
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
