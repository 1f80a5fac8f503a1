"""A bag that is no finished one, wherever it was cut off: what is told of it, and what is made of it."""

import os
import random
import shutil
import struct
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from bag_rules import assert_rosbag2_reads
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import Reader, ReaderError
from synthetic_traces import FlushedByHand

import mauve_rt.trace
from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.mcap_file import McapFile
from mauve_rt.trace.bag.recorded import Split
from mauve_rt.trace.bag.repair import examine_bag, repair_bag
from mauve_rt.trace.bag.writer import BagWriter
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

NODE = "/robot/executor"
KILLS = 5


@pytest.fixture(autouse=True)
def no_pause(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("mauve_rt.trace.bag.mcap_scan._PAUSE_S", 0)


def record(directory: Path, count: int = 30, split: Split | None = None) -> Path:
    """A bag of many small flushes."""
    source = SyntheticSource(["a", "b"])
    bag = FlushedByHand(source, directory, node_name=NODE, split=split)
    for index in range(count):
        source.add("a", Kind.MARK, index, name=f"word {index}")
        bag.flush()
    bag.close()
    return directory


def marks(bag: Path) -> list[int]:
    return [int(row["time_ns"]) for row in mauve_rt.trace.open(bag).of("a", Kind.MARK)]


def messages_by_rosbags(bag: Path) -> int:
    with Reader(bag) as reader:
        return sum(1 for _ in reader.messages())


def messages_by_mcap(file: Path) -> int:
    with file.open("rb") as stream:
        return sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages())


def test_a_finished_bag_is_left_as_it_is(tmp_path: Path):
    bag = record(tmp_path / "bag")
    before = {file: file.read_bytes() for file in bag.iterdir()}
    state = examine_bag(bag)
    assert state.is_finished
    assert state.damages() == []
    assert_rosbag2_reads(bag)
    repair_bag(state)
    assert {file: file.read_bytes() for file in bag.iterdir()} == before


def test_a_bag_cut_off_anywhere_is_finished_by_a_repair(tmp_path: Path):
    whole = record(tmp_path / "whole")
    data = (whole / "whole_0.mcap").read_bytes()
    everything = marks(whole)
    found = set()
    one = mauve_rt.trace.open(record(tmp_path / "first", count=1))
    first = one.files[0].whole_bytes  # there, data has begun; what follows repeats the definitions
    sizes = random.Random(5).sample(range(first, len(data)), 20)  # noqa: S311 - no cryptography
    for size in sizes:
        bag = tmp_path / "bag"
        shutil.copytree(whole, bag)
        file = (bag / "whole_0.mcap").rename(bag / "bag_0.mcap")
        os.truncate(file, size)
        there = marks(bag)
        state = examine_bag(bag)
        assert not state.is_finished
        repair_bag(state)
        assert examine_bag(bag).is_finished
        assert marks(bag) == there == everything[: len(there)]
        assert messages_by_rosbags(bag) == messages_by_mcap(file) == state.files[0].counts.messages
        assert_rosbag2_reads(bag)
        found.add(len(there))
        shutil.rmtree(bag)
    assert len(found) > 3


def test_the_old_end_below_a_torn_write_is_no_data(tmp_path: Path):
    """As a kill inside the write leaves it: a chunk's begin over the old end, a part of which remains."""
    bag = record(tmp_path / "bag", count=10)
    file = bag / "bag_0.mcap"
    data = bytearray(file.read_bytes())
    data_end = mauve_rt.trace.open(bag).files[0].whole_bytes
    chunk = data[data.index(b"\x06", 8) :][:300]  # a chunk's begin, and not all of it
    data[data_end : data_end + len(chunk)] = chunk
    file.write_bytes(data)
    with pytest.raises((ReaderError, AssertionError, Exception)):
        messages_by_rosbags(bag)
    assert marks(bag) == list(range(10))
    repair_bag(examine_bag(bag))
    assert marks(bag) == list(range(10))
    assert messages_by_rosbags(bag) == messages_by_mcap(file)


def test_a_file_that_a_kill_left_before_its_first_message_is_no_damage(tmp_path: Path):
    bag = record(tmp_path / "bag")
    writer = BagWriter(tmp_path / "other")
    (tmp_path / "other" / "other_0.mcap").rename(bag / "bag_1.mcap")  # begun, and not yet named
    writer.abort()
    state = examine_bag(bag)
    assert state.damages() == []
    (bag / "metadata.yaml").unlink()
    repair_bag(examine_bag(bag))
    assert_rosbag2_reads(bag)
    assert "bag_1" not in (bag / "metadata.yaml").read_text()
    assert marks(bag) == list(range(30))


@pytest.mark.parametrize("size", [0, 5, 20])
def test_a_file_of_which_nothing_is_left_does_not_keep_the_others(tmp_path: Path, size: int):
    bag = record(tmp_path / "bag", count=60, split=Split(after_s=0, after_bytes=12_000))
    os.truncate(bag / "bag_1.mcap", size)
    found = [finding.text for finding in check_bag(bag)]
    assert any("bag_1.mcap: nothing of it can be read (" in text for text in found), found
    state = examine_bag(bag)
    assert not state.is_finished
    repair_bag(state)
    assert (bag / "bag_1.mcap.unreadable").stat().st_size == size
    assert examine_bag(bag).is_finished
    assert_rosbag2_reads(bag)
    left = marks(bag)
    assert 0 < len(left) < 60
    assert left == sorted(left)


def test_metadata_that_is_missing_or_older_is_made_again(tmp_path: Path):
    bag = record(tmp_path / "bag")
    metadata = bag / "metadata.yaml"
    original = metadata.read_text()
    for text, why in (
        (None, "not there"),
        ("nonsense", "has no rosbag2_bagfile_information"),
        ("{", "cannot be read"),
        (original.replace("bag_0.mcap", "other.mcap"), "names the files other.mcap, there are bag_0.mcap"),
        (original.replace("message_count: ", "message_count: 1"), "messages, there are"),
    ):
        metadata.unlink()
        if text is not None:
            metadata.write_text(text)
        state = examine_bag(bag)
        assert why in state.metadata_damage
        repair_bag(state)
        assert examine_bag(bag).is_finished
        assert messages_by_rosbags(bag) == state.files[0].counts.messages
    assert metadata.read_text() == original


def test_a_bag_that_begins_with_a_chunk_without_messages_is_found_and_mended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    with monkeypatch.context() as patch:  # as it was written before this was known
        patch.setattr(McapFile, "is_waiting", property(lambda file: bool(file._chunk.records)))
        bag = record(tmp_path / "bag")
    with pytest.raises(AssertionError, match="libmcap gives up"):
        assert_rosbag2_reads(bag)
    there = marks(bag)
    state = examine_bag(bag)
    assert len(state.damages()) == 1
    assert "holds no message: rosbag2 reads nothing of a file that begins with such" in state.damages()[0]
    repair_bag(state)
    assert examine_bag(bag).is_finished
    assert_rosbag2_reads(bag)
    assert marks(bag) == there == list(range(30))


@pytest.mark.parametrize("what", ["count", "time", "channel"])
def test_statistics_that_are_not_true_are_found_and_mended(tmp_path: Path, what: str):
    bag = record(tmp_path / "bag", count=5)
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as stream:
        told = make_reader(stream).get_summary().statistics
    data = file.read_bytes()
    at = data.rindex(struct.pack("<QH", told.message_count, told.schema_count))
    at += {"count": 0, "time": 26, "channel": 48}[what]
    torn = bytearray(data)
    torn[at] ^= 1
    torn[-12:-8] = bytes(4)  # no CRC of the summary
    file.write_bytes(torn)
    state = examine_bag(bag)
    assert "its statistics tell of" in state.damages()[0]
    repair_bag(state)
    assert_rosbag2_reads(bag)


def test_chunks_out_of_order_are_told_but_no_damage(tmp_path: Path):
    bag = record(tmp_path / "bag", count=5)
    (file,) = bag.glob("*.mcap")
    with file.open("wb") as stream:
        writer = Writer(stream, chunk_size=1, compression=CompressionType.NONE)
        writer.start("ros2", "somebody else")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        channel = writer.register_channel("/words", "cdr", schema)
        for number in (2, 1):
            writer.add_message(channel, number, bytes(50), number)
        writer.finish()
    assert not examine_bag(file).files[0].is_in_order


def test_a_bag_of_another_writer_is_repaired_too(tmp_path: Path):
    """Compressed chunks, and messages in no chunk."""
    for compression, chunked in ((CompressionType.ZSTD, True), (CompressionType.LZ4, True), (None, False)):
        file = tmp_path / f"{compression}.mcap"
        with file.open("wb") as stream:
            writer = Writer(
                stream,
                chunk_size=1000,
                compression=compression or CompressionType.NONE,
                use_chunking=chunked,
            )
            writer.start("ros2", "somebody else")
            schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
            channel = writer.register_channel("/words", "cdr", schema)
            for number in range(100):
                writer.add_message(channel, number, bytes(50), number)
            writer.finish()
        count = messages_by_mcap(file)
        os.truncate(file, file.stat().st_size // 2)
        state = examine_bag(file)
        repair_bag(state)
        assert 0 < messages_by_mcap(file) == state.files[0].counts.messages < count
        with pytest.raises(TraceError, match=r"found no topic of type .*but /words \(std_msgs/msg/String\)"):
            mauve_rt.trace.open(file)


def test_a_split_bag_is_one_bag_and_each_file_can_be_read_alone(tmp_path: Path):
    bag = record(tmp_path / "bag", count=60, split=Split(after_s=0, after_bytes=12_000))
    trace = mauve_rt.trace.open(bag)
    files = [file.path for file in trace.files]
    assert len(files) > 2
    assert examine_bag(bag).is_finished
    assert [int(row["time_ns"]) for row in trace.of("a")] == list(range(60))
    assert trace.lost == 0
    assert messages_by_rosbags(bag) == sum(messages_by_mcap(file) for file in files)
    assert_rosbag2_reads(bag)
    second = mauve_rt.trace.open(files[1])
    told, rows = second.losses["a"], second.of("a")
    assert told.written == told.received == len(rows) > 0
    assert told.lost == 0
    assert second.components == ("a", "b")
    assert [second.name(row["name"]) for row in rows] == [f"word {row['time_ns']}" for row in rows]


def test_a_recording_that_begins_later_counts_nothing_before_it_as_lost(tmp_path: Path):
    source = SyntheticSource(["a"])
    source.add("a", Kind.MARK, 1)
    source.drop("a", 1000)
    recorder = Recorder(source, tmp_path / "bag", node_name=NODE)
    recorder.start(discard=True)
    source.add("a", Kind.MARK, 2)
    source.drop("a", 3)
    source.add("a", Kind.MARK, 3)
    recorder.stop()
    trace = mauve_rt.trace.open(tmp_path / "bag")
    assert [int(row["time_ns"]) for row in trace.of("a")] == [2, 3]
    assert trace.losses["a"] == (5, 2, 3, 3)


RUN = """
    import os, sys, threading
    from pathlib import Path
    from mauve_rt import _kernel
    from mauve_rt.trace.recording.recorder import Recorder
    library, bag, acknowledged = sys.argv[1:]
    registry = _kernel.PluginRegistry()
    registry.load_library(library)
    architecture = _kernel.Architecture(registry)
    for index in range(8):
        architecture.add_component(
            f"c{index}", "executor_tests/CounterShell", "executor_tests/Counter", "executor_tests/CounterFsm"
        )
        architecture.set_property(f"c{index}", "period_ms", 1)
    architecture.configure()
    deployer = _kernel.Deployer(architecture)
    recorder = Recorder(deployer, Path(bag), node_name="/e", flush_period_s=0.005)
    flush, before = recorder._bag.flush, [0, 0]
    def acknowledge():
        flush()
        with open(acknowledged, "w") as file:  # what the bag holds for sure: all up to this drain
            file.write(f"{recorder._bag._last.written[0] - recorder._bag._last.dropped[0]}\\n")
        os.write(1, b"flushed\\n")  # print() of two threads mixes their lines
    recorder._bag.flush = acknowledge
    recorder.start()
    deployer.deploy()
    os.write(1, b"runs\\n")
    threading.Event().wait()
"""


def test_after_a_kill_everything_flushed_is_there(tmp_path: Path, plugin_prefix: Path):
    """Killed at random moments, recording 8 components at 1 kHz and flushing all the time."""
    library = plugin_prefix / "lib" / "libexecutor_tests.so"
    for number in range(KILLS):
        bag, acknowledged = tmp_path / f"bag_{number}", tmp_path / f"acknowledged_{number}"
        process = subprocess.Popen(
            [sys.executable, "-c", textwrap.dedent(RUN), library, bag, acknowledged], stdout=subprocess.PIPE
        )
        assert process.stdout is not None
        assert b"runs\n" in process.stdout
        for _ in range(random.randint(1, 60)):  # noqa: S311 - no cryptography
            assert process.stdout.readline() == b"flushed\n"
        process.kill()
        process.wait()
        process.stdout.close()
        trace = mauve_rt.trace.open(bag)
        rows = trace.of("c0")
        promised = int(acknowledged.read_text() or 0)
        assert len(rows) >= promised
        assert trace.lost == 0
        state = examine_bag(bag)
        repair_bag(state)
        assert (
            messages_by_rosbags(bag)
            == state.files[0].counts.messages
            == messages_by_mcap(bag / f"{bag.name}_0.mcap")
        )
        assert_rosbag2_reads(bag)
        assert len(mauve_rt.trace.open(bag).of("c0")) == len(rows)
