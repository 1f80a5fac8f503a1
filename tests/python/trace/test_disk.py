"""The keeper writes a bag's files: a kill of the recording process finds each write done, or not begun."""

import errno
import json
import os
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from bag_kills import KEEPER, TEXT, has_ended, kill_in_a_write, until
from bag_rules import assert_rosbag2_reads
from mcap.reader import make_reader
from preloaded import DiskCalls
from rosbags.rosbag2 import Reader

from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.disk import Disk, KeptDisk, Metadata, MetadataError
from mauve_rt.trace.bag.recorded import PackedChannel, ReceivedTopic, SentMessage, TopicQos
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.bag.writer import BagWriter
from mauve_rt.trace.errors import DiskError
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.recording.ledger import DROPPED_MESSAGES, INTERRUPTIONS, LEDGER, Entry
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.sources import TopicSource
from mauve_rt.trace.recording.synthetic import SyntheticSource


@pytest.fixture(autouse=True)
def installed_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    share = tmp_path / "prefix" / "share"
    shutil.copytree(Path(__file__).parents[3] / "mauve_msgs" / "msg", share / "mauve_msgs" / "msg")
    (share / "mauve_test_msgs" / "msg").mkdir(parents=True)
    (share / "mauve_test_msgs" / "msg" / "Text.msg").write_text("string data\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


class Kept:
    """A KeptDisk, and what it told."""

    def __init__(self, program: Path = KEEPER) -> None:
        self.told: list[str] = []
        self.disk = KeptDisk(program, on_error=self.told.append)

    @property
    def process(self) -> int:
        return self.disk._process


@pytest.fixture
def kept():
    kept = Kept()
    yield kept
    kept.disk.close()


@pytest.fixture
def file(tmp_path: Path):
    descriptor = os.open(tmp_path / "file", os.O_RDWR | os.O_CREAT)
    yield descriptor
    os.close(descriptor)


# ---- both ways to write are one to who uses them


@pytest.fixture(params=["direct", "kept"])
def disk(request: pytest.FixtureRequest):
    disk = Disk() if request.param == "direct" else Kept().disk
    yield disk
    disk.close()


def test_what_is_written_is_there(disk: Disk, file: int, tmp_path: Path):
    for data, offset, size, expected in [
        (b"0123456789", 0, None, b"0123456789"),
        (b"ab", 4, None, b"0123ab6789"),
        (b"", 0, 5, b"0123a"),
        (b"xyz", 4, 6, b"0123xy"),
        (bytes(9 << 20), 6, None, b"0123xy" + bytes(9 << 20)),  # more than the keeper keeps room for
        (b"!", 0, 3, b"!12"),
    ]:
        disk.write(file, (data,), offset, size=size)
        assert (tmp_path / "file").read_bytes() == expected


def test_a_refusal_is_an_error_that_says_which(disk: Disk, tmp_path: Path):
    (tmp_path / "file").touch()
    with (tmp_path / "file").open("rb") as file, pytest.raises(OSError, match="Bad file descriptor"):
        disk.write(file.fileno(), (b"data",), 0)
    with Path("/dev/full").open("wb") as file, pytest.raises(OSError, match="No space left") as failure:
        disk.write(file.fileno(), (b"data",), 0)
    assert failure.value.errno == errno.ENOSPC


def test_a_bag_is_the_same(disk: Disk, tmp_path: Path):
    with BagWriter(tmp_path / "bag", disk=disk) as bag:
        bag.add_topic("/words", TEXT)
        for number in range(9):
            bag.write("/words", number, bytes([0, 1, 0, 0, 2, 0, 0, 0, 48 + number, 0]))
            bag.flush()
            if number % 4 == 3:
                bag.split()
    with Reader(tmp_path / "bag") as reader:
        assert [data[8] - 48 for _, _, data in reader.messages()] == list(range(9))
    assert_rosbag2_reads(tmp_path / "bag")
    assert sorted(path.name for path in (tmp_path / "bag").iterdir()) == [
        *(f"bag_{number}.mcap" for number in range(3)),
        "metadata.yaml",
    ]


# ---- the keeper's life


def test_it_ends_with_the_bag(kept: Kept, tmp_path: Path):
    process = kept.process
    assert not has_ended(process)
    BagWriter(tmp_path / "bag", disk=kept.disk).close()
    assert has_ended(process)
    kept.disk.close()
    assert kept.told == []


def test_it_ends_with_a_bag_that_cannot_be_made(kept: Kept, tmp_path: Path):
    (tmp_path / "bag").mkdir()
    with pytest.raises(TraceError, match="exists already"):
        BagWriter(tmp_path / "bag", disk=kept.disk)
    assert kept.process == 0


def test_signals_do_not_end_it(kept: Kept, file: int, tmp_path: Path):
    assert os.getsid(kept.process) == kept.process, "what ends the session of ours does not reach it"
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):
        os.kill(kept.process, number)
    kept.disk.write(file, (b"data",), 0)
    assert (tmp_path / "file").read_bytes() == b"data"
    assert kept.told == []


def test_where_it_is_gone_the_process_writes_itself_and_says_so_once(kept: Kept, file: int, tmp_path: Path):
    kept.disk.write(file, (b"one",), 0)
    os.kill(kept.process, signal.SIGKILL)
    until(lambda: has_ended(kept.process), "its end")
    kept.disk.write(file, (b"two",), 3)
    kept.disk.write(file, (b"three",), 6, size=9)
    assert (tmp_path / "file").read_bytes() == b"onetwothr"
    assert len(kept.told) == 1
    assert "the keeper of the bag is gone" in kept.told[0]
    assert "a kill inside of a write can tear the bag" in kept.told[0]


def test_where_it_cannot_be_started_the_process_writes_itself_and_says_so(tmp_path: Path, file: int):
    kept = Kept(tmp_path / "nowhere")
    kept.disk.write(file, (b"data",), 0)
    assert (tmp_path / "file").read_bytes() == b"data"
    why = f"{tmp_path / 'nowhere'} cannot be started (No such file or directory)"
    assert kept.told == [f"{why}: from here on a kill inside of a write can tear the bag"]


def test_it_takes_nothing_of_its_process(kept: Kept, file: int):
    """No pipe of it stays open, and no folder in use."""
    kept.disk.write(file, (b"it has begun",), 0, sync=True)
    held = {path.readlink() for path in Path(f"/proc/{kept.process}/fd").iterdir()}
    assert {str(path).partition(":")[0] for path in held} == {"/dev/null", "socket", "/memfd"}
    assert Path(f"/proc/{kept.process}/cwd").readlink() == Path("/")


def test_a_disk_that_stands_still_holds_up_no_recorder(tmp_path: Path):
    source = SyntheticSource(["c"])
    recorder = Recorder(source, tmp_path / "bag", node_name="/executor", queue_bytes=1000, keeper=KEEPER)
    process = recorder._bag._bag._disk._process
    recorder.start()
    os.kill(process, signal.SIGSTOP)
    try:
        until(lambda: not record(recorder), "the queue to be full")
        assert recorder.dropped_messages > 0
        assert not recorder.stop()
        assert not recorder.is_closed, "it waits for the disk still"
    finally:
        os.kill(process, signal.SIGCONT)
    until(lambda: recorder.is_closed, "its end")
    until(lambda: has_ended(process), "the keeper's end")
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == recorder.message_count


# ---- a power loss: what is on the disk, not only in memory


@pytest.fixture
def calls(tmp_path: Path) -> DiskCalls:
    return DiskCalls(KEEPER, tmp_path)


def recorded(tmp_path: Path, calls: DiskCalls, **options: Any) -> Recorder:
    source = SyntheticSource(["c"])
    return Recorder(source, tmp_path / "bag", node_name="/executor", keeper=calls.keeper, **options)


def test_what_is_written_is_on_the_disk_each_second(tmp_path: Path, calls: DiskCalls):
    recorder = recorded(tmp_path, calls, flush_period_s=0.05)
    created = [*calls.seen()]
    assert "fdatasync bag_0.mcap" in created or "fdatasync .bag_0.mcap.new" in created
    recorder.start()
    synced = time.monotonic()
    for count in range(1, 4):
        until(lambda: calls.seen()[len(created) :].count("fdatasync bag_0.mcap") >= count, "a sync")  # noqa: B023
    assert time.monotonic() - synced > 2, "not at each flush"
    recorder.stop()
    seen = [call for call in calls.seen()[len(created) :] if call.startswith(("fdatasync", "fsync"))]
    in_a_flush = ["fdatasync bag_0.mcap", "fdatasync .metadata.yaml.new", "fsync bag"]
    between = ["fdatasync bag_0.mcap", "fdatasync metadata.yaml", "fsync bag"]
    syncs = [seen[place : place + 3] for place in range(0, len(seen), 3)]
    assert all(sync in (in_a_flush, between) for sync in syncs), "the file is on the disk first"
    assert calls.seen().count("renameat bag") > 3 * len(syncs)


def test_what_is_written_last_is_on_the_disk_a_second_later(tmp_path: Path, calls: DiskCalls):
    file = os.open(tmp_path / "file", os.O_RDWR | os.O_CREAT)
    kept = Kept(calls.keeper)
    kept.disk.write(file, (b"data",), 0)
    assert calls.seen() == ["pwrite file"]
    until(lambda: calls.seen() == ["pwrite file", "fdatasync file"], "a sync without another write")
    kept.disk.write(file, (b"data",), 0)
    kept.disk.close()
    until(lambda: calls.seen()[2:] == ["pwrite file", "fdatasync file"], "a sync at the end")
    os.close(file)


def test_a_split_and_an_end_are_on_the_disk(tmp_path: Path, calls: DiskCalls):
    bag = BagWriter(tmp_path / "bag", disk=Kept(calls.keeper).disk)
    bag.add_topic("/words", TEXT)
    for name, end in (("bag_0.mcap", bag.split), ("bag_1.mcap", bag.close)):
        bag.write("/words", 1, bytes([0, 1, 0, 0, 2, 0, 0, 0, 48, 0]))
        before = len(calls.seen())
        end()
        seen = calls.seen()[before:]
        assert seen[: seen.index("fsync bag") + 1] == [
            f"pwrite {name}",
            f"fdatasync {name}",
            "pwrite .metadata.yaml.new",
            "fdatasync .metadata.yaml.new",
            "renameat bag",
            "fsync bag",
        ]


def test_a_disk_that_cannot_sync_ends_the_recording(tmp_path: Path, calls: DiskCalls):
    errors: list[str] = []
    recorder = recorded(tmp_path, calls, on_error=errors.append)
    recorder.start()
    until(lambda: recorder.message_count > 0, "a flush")
    calls.fail("fdatasync", errno.EIO)
    until(lambda: not recorder.recording, "its end")
    assert recorder.stop()
    assert "Input/output error" in errors[0]


# ---- a disk that refuses to write: what was lost is in the bag


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 400 kB."""
    place = tmp_path / "small"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "none", str(place)]
    if subprocess.run(mount, check=False, capture_output=True, timeout=60).returncode != 0:
        pytest.skip("no rights to mount a small file system")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True, timeout=60)


def text_of(size: int) -> bytes:
    return bytes([0, 1, 0, 0]) + size.to_bytes(4, "little") + b"x" * (size - 1) + bytes(1)


class Fed:
    """A recorder that a test gives records and messages, and what became of them by its own count."""

    def __init__(
        self, directory: Path, keeper: Path | None, *, waits: bool, topics: TopicSource | None = None
    ) -> None:
        self.errors: list[str] = []
        self.source = SyntheticSource(["c"])
        self.recorder = Recorder(
            self.source,
            directory,
            node_name="/executor",
            keeper=keeper,
            flush_period_s=0.02,
            on_error=self.errors.append,
            waits_for_room=waits,
            topics=topics,
        )
        self.messages = 0
        self.recorder.start()

    @property
    def records(self) -> int:
        """What the recorder has taken."""
        return self.source._written[0] - len(self.source._waiting)

    def feed(self) -> None:
        """One record, one message of 3 kB."""
        now = self.source._written[0]
        self.source.add("c", Kind.MARK, now)
        if self.recorder.record("/words", TEXT, text_of(3000), monotonic_ns=now):
            self.messages += 1
        time.sleep(0.01)

    def is_refused(self) -> bool:
        """Whether the disk refused to write, after more was fed."""
        self.feed()
        return bool(self.errors)

    def assert_told(self, reason: str, *, count: int = 1) -> None:
        """The bag tells how much of what was fed is not in it, and why."""
        bag = self.recorder.directory
        state = examine_bag(bag)
        assert state.damages() == []
        assert_rosbag2_reads(bag)
        trace = open_trace(bag)
        recorded = sum(1 for _ in trace.messages("/words"))
        ledger = json.loads(state.custom_data[LEDGER])["/words"]
        assert ledger["received"] >= self.messages
        assert ledger["received"] - ledger["lost"] == recorded
        assert int(state.custom_data[DROPPED_MESSAGES]) == ledger["lost"] > 0
        told = json.loads(state.custom_data[INTERRUPTIONS])
        assert len(told) == count
        assert all(reason in one["reason"] for one in told)
        assert sum(one["records"] for one in told) == self.records - len(trace.of("c"))
        losses = [finding.text for finding in check_bag(bag) if finding.is_loss]
        assert any(reason in text for text in losses)


@pytest.mark.parametrize("keeper", [None, KEEPER], ids=["direct", "kept"])
def test_a_full_disk_leaves_its_losses_in_the_bag(small_disk: Path, keeper: Path | None):
    fed = Fed(small_disk / "bag", keeper, waits=False)
    until(fed.is_refused, "the disk to be full")
    until(lambda: not fed.recorder.recording, "the end")
    fed.recorder.stop()
    assert len(fed.errors) == 1
    assert "recording stopped" in fed.errors[0]
    fed.assert_told("No space left on device")
    (one,) = json.loads(examine_bag(small_disk / "bag").custom_data[INTERRUPTIONS])
    assert one["until_ns"] == 0
    held = {path.name for path in (small_disk / "bag").iterdir()}
    assert held == {"bag_0.mcap", "metadata.yaml"}


def test_a_limit_of_file_size_leaves_its_losses_in_the_bag(tmp_path: Path):
    fed = Fed(tmp_path / "bag", KEEPER, waits=False)
    until(lambda: fed.recorder.message_count > 3, "flushes")
    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.prlimit(keeper_of(fed.recorder), resource.RLIMIT_FSIZE, (200_000, hard))
    until(fed.is_refused, "the limit")
    until(lambda: not fed.recorder.recording, "the end")
    fed.recorder.stop()
    fed.assert_told("File too large")


def test_a_recording_goes_on_when_the_disk_has_room_again(small_disk: Path):
    (small_disk / "in_the_way").write_bytes(bytes(250_000))
    fed = Fed(small_disk / "bag", KEEPER, waits=True)
    until(fed.is_refused, "the disk to be full")
    assert "recording paused until the disk has room again" in fed.recorder.error
    assert fed.recorder.recording
    for _ in range(20):
        fed.feed()
    at_the_pause = [file.name for file in (small_disk / "bag").glob("*.mcap")]
    assert at_the_pause == ["bag_0.mcap"]
    (small_disk / "in_the_way").unlink()
    until(lambda: not fed.recorder.error, "the recording to go on")
    assert "recording goes on after" in fed.errors[-1]
    fed.feed()
    assert fed.recorder.stop()
    fed.assert_told("No space left on device")
    (one,) = json.loads(examine_bag(small_disk / "bag").custom_data[INTERRUPTIONS])
    assert one["until_ns"] > one["from_ns"]
    assert sorted(file.name for file in (small_disk / "bag").glob("*.mcap")) == ["bag_0.mcap", "bag_1.mcap"]
    assert open_trace(small_disk / "bag").of("c")["time_ns"][-1] == fed.records - 1


def test_a_recording_that_is_stopped_while_it_is_paused_leaves_its_losses(small_disk: Path):
    fed = Fed(small_disk / "bag", KEEPER, waits=True)
    until(fed.is_refused, "the disk to be full")
    for _ in range(20):
        fed.feed()
    assert fed.recorder.stop()
    fed.assert_told("No space left on device")


def test_a_write_error_that_ends_is_a_pause(tmp_path: Path, calls: DiskCalls):
    fed = Fed(tmp_path / "bag", calls.keeper, waits=True)
    until(lambda: fed.recorder.message_count > 3, "flushes")
    for _ in range(2):
        calls.fail("pwrite", errno.EIO)
        until(fed.is_refused, "the error")
        calls.succeed()
        until(lambda: not fed.recorder.error, "the recording to go on")
        fed.errors.clear()
        fed.feed()
        until(lambda before=fed.recorder.message_count: fed.recorder.message_count > before, "a flush")
    assert fed.recorder.stop()
    fed.assert_told("Input/output error", count=2)


class Refusing(Disk):
    """Refuses what is written once a file was, while `refuses`."""

    def __init__(self) -> None:
        super().__init__()
        self.refuses = self.has_written = False

    def write(
        self,
        descriptor: int,
        parts: Sequence[bytes | bytearray],
        offset: int,
        *,
        size: int | None = None,
        metadata: Metadata | None = None,
        sync: bool = False,
    ) -> None:
        if not self.refuses:
            super().write(descriptor, parts, offset, size=size, metadata=metadata, sync=sync)
            return
        if self.has_written:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        super().write(descriptor, parts, offset, size=size)
        self.has_written = True
        raise MetadataError(errno.EIO, os.strerror(errno.EIO))


@pytest.mark.parametrize("end", ["go_on", "room", "abort"])
def test_no_file_stays_newer_than_metadata_when_the_old_end_is_put_back_late(tmp_path: Path, end: str):
    disk = Refusing()
    bag = BagWriter(tmp_path / "bag", disk=disk, keeps_room=True)
    bag.add_topic("/words", TEXT)
    for number in range(2):
        bag.write("/words", number, text_of(10))
        bag.flush()
    disk.refuses = True
    bag.write("/words", 2, text_of(3000))
    with pytest.raises(DiskError, match="could not be put back either"):
        bag.flush()
    assert bag.drop_waiting() == {"/words": 1}
    with pytest.raises(DiskError):
        bag.go_on(lambda: None)
    assert not (tmp_path / "bag" / "bag_1.mcap").exists()
    assert examine_bag(tmp_path / "bag").damages(), "the disk holds more than was told"
    disk.refuses = False
    if end == "go_on":
        bag.go_on(lambda: bag.write("/words", 3, text_of(10)))
    if end == "room":
        bag.write_into_room()
        assert examine_bag(tmp_path / "bag").damages() == []
    bag.abort()
    state = examine_bag(tmp_path / "bag")
    assert state.damages() == []
    assert [one.messages for one in state.topics()] == [3 if end == "go_on" else 2]


class Others:
    """A topic of other nodes, latched: its messages are taken one by one."""

    topics = (ReceivedTopic("/others", TEXT, TopicQos(transient_local=True)),)
    numbered = True
    sizes = (1,)

    def __init__(self) -> None:
        self.received = 0
        self.is_stopped = False

    @property
    def counts(self) -> list[tuple[int, int, int]]:
        return [(self.received, 0, 0)]

    def take(self) -> "Others":
        self.received += 1
        return self

    def messages(self, _topic: int) -> list[tuple[int, bytes]]:
        return [(self.received, text_of(self.received))]

    def pack(self, _channels: object, **_places: int) -> tuple[memoryview, list[PackedChannel]]:
        return memoryview(b""), []

    def stop(self) -> None:
        self.is_stopped = True


def test_what_a_disk_refuses_of_topics_of_other_nodes_is_counted(tmp_path: Path, calls: DiskCalls):
    others = Others()
    fed = Fed(tmp_path / "bag", calls.keeper, waits=True, topics=others)
    until(lambda: fed.recorder.message_count > 3, "flushes")
    calls.fail("pwrite", errno.EIO)
    until(fed.is_refused, "the error")
    before = others.received
    until(lambda: others.received > before + 3, "messages that are lost")
    calls.succeed()
    until(lambda: not fed.recorder.error, "the recording to go on")
    assert fed.recorder.stop()
    assert others.is_stopped
    state = examine_bag(tmp_path / "bag")
    entry = Entry(**json.loads(state.custom_data[LEDGER])["/others"])
    assert entry.received == others.received
    assert entry.lost > 3
    recorded = sum(1 for _ in open_trace(tmp_path / "bag").messages("/others"))
    assert entry.recorded == recorded > 0
    assert fed.recorder.dropped_messages == int(state.custom_data[DROPPED_MESSAGES]) >= entry.lost


def keeper_of(recorder: Recorder) -> int:
    return recorder._bag._bag._disk._process


class TappedSource(SyntheticSource):
    """A source that counts who empties its rings, and a source of messages that serves one at a time."""

    period_ns = 0
    is_on = False
    number = 0

    def collect_trace(self, period_ns: int) -> None:
        self.period_ns = period_ns

    def keep_messages(self, *, on: bool) -> None:
        self.is_on = on

    def take_messages(self) -> list[SentMessage]:
        if not self.is_on:
            return []
        self.number += 1
        text = f"{self.number}".encode()
        data = bytes([0, 1, 0, 0, len(text) + 1, 0, 0, 0]) + text + bytes(1)
        return [SentMessage("/numbers", TEXT, data, self.number, None)]

    def dropped_messages(self) -> int:
        return 0


def test_a_hanging_disk_harms_no_later_recording(tmp_path: Path):
    source = TappedSource(["c"])

    def begun(name: str) -> Recorder:
        made = Recorder(source, tmp_path / name, node_name="/executor", keeper=KEEPER, messages=source)
        made.start()
        return made

    slow = begun("slow")
    keeper = slow._bag._bag._disk._process
    until(lambda: slow.message_count > 0, "a flush")
    os.kill(keeper, signal.SIGSTOP)
    try:
        source.add("c", Kind.MARK, 1)
        assert not slow.stop()
        assert (source.period_ns, source.is_on) == (0, False), "the tap is released, the disk hangs yet"
        last = source.number
        next_one = begun("next")
        source.add("c", Kind.MARK, 2)
    finally:
        os.kill(keeper, signal.SIGCONT)
    until(lambda: slow.is_closed, "the end of the slow one")
    assert source.period_ns > 0
    assert source.is_on
    source.add("c", Kind.MARK, 3)
    taken = source.number
    until(lambda: source.number > taken, "messages for the next one")
    assert next_one.stop()
    times = {}
    for name in ("slow", "next"):
        assert check_bag(tmp_path / name)[-1].kind == "note", "no architecture"
        trace = open_trace(tmp_path / name)
        times[name] = [int(row["time_ns"]) for row in trace.of("c")]
        numbers = [int(message.msg.data) for message in trace.messages("/numbers")]
        expected = range(1, last + 1) if name == "slow" else range(last + 1, source.number + 1)
        assert numbers == list(expected)
    assert times == {"slow": [1], "next": [2, 3]}


def record(recorder: Recorder) -> bool:
    return recorder.record("/words", TEXT, bytes([0, 1, 0, 0, 2, 0, 0, 0, 48, 0]), monotonic_ns=1)


# ---- kills


@pytest.mark.parametrize("split_every", [3, 1000])
@pytest.mark.parametrize("size", [16, 4096, 100_000, 2_000_000, 8_000_000])
def test_a_kill_in_a_write_leaves_whole_files(tmp_path: Path, size: int, split_every: int):
    for trial in range(3):
        bag = tmp_path / f"bag_{trial}"
        kill_in_a_write(bag, size=size, split_every=split_every, at=1 + trial)
        files = sorted(bag.glob("*.mcap"))
        assert files
        for file in files:
            with file.open("rb") as stream:
                by_mcap = sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages())
            with Reader(file) as reader:
                assert sum(1 for _ in reader.messages()) == by_mcap
        assert examine_bag(bag).damages() == [], "metadata.yaml is neither newer nor older"
        assert_rosbag2_reads(bag, was_killed=True)
        with Reader(bag) as reader:
            assert sum(1 for _ in reader.messages()) > trial, "what was flushed before is there"
