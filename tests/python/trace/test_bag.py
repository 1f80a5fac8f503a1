"""A bag is a finished one at every flush, whatever happens in between."""

import inspect
import os
import random
import resource
import shutil
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import pytest
from bag_rules import assert_rosbag2_reads
from mcap.reader import make_reader
from mcap.records import Message, Metadata
from mcap.stream_reader import StreamReader
from rosbags.rosbag2 import Reader

from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.recorded import TopicQos
from mauve_rt.trace.bag.repair import examine_bag, repair_bag
from mauve_rt.trace.bag.writer import BagWriter

T0 = 1_700_000_000_000_000_000
TEXT = "mauve_test_msgs/msg/Text"


pytestmark = pytest.mark.usefixtures("test_messages")


def text(number: int):
    word = f"message {number}".encode() + b"\0"
    return b"\0\1\0\0" + len(word).to_bytes(4, "little") + word


def write(bag: BagWriter, numbers: Iterable[int], topic: str = "/robot/words"):
    bag.add_topic(topic, TEXT)
    for number in numbers:
        bag.write(topic, T0 + number, text(number))


def read(directory: Path, *, was_killed: bool = False):
    """Numbers of the messages by three readers, which must agree."""
    with Reader(directory) as reader:
        by_folder = [(connection.topic, time - T0) for connection, time, _ in reader.messages()]
    (file,) = directory.glob("*.mcap")
    with Reader(file) as reader:
        by_file = [(connection.topic, time - T0) for connection, time, _ in reader.messages()]
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        indexed = [(channel.topic, message.log_time - T0) for _, channel, message in reader.iter_messages()]
        stream.seek(0)
        records = StreamReader(stream, validate_crcs=True).records
        scanned = sum(isinstance(record, Message) for record in records)
    assert by_folder == by_file == indexed
    assert scanned == len(indexed)
    if indexed:
        assert_rosbag2_reads(directory, was_killed=was_killed)
    return indexed


def test_every_flush_leaves_a_finished_bag(tmp_path: Path):
    directory = tmp_path / "bag"
    bag = BagWriter(directory)
    assert read(directory) == []
    written = []
    for flush in range(12):
        numbers = range(10 * flush, 10 * flush + flush)
        write(bag, numbers, f"/robot/topic_{flush // 4}")
        written += [(f"/robot/topic_{flush // 4}", number) for number in numbers]
        bag.flush()
        copy = tmp_path / f"copy_{flush}"
        shutil.copytree(directory, copy)
        assert read(copy) == written
    bag.close()
    assert read(directory) == written


def test_metadata_tells_what_the_file_holds(tmp_path: Path):
    with BagWriter(tmp_path / "bag") as bag:
        write(bag, [5, 3, 9])
        bag.add_topic("/robot/n", "mauve_test_msgs/msg/Number", qos=TopicQos(depth=1, transient_local=True))
        bag.set_custom_data("key", 'a "word"')
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 3
        assert (reader.start_time, reader.duration) == (T0 + 3, 6 + 1)
        assert reader.ros_distro == "jazzy"
        assert reader.storage.metadata.custom == {"key": 'a "word"'}
        topics = reader.topics
        assert topics["/robot/words"].msgtype == TEXT
        assert topics["/robot/words"].msgcount == 3
        assert topics["/robot/words"].msgdef.data == "string data\n"
        (qos,) = topics["/robot/n"].connections[0].ext.offered_qos_profiles
        assert (qos.depth, qos.durability.name, qos.reliability.name) == (1, "TRANSIENT_LOCAL", "RELIABLE")


def records_of(file: Path) -> dict[str, dict[str, str]]:
    """Metadata records, as mcap finds them by the summary and, the same, from the begin."""
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        indexed = {one.name: one.metadata for one in reader.iter_metadata()}
        statistics = reader.get_summary().statistics
        stream.seek(0)
        records = StreamReader(stream, validate_crcs=True).records
        found = {one.name: one.metadata for one in records if isinstance(one, Metadata)}
    assert indexed == found
    assert statistics.metadata_count == len(found)
    return found


def test_each_file_tells_the_custom_data_as_of_its_last_flush(tmp_path: Path):
    directory = tmp_path / "bag"
    bag = BagWriter(directory)
    write(bag, [1])
    bag.flush()
    assert records_of(directory / "bag_0.mcap") == {}
    for number in range(3):
        write(bag, [2 + number])
        bag.set_custom_data("count", str(number))
        bag.flush()
        assert records_of(directory / "bag_0.mcap") == {"mauve_rt": {"count": str(number)}}
        assert examine_bag(directory).custom_data == {"count": str(number)}
    bag.split()
    bag.set_custom_data("count", "many")
    write(bag, [9])
    bag.close()
    told = [records_of(directory / f"bag_{number}.mcap")["mauve_rt"]["count"] for number in range(2)]
    assert told == ["2", "many"]
    assert examine_bag(directory).custom_data == {"count": "many"}
    assert examine_bag(directory / "bag_0.mcap").custom_data == {"count": "2"}, "a file by itself, too"
    assert_rosbag2_reads(directory)


def test_a_file_knows_more_than_metadata_that_is_older(tmp_path: Path):
    directory = tmp_path / "bag"
    bag = BagWriter(directory)
    bag.set_custom_data("lost", "0")
    write(bag, [1])
    bag.flush()
    older = (directory / "metadata.yaml").read_bytes()
    bag.set_custom_data("lost", "7")
    write(bag, [2])
    bag.close()
    (directory / "metadata.yaml").write_bytes(older)  # as of a kill between the two
    state = examine_bag(directory)
    assert state.custom_data == {"lost": "7"}
    repair_bag(state)
    assert examine_bag(directory).custom_data == {"lost": "7"}
    assert read(directory)[-1][1] == 2


def test_metadata_older_than_the_file_still_opens(tmp_path: Path):
    directory = tmp_path / "bag"
    bag = BagWriter(directory)
    write(bag, range(3))
    bag.flush()
    older = (directory / "metadata.yaml").read_bytes()
    write(bag, range(3, 8))
    write(bag, range(20, 22), "/robot/later")
    bag.flush()
    assert_rosbag2_reads(directory)
    (directory / "metadata.yaml").write_bytes(older)  # as a kill between the two writes leaves it
    with Reader(directory) as reader:
        assert [time - T0 for _, time, _ in reader.messages()] == list(range(8))
    with Reader(directory / "bag_0.mcap") as reader:  # the file itself knows all
        assert len(list(reader.messages())) == 10


def test_an_existing_folder_is_refused(tmp_path: Path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(TraceError, match="bag: exists already; remove it or choose another name"):
        BagWriter(tmp_path / "bag")
    assert list((tmp_path / "bag").iterdir()) == []


def test_what_a_kill_left_beside_blocks_no_bag(tmp_path: Path):
    """Also of a process with the same number: every container has a process 1."""
    (tmp_path / f".bag.{os.getpid()}").mkdir()
    with BagWriter(tmp_path / "bag") as bag:
        write(bag, range(3))
    assert len(read(tmp_path / "bag")) == 3


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TraceError, match="cannot be created"):
        BagWriter(tmp_path / "file" / "bag")


def test_what_was_not_flushed_is_not_in_an_aborted_bag(tmp_path: Path):
    bag = BagWriter(tmp_path / "bag")
    write(bag, range(3))
    bag.flush()
    write(bag, range(3, 5))
    bag.abort()
    bag.abort()
    assert len(read(tmp_path / "bag")) == 3


def test_an_exception_aborts(tmp_path: Path):
    def interrupted() -> None:
        with BagWriter(tmp_path / "bag") as bag:
            write(bag, range(3))
            raise RuntimeError

    with pytest.raises(RuntimeError):
        interrupted()
    assert read(tmp_path / "bag") == []


def test_a_topic_has_one_type_and_an_absolute_name(tmp_path: Path):
    with BagWriter(tmp_path / "bag") as bag:
        bag.add_topic("/a", TEXT)
        bag.add_topic("/a", TEXT)
        with pytest.raises(TraceError, match=r"/a: is mauve_test_msgs/msg/Text in this bag"):
            bag.add_topic("/a", "mauve_test_msgs/msg/Number")
        with pytest.raises(TraceError, match=r"absolute name, e.g. /robot_1/b"):
            bag.add_topic("b", TEXT)
        with pytest.raises(TraceError, match="call add_topic first"):
            bag.write("/c", T0, text(0))


def test_a_full_disk_leaves_the_bag_as_the_flush_before_left_it(tmp_path: Path):
    directory = tmp_path / "bag"
    bag = BagWriter(directory)
    write(bag, range(100))
    bag.flush()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    write(bag, range(100, 5000))
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))  # the write gets halfway
    try:
        with pytest.raises(
            TraceError, match=r"File too large.*complete up to the flush before, 100 messages"
        ):
            bag.flush()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert len(read(directory)) == 100
    bag.flush()  # room again: nothing was lost
    assert len(read(directory)) == 5000
    bag.close()


def test_no_chunk_is_written_for_topics_alone(tmp_path: Path):
    """libmcap 1.3, by which Jazzy's rosbag2 reads, gives up a file that begins with such a chunk."""
    directory = tmp_path / "bag"
    with BagWriter(directory) as bag:
        bag.add_topic("/robot/words", TEXT)
        bag.flush()
        assert "/robot/words" in (directory / "metadata.yaml").read_text()
        write(bag, [1])
        bag.flush()
        bag.add_topic("/robot/later", "mauve_test_msgs/msg/Number")
        bag.flush()
        write(bag, [2])
        bag.split()
        bag.flush()
        write(bag, [3])
        bag.flush()
    assert_rosbag2_reads(directory)


def test_a_message_that_comes_late_does_not_put_chunks_out_of_order(tmp_path: Path):
    with BagWriter(tmp_path / "bag") as bag:
        write(bag, [10, 20])
        bag.flush()
        bag.write("/robot/words", T0 + 15, text(15), publish_time_ns=T0 + 15)
        bag.split()
        bag.write("/robot/words", T0 + 5, text(5), publish_time_ns=T0 + 5)
    assert_rosbag2_reads(tmp_path / "bag")
    found = []
    for file in sorted((tmp_path / "bag").glob("*.mcap")):
        with file.open("rb") as stream:
            for _, _, message in make_reader(stream).iter_messages():
                found.append((message.log_time - T0, message.publish_time - T0))
    assert found == [(10, 10), (20, 20), (20, 15), (20, 5)]


def test_a_file_without_messages_is_none_of_the_bag(tmp_path: Path):
    """rosbag2 looks for a time by the files' times: past a file without one it does not find its way."""
    for end in (BagWriter.close, BagWriter.abort):
        directory = tmp_path / end.__name__
        bag = BagWriter(directory)
        write(bag, [1, 2])
        bag.split()
        bag.flush()
        assert_rosbag2_reads(directory)
        assert len(list(directory.glob("*.mcap"))) == 2
        end(bag)
        assert_rosbag2_reads(directory)
        assert len(list(directory.glob("*.mcap"))) == 1


@pytest.fixture
def small_disk(tmp_path: Path):
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=300k", "none", disk]
    if os.geteuid() or subprocess.run(mount, check=False, stderr=subprocess.DEVNULL).returncode:
        pytest.skip("needs the right to mount a file system of 300 kB")
    yield disk
    subprocess.run(["umount", disk], check=True)


@pytest.mark.parametrize("size", [10, 900, 3500])  # of what is flushed: the metadata or the file does not fit
@pytest.mark.parametrize("splits", [False, True])
def test_what_a_full_disk_leaves_tells_what_it_holds(small_disk: Path, size: int, *, splits: bool):
    bag = BagWriter(small_disk / "bag")
    bag.add_topic("/robot/words", TEXT)

    def fill() -> None:
        for number in range(100_000):
            bag.write("/robot/words", T0 + number, text(number) + bytes(size))
            bag.flush()
            if splits and number % 7 == 6:
                bag.split()

    with pytest.raises(TraceError, match="No space left"):
        fill()
    bag.abort()
    held = sorted(path.name for path in (small_disk / "bag").iterdir())
    assert [name for name in held if not name.endswith(".mcap")] == ["metadata.yaml"], "nothing half-written"
    assert_rosbag2_reads(small_disk / "bag")


def test_when_the_metadata_does_not_fit_what_was_flushed_waits_again(
    tmp_path: Path,
):
    bag = BagWriter(tmp_path / "bag")
    write(bag, [1])
    bag.flush()
    write(bag, [2], "/robot/later")
    in_the_way = tmp_path / "bag" / ".metadata.yaml.new"
    in_the_way.mkdir()
    with pytest.raises(TraceError, match=r"cannot be written \(Is a directory\); .* 1 message"):
        bag.flush()
    in_the_way.rmdir()
    assert len(read(tmp_path / "bag")) == 1
    bag.flush()  # room again
    assert len(read(tmp_path / "bag")) == 2
    bag.set_custom_data("key", "value")
    in_the_way.mkdir()
    with pytest.raises(TraceError, match="2 messages"):
        bag.flush()
    in_the_way.rmdir()
    assert len(read(tmp_path / "bag")) == 2, "nothing was flushed, so nothing is taken back"
    bag.close()


WRITING = """
import sys, time
from pathlib import Path
from mauve_rt.trace.bag.writer import BagWriter
bag = BagWriter(Path(sys.argv[1]))
bag.add_topic("/robot/words", "mauve_test_msgs/msg/Text")
number = 0
while True:
    for _ in range(20):
        bag.write("/robot/words", T0 + number, text(number))
        number += 1
    bag.flush()
    print(number, flush=True)
    time.sleep(0.02)
"""


def test_kill_9_at_any_moment_loses_nothing_that_was_flushed(tmp_path: Path):
    program = f"import sys\nsys.path[:0] = {sys.path}\nT0 = {T0}\n{inspect.getsource(text)}\n{WRITING}"
    moments = random.Random(1)  # noqa: S311 - not for secrets
    for trial in range(20):
        directory = tmp_path / f"bag_{trial}"
        command = [sys.executable, "-c", program, directory]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
            told = [child.stdout.readline()]
            time.sleep(moments.uniform(0, 0.3))
            child.kill()
            told += child.stdout.readlines()
        flushed = int([line for line in told if line.endswith("\n")][-1])
        numbers = [number for _, number in read(directory, was_killed=True)]
        assert numbers == list(range(len(numbers)))
        assert len(numbers) in (flushed, flushed + 20)  # killed between the flush and telling of it
