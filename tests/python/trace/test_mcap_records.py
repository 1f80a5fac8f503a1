"""Records of an MCAP file, held against the mcap library: each reads what the other writes."""

import contextlib
import dataclasses
import io

import mcap.records
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.writer import CompressionType, Writer

from mauve_rt.trace.bag.mcap_limits import unpacked
from mauve_rt.trace.format import mcap_records as ours
from mauve_rt.trace.format.mcap_records import HEAD, McapError

u16, u32, u64 = (st.integers(0, 2**bits - 1) for bits in (16, 32, 64))
texts, counts = st.text(max_size=20), st.dictionaries(u16, u64, max_size=4)
FIELDS = {
    ours.Header: {"profile": texts, "library": texts},
    ours.Footer: {"summary_start": u64, "summary_offset_start": u64, "summary_crc": u32},
    ours.Schema: {"id": u16, "name": texts, "encoding": texts, "data": st.binary(max_size=50)},
    ours.Channel: {
        "id": u16,
        "schema_id": u16,
        "topic": texts,
        "message_encoding": texts,
        "metadata": st.dictionaries(texts, texts, max_size=3),
    },
    ours.MessageIndex: {"channel_id": u16, "records": st.lists(st.tuples(u64, u64), max_size=5)},
    ours.ChunkIndex: {
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
    ours.Statistics: {
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
    ours.SummaryOffset: {"group_opcode": st.integers(0, 255), "group_start": u64, "group_length": u64},
    ours.DataEnd: {"data_section_crc": u32},
}


@pytest.mark.parametrize("kind", FIELDS, ids=lambda kind: kind.__name__)
def test_each_record_is_the_library_s_to_the_byte(kind: type[ours.Record]):
    theirs = getattr(mcap.records, kind.__name__)

    @given(st.fixed_dictionaries(FIELDS[kind]))
    def check(fields: dict) -> None:
        builder = RecordBuilder()
        theirs(**fields).write(builder)
        written = builder.end()
        record = kind(**fields)
        assert record.to_bytes() == written
        opcode, length = HEAD.unpack_from(written)
        body = written[HEAD.size :]
        assert len(body) == length
        assert ours.read_record(opcode, body) == record
        again = theirs.read(ReadDataStream(io.BytesIO(body)))
        assert {one.name: getattr(again, one.name) for one in dataclasses.fields(again)} == fields

    check()


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
    for opcode, _, body, end in ours.split_records(data):
        record = ours.read_record(opcode, data[body:end])
        if isinstance(record, ours.Chunk):
            inside = unpacked(record)
            assert len(inside) == record.uncompressed_size
            found += [
                ours.read_record(kind, inside[begin:stop])
                for kind, _, begin, stop in ours.split_records(inside)
            ]
    messages = [one for one in found if isinstance(one, ours.Message)]
    assert [(one.sequence, one.log_time, one.publish_time, one.data) for one in messages] == [
        (number, number, number + 1, bytes([number]) * 20) for number in range(50)
    ]


@given(st.binary(max_size=80), st.integers(1, 15))
def test_any_bytes_are_a_record_or_an_error(data: bytes, opcode: int):
    with contextlib.suppress(McapError):
        ours.read_record(opcode, data)


def test_a_compression_that_cannot_be_undone_says_so(monkeypatch: pytest.MonkeyPatch):
    def chunk(compression: str) -> ours.Chunk:
        return ours.Chunk(0, 0, 10, 0, compression, b"nonsense")

    for compression, message in (("xz", "expected zstd or lz4"), ("lz4", "cannot be unpacked")):
        with pytest.raises(McapError, match=message):
            unpacked(chunk(compression))
    monkeypatch.setitem(__import__("sys").modules, "zstandard", None)
    with pytest.raises(McapError, match="install python3-zstandard"):
        unpacked(chunk("zstd"))
