"""What rosbag2 asks of a bag, told by the mcap library and rosbags: nothing here is the project's own.

The rules are libmcap's (IndexedMessageReader in reader.inl) and rosbag2's (mcap_storage.cpp).
"""

from collections import Counter
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import IO

import yaml
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Message, MessageIndex, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.rosbag2 import Reader


def assert_rosbag2_reads(bag: Path, *, was_killed: bool = False) -> None:
    """Every file of a bag is indexed, in order, and told of truly; by its folder and by itself.

    A kill may leave a metadata.yaml that is older than the file.
    """
    files = sorted(bag.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
    counted = [_assert_file(file) for file in files]
    told = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    total = sum(counted, Counter())
    if total:  # SequentialReader::seek does not find its way past a file without messages
        files = [file for file, counts in zip(files, counted, strict=True) if counts]
        counted = [counts for counts in counted if counts]
    if was_killed and told["message_count"] < sum(total.values()):
        return
    assert told["relative_file_paths"] == [file.name for file in files]
    assert told["message_count"] == sum(sum(counts.values()) for counts in counted)
    assert [file["message_count"] for file in told["files"]] == [sum(counts.values()) for counts in counted]
    of_topics = {
        topic["topic_metadata"]["name"]: topic["message_count"] for topic in told["topics_with_message_count"]
    }
    assert {name: count for name, count in of_topics.items() if count} == total
    with Reader(bag) as reader:
        assert sum(1 for _ in reader.messages()) == told["message_count"]


def _assert_file(file: Path) -> Counter[str]:
    """Returns how many messages of each topic it holds."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        indexed = Counter(channel.topic for _, channel, _ in reader.iter_messages())
        stream.seek(0)
        found = list(_inside(stream))
    assert summary is not None
    indexes: list[ChunkIndex] = summary.chunk_indexes
    for index in indexes:
        assert index.message_index_length > 0, "libmcap gives up a file whose first chunk has none"
        assert index.message_index_offsets
    starts = [index.chunk_start_offset for index in indexes]
    assert starts == sorted(starts)
    for one, other in pairwise(indexes):
        assert one.message_end_time <= other.message_start_time, "chunks are in order of time"
    chunks = [record for record, _ in found if isinstance(record, Chunk)]
    with_messages = [inside for record, inside in found if isinstance(record, Chunk) and _messages(inside)]
    assert len(indexes) == len(with_messages)
    for index, inside in zip(indexes, with_messages, strict=True):
        times = [message.log_time for message in _messages(inside)]
        assert (index.message_start_time, index.message_end_time) == (min(times), max(times))
        assert set(index.message_index_offsets) == {message.channel_id for message in _messages(inside)}
    everything = [record for record, inside in found for record in (record, *inside)]
    assert {type(record) for record, _ in found[1:-1]} <= {Chunk, MessageIndex, Metadata, DataEnd}
    statistics = summary.statistics
    assert statistics is not None
    by_channel = Counter(record.channel_id for record in everything if isinstance(record, Message))
    times = [record.log_time for record in everything if isinstance(record, Message)]
    assert statistics.message_count == sum(by_channel.values())
    assert {key: count for key, count in statistics.channel_message_counts.items() if count} == by_channel
    assert (statistics.message_start_time, statistics.message_end_time) == (
        min(times, default=0),
        max(times, default=0),
    )
    assert statistics.chunk_count == len(chunks)
    assert {record.id for record in everything if isinstance(record, Schema)} == set(summary.schemas)
    assert {record.id for record in everything if isinstance(record, Channel)} == set(summary.channels)
    assert statistics.schema_count == len(summary.schemas)
    assert statistics.channel_count == len(summary.channels)
    assert sum(indexed.values()) == statistics.message_count
    return indexed


def _inside(stream: IO[bytes]) -> Iterator[tuple[object, list]]:
    """The records of the data section; with each chunk what is in it."""
    for record in StreamReader(stream, emit_chunks=True, validate_crcs=True).records:
        yield record, breakup_chunk(record) if isinstance(record, Chunk) else []
        if isinstance(record, DataEnd):
            return


def _messages(records: list) -> list[Message]:
    return [record for record in records if isinstance(record, Message)]
