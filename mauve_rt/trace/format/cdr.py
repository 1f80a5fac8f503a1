"""CDR of the recorder's own messages, from bytes: a batch of 20,000 records is one copy, not 20,000 objects.

Layout of a serialized mauve_msgs/msg/TraceBatch (plain CDR, little-endian; offsets count from behind the
encapsulation header, which is 4 bytes long, and so do alignments):

    0   int64   monotonic_ns
    8   int64   realtime_ns
    16  uint32  length of written, then padding to 8 when it is not empty, then its uint64s
    ..  uint32  length of dropped, the same
    ..  uint32  length of records, then padding to 8 when it is not empty, then the records

A TraceRecord starts with a uint64 and is 48 bytes long without gaps, hence records follow each other
exactly as the kernel's rings hold them. An empty sequence has no padding behind its length.
"""

import struct
from collections.abc import Sequence
from typing import NamedTuple

from mauve_rt.trace.errors import TraceError

RECORD_BYTES = 48
MAX_COMPONENTS = 1 << 16  # a record's number of its component has 16 bits
ENCAPSULATION = b"\x00\x01\x00\x00"
_UINT32 = struct.Struct("<I")
_CLOCK_PAIR = struct.Struct("<qq")


class Batch(NamedTuple):
    """The fields of a TraceBatch; `records` is n x 48 bytes."""

    monotonic_ns: int
    realtime_ns: int
    written: Sequence[int]
    dropped: Sequence[int]
    records: bytes | memoryview


def encode_batch(batch: Batch) -> bytes:
    """Serialize a mauve_msgs/msg/TraceBatch.

    Raises:
        TraceError: `records` is not a whole number of records.

    """
    count, rest = divmod(len(batch.records), RECORD_BYTES)
    if rest:
        found = len(batch.records)
        msg = f"trace batch: expected a multiple of {RECORD_BYTES} bytes of records, found {found} bytes"
        raise TraceError(msg)
    out = bytearray(_CLOCK_PAIR.pack(batch.monotonic_ns, batch.realtime_ns))
    for counters in (batch.written, batch.dropped):
        _begin_sequence(out, len(counters))
        out += struct.pack(f"<{len(counters)}Q", *counters)
    _begin_sequence(out, count)
    return b"".join((ENCAPSULATION, out, batch.records))


def encode_names(components: Sequence[str], names: Sequence[str]) -> bytes:
    """Serialize a mauve_msgs/msg/TraceNames."""
    out = bytearray()
    for words in (components, names):
        _align(out, 4)
        out += _UINT32.pack(len(words))
        for word in words:
            text = word.encode() + b"\0"
            _align(out, 4)
            out += _UINT32.pack(len(text))
            out += text
    return ENCAPSULATION + bytes(out)


def decode_batch(data: bytes) -> Batch:
    """Read a serialized mauve_msgs/msg/TraceBatch back; `records` is a view of data, not a copy.

    Raises:
        TraceError: the data is not one, or ends early.

    """
    if data[:2] != ENCAPSULATION[:2]:
        found = data[:2].hex(" ")
        msg = f"trace batch: expected little-endian plain CDR (00 01), found encapsulation {found}"
        raise TraceError(msg)
    body = memoryview(data)[len(ENCAPSULATION) :]
    try:
        monotonic_ns, realtime_ns = _CLOCK_PAIR.unpack_from(body, 0)
        at = _CLOCK_PAIR.size
        counters: list[Sequence[int]] = []
        for _ in range(2):
            at, count = _enter_sequence(body, at)
            if count > MAX_COMPONENTS:
                msg = f"trace batch: counters of {count:,} components, expected at most {MAX_COMPONENTS:,}"
                raise TraceError(msg)
            counters.append(struct.unpack_from(f"<{count}Q", body, at))
            at += 8 * count
        at, count = _enter_sequence(body, at)
    except struct.error as error:
        msg = f"trace batch: truncated, {len(data)} bytes ({error})"
        raise TraceError(msg) from error
    records = body[at : at + RECORD_BYTES * count]
    if len(records) != RECORD_BYTES * count:
        expected = f"{count} records of {RECORD_BYTES} bytes"
        msg = f"trace batch: truncated, expected {expected}, found {len(records)} bytes"
        raise TraceError(msg)
    return Batch(monotonic_ns, realtime_ns, counters[0], counters[1], records)


def _align(out: bytearray, alignment: int) -> None:
    out += bytes(-len(out) % alignment)


def _begin_sequence(out: bytearray, length: int) -> None:
    _align(out, 4)
    out += _UINT32.pack(length)
    if length:
        _align(out, 8)


def _enter_sequence(body: memoryview, at: int) -> tuple[int, int]:
    """Offset of the first element and the length of the sequence of 8-aligned elements at or behind `at`."""
    at += -at % 4
    (length,) = _UINT32.unpack_from(body, at)
    at += _UINT32.size
    return (at + -at % 8 if length else at), length
