"""Records of an MCAP file: ours are the mcap library's to the byte; the library's are read within bounds."""

import contextlib
import io
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
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
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import CompressionType, Writer

from mauve_rt.trace.bag.mcap_library import READ_OPCODES, read_record, serialized, split_records
from mauve_rt.trace.bag.mcap_limits import unpacked
from mauve_rt.trace.format import mcap_records as ours
from mauve_rt.trace.format.mcap_records import HEAD

u16, u32, u64 = (st.integers(0, 2**bits - 1) for bits in (16, 32, 64))
texts, counts = st.text(max_size=20), st.dictionaries(u16, u64, max_size=4)
FIELDS = {
    Header: {"profile": texts, "library": texts},
    Footer: {"summary_start": u64, "summary_offset_start": u64, "summary_crc": u32},
    Schema: {"id": u16, "name": texts, "encoding": texts, "data": st.binary(max_size=50)},
    Channel: {
        "id": u16,
        "schema_id": u16,
        "topic": texts,
        "message_encoding": texts,
        "metadata": st.dictionaries(texts, texts, max_size=3),
    },
    ChunkIndex: {
        "message_start_time": u64,
        "message_end_time": u64,
        "chunk_start_offset": u64,
        "chunk_length": u64,
        "message_index_offsets": counts,
        "message_index_length": u64,
        "compression": texts,
        "compressed_size": u64,
        "uncompressed_size": u64,
    },
    Statistics: {
        "message_count": u64,
        "schema_count": u16,
        "channel_count": u32,
        "attachment_count": u32,
        "metadata_count": u32,
        "chunk_count": u32,
        "message_start_time": u64,
        "message_end_time": u64,
        "channel_message_counts": counts,
    },
    SummaryOffset: {"group_opcode": st.integers(0, 255), "group_start": u64, "group_length": u64},
    DataEnd: {"data_section_crc": u32},
}


@pytest.mark.parametrize("kind", FIELDS, ids=lambda kind: kind.__name__)
def test_each_record_is_the_library_s_to_the_byte(kind: type[McapRecord]):
    @given(st.fixed_dictionaries(FIELDS[kind]))
    def check(fields: dict) -> None:
        theirs = kind(**fields)
        opcode = ours.Opcode(serialized(theirs)[0])
        assert ours.record(opcode, **fields) == serialized(theirs)
        if kind is not SummaryOffset:
            assert read_again(theirs) == theirs

    check()


def read_again(record: McapRecord) -> McapRecord:
    written = serialized(record)
    opcode, length = HEAD.unpack_from(written)
    assert len(written) == HEAD.size + length
    return read_record(opcode, written[HEAD.size :] + b"a later version's field")


@given(u16, st.lists(st.tuples(u64, u64), max_size=5))
def test_message_indexes_are_the_library_s(channel_id: int, records: list[tuple[int, int]]):
    index = MessageIndex(channel_id, records)
    assert read_again(index) == index


@pytest.mark.parametrize("compression", list(CompressionType))
def test_chunks_and_messages_of_the_library_are_read(compression: CompressionType):
    out = io.BytesIO()
    writer = Writer(out, chunk_size=500, compression=compression)
    writer.start("ros2", "somebody else")
    schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
    channel = writer.register_channel("/words", "cdr", schema)
    for number in range(50):
        writer.add_message(channel, number, bytes([number]) * 20, number + 1, sequence=number)
    writer.finish()
    data = out.getvalue()[8:-8]
    found = []
    for opcode, _, body, end in split_records(data):
        if opcode == Opcode.CHUNK:
            record = read_record(opcode, data[body:end])
            assert isinstance(record, Chunk)
            inside = unpacked(record)
            assert len(inside) == record.uncompressed_size
            found += [read_record(kind, inside[begin:stop]) for kind, _, begin, stop in split_records(inside)]
    messages = [one for one in found if isinstance(one, Message)]
    assert [(one.sequence, one.log_time, one.publish_time, one.data) for one in messages] == [
        (number, number, number + 1, bytes([number]) * 20) for number in range(50)
    ]


@given(st.binary(max_size=80), st.sampled_from(sorted(READ_OPCODES)))
def test_any_bytes_are_a_record_or_an_error(data: bytes, opcode: int):
    with contextlib.suppress(McapError, ValueError):
        read_record(opcode, data)


@pytest.mark.parametrize(
    ("opcode", "body"),
    [
        (Opcode.HEADER, struct.pack("<I", 5) + b"ros2"),
        (Opcode.SCHEMA, struct.pack("<HIII", 1, 0, 0, 10) + b"four"),
        (Opcode.CHUNK, struct.pack("<QQQIIQ", 0, 0, 10, 0, 0, 10) + b"four"),
        (Opcode.MESSAGE, bytes(21)),
        (Opcode.MESSAGE_INDEX, struct.pack("<HI", 1, 17) + bytes(17)),
        (Opcode.MESSAGE_INDEX, struct.pack("<HI", 1, 32) + bytes(16)),
        (Opcode.STATISTICS, bytes(45)),
    ],
)
def test_a_field_that_its_record_does_not_hold_is_refused(opcode: Opcode, body: bytes):
    with pytest.raises(McapError, match=r"does not fit|shorter than its head|cannot be read|claims entries"):
        read_record(opcode, body)


def test_a_compression_that_cannot_be_undone_says_so():
    for compression, message in (("xz", "expected zstd or lz4"), ("lz4", "cannot be unpacked")):
        with pytest.raises(McapError, match=message):
            unpacked(Chunk(compression, b"nonsense", 0, 0, 0, 10))
