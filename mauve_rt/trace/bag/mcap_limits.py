"""What the reader of an MCAP file believes: no size that it claims costs more than the file can justify.

Compression can make gigabytes of kilobytes. A chunk is unpacked up to the size it claims, no further, and
what a file's compressed chunks hold together has bounds that grow with the file. Beyond them the file is
refused, not damaged: a repair would cut it off there.
"""

from typing import NoReturn

from mauve_rt.trace.bag.compression import BYTES_PER_BYTE, MAX_CHUNK_BYTES
from mauve_rt.trace.bag.mcap_library import Chunk, LZ4FrameDecompressor, McapError, ZstdDecompressor
from mauve_rt.trace.errors import TraceError

FREE_BYTES = 256 << 20
"""All compressed chunks may hold so much, and BYTES_PER_BYTE more for each byte of the file."""
FREE_RECORDS, RECORDS_PER_BYTE = 100_000, 1
"""So many records, likewise: each takes some time and memory, however short, and its time
alone a byte or more."""
MAX_DEFINITION_BYTES = 16 << 20
"""Of a schema or channel."""
MAX_DEFINITIONS_BYTES = 64 << 20
"""Of all of a file."""
MOST_OF_A_BYTE = 40_000
"""zstd makes at most 32,768 bytes of one, lz4 255."""
_MAX_WINDOW_BYTES = 128 << 20  # what zstd may need to unpack; its own default
_UNCOMPRESSED = "`ros2 bag convert` makes a bag without compression of it, if you trust it"


class McapLimits:
    """What one pass over a file may still unpack."""

    def __init__(self, where: str, file_bytes: int) -> None:
        """`where` begins every error."""
        self._where = where
        self._bytes = FREE_BYTES + BYTES_PER_BYTE * file_bytes
        self._records = FREE_RECORDS + RECORDS_PER_BYTE * file_bytes
        self._defined_bytes = 0
        self._definition_bytes: dict[tuple[int, bytes], int] = {}

    def unpacked(self, chunk: Chunk) -> bytes:
        """Return the records in a chunk, as bytes.

        Raises:
            McapError: they are not what the chunk claims.
            TraceError: they are more than is read.

        """
        if not chunk.compression:
            return unpacked(chunk)
        size, most = chunk.uncompressed_size, min(MAX_CHUNK_BYTES, self._bytes)
        if most < size <= MOST_OF_A_BYTE * len(chunk.data):
            self._refuse(f"a chunk of {len(chunk.data):,} bytes that unpacks to {size:,}")
        data = unpacked(chunk)
        self._bytes -= len(data)
        return data

    def records_left(self, chunk: Chunk) -> int:
        """How many records a chunk may hold."""
        return self._records if chunk.compression else len(chunk.data)

    def count(self, chunk: Chunk, records: int) -> None:
        """Count the records of a chunk that was read."""
        if chunk.compression:
            self._records -= records

    def refuse_records(self) -> NoReturn:
        """There are more.

        Raises:
            TraceError: to say so.

        """
        self._refuse("more records in its compressed chunks than a file of its size holds")

    def define(self, opcode: int, number: bytes, size: int) -> None:
        """Count the bytes of a schema or channel that is to be read; `number` is its id.

        Raises:
            TraceError: they are more than is read.

        """
        key = (opcode, number)
        self._defined_bytes += size - self._definition_bytes.get(key, 0)
        self._definition_bytes[key] = size
        if size > MAX_DEFINITION_BYTES or self._defined_bytes > MAX_DEFINITIONS_BYTES:
            self._refuse(f"a schema or channel of {size:,} bytes")

    def _refuse(self, what: str) -> NoReturn:
        why = "it is not read, for so little can be made to take all memory"
        msg = f"{self._where}: {what}: {why}; {_UNCOMPRESSED}"
        raise TraceError(msg)


def unpacked(chunk: Chunk) -> bytes:
    """Return the records in a chunk, as bytes: as many as it claims.

    Raises:
        McapError: there are more or fewer, or they cannot be uncompressed.

    """
    size = chunk.uncompressed_size
    if chunk.compression and size > MOST_OF_A_BYTE * len(chunk.data):
        msg = f"a chunk of {len(chunk.data):,} bytes claims to unpack to {size:,}"
        raise McapError(msg)
    data = _unpacked(chunk) if chunk.compression else chunk.data
    if len(data) != size:
        found = f"{len(data):,}" if len(data) <= size else "more"
        msg = f"a chunk claims to unpack to {size:,} bytes, found {found}"
        raise McapError(msg)
    return data


def _unpacked(chunk: Chunk) -> bytes:
    """At most one byte more than the chunk claims; the library believes the size that a frame claims."""
    unpack = {"zstd": _unpacked_zstd, "lz4": _unpacked_lz4}.get(chunk.compression)
    if unpack is None:
        msg = f"compressed by {chunk.compression!r}, expected zstd or lz4"
        raise McapError(msg)
    try:
        return unpack(chunk.data, chunk.uncompressed_size + 1)
    except MemoryError:
        raise
    except Exception as error:  # each compression has an error of its own
        msg = f"a chunk cannot be unpacked ({error})"
        raise McapError(msg) from error


def _unpacked_zstd(data: bytes, limit: int) -> bytes:
    # In a stream: at once, it would believe the size in the frame and not the limit.
    unpack = ZstdDecompressor(max_window_size=_MAX_WINDOW_BYTES)
    with unpack.stream_reader(data) as stream:
        return bytes(stream.read(limit))


def _unpacked_lz4(data: bytes, limit: int) -> bytes:
    return bytes(LZ4FrameDecompressor().decompress(data, max_length=limit))
