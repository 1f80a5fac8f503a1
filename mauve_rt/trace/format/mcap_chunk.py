"""Messages on their way into an MCAP file: the chunk that the next flush writes."""

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from mauve_rt.trace.format.mcap_records import HEAD, Opcode, record

_MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_FIXED_BYTES = 22
_CHUNK_HEAD = struct.Struct("<QQQII")  # first, last log time, size, CRC, bytes of the compression's name
_SIZE = struct.Struct("<Q")
_INDEX_HEAD = struct.Struct("<BQHI")  # opcode, length, channel, bytes of entries
_INDEX_ENTRY = struct.Struct("<QQ")  # log time, offset in the chunk


@dataclass
class Counts:
    """How many messages, and when."""

    by_channel: dict[int, int] = field(default_factory=dict)
    start_ns: int = 0
    """Log time of the earliest message; 0 when there is none."""
    end_ns: int = 0

    @property
    def messages(self) -> int:
        """All messages."""
        return sum(self.by_channel.values())

    def add(self, channel_id: int, log_time_ns: int) -> None:
        """Count one message."""
        self.add_many(channel_id, 1, start_ns=log_time_ns, end_ns=log_time_ns)

    def add_many(self, channel_id: int, messages: int, *, start_ns: int, end_ns: int) -> None:
        """Count messages of one channel; the times may be those of other channels counted along with it."""
        self.start_ns = min(self.start_ns, start_ns) if self.by_channel else start_ns
        self.end_ns = max(self.end_ns, end_ns)
        self.by_channel[channel_id] = self.by_channel.get(channel_id, 0) + messages

    def plus(self, other: "Counts") -> "Counts":
        """Return the counts of both together; neither is changed."""
        if not self.by_channel or not other.by_channel:
            return other if other.by_channel else self
        channels = [*self.by_channel, *other.by_channel]
        by_channel = {key: self.by_channel.get(key, 0) + other.by_channel.get(key, 0) for key in channels}
        return Counts(by_channel, min(self.start_ns, other.start_ns), max(self.end_ns, other.end_ns))


class PendingChunk:
    """Messages that wait for a flush, already as records."""

    def __init__(self) -> None:
        self.records = bytearray()
        self.counts = Counts()
        self._indexes: dict[int, bytearray] = {}

    def add(self, channel_id: int, log_time_ns: int, data: bytes, *, publish_time_ns: int) -> None:
        """Append a message."""
        entry = _INDEX_ENTRY.pack(log_time_ns, len(self.records))
        self.records += _MESSAGE_HEAD.pack(
            Opcode.MESSAGE, _MESSAGE_FIXED_BYTES + len(data), channel_id, 0, log_time_ns, publish_time_ns
        )
        self.records += data
        self.counts.add(channel_id, log_time_ns)
        self._indexes.setdefault(channel_id, bytearray()).extend(entry)

    def add_packed(self, records: memoryview, channels: Sequence[tuple[int, int, int, bytes]]) -> None:
        """Append whole records: of each channel its first and last log time and the entries of its index."""
        self.records += records
        for channel_id, start_ns, end_ns, entries in channels:
            messages = len(entries) // _INDEX_ENTRY.size
            self.counts.add_many(channel_id, messages, start_ns=start_ns, end_ns=end_ns)
            self._indexes.setdefault(channel_id, bytearray()).extend(entries)

    def build(
        self, offset: int, data: bytes | bytearray, compression: str
    ) -> tuple[list[bytes | bytearray], bytes]:
        """Return the chunk and its message indexes for this place in the file, in parts, and its index.

        `data`: the records, compressed as `compression` says; empty: as they are.
        """
        size, name, crc = len(self.records), compression.encode(), zlib.crc32(self.records)
        head = _CHUNK_HEAD.pack(self.counts.start_ns, self.counts.end_ns, size, crc, len(name))
        head += name + _SIZE.pack(len(data))
        head = HEAD.pack(Opcode.CHUNK, len(head) + len(data)) + head
        chunk_length = len(head) + len(data)
        indexes = bytearray()
        index_offsets: dict[int, int] = {}
        for channel_id, entries in self._indexes.items():
            index_offsets[channel_id] = offset + chunk_length + len(indexes)
            indexes += _INDEX_HEAD.pack(Opcode.MESSAGE_INDEX, 6 + len(entries), channel_id, len(entries))
            indexes += entries
        index = record(
            Opcode.CHUNK_INDEX,
            chunk_length=chunk_length,
            chunk_start_offset=offset,
            compression=compression,
            compressed_size=len(data),
            message_end_time=self.counts.end_ns,
            message_index_length=len(indexes),
            message_index_offsets=index_offsets,
            message_start_time=self.counts.start_ns,
            uncompressed_size=size,
        )
        return [head, data, indexes], index
