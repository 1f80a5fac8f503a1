"""Snapshots: the last seconds of a recording, kept in memory and written as whole bags on request."""

import errno
import threading
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from synthetic_traces import installed_messages

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.disk import Disk
from mauve_rt.trace.bag.recorded import ReceivedTopic, SentMessage, TopicQos, Window
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.recording.ledger import Entry, Snapshot, ledger_of, snapshot_of
from mauve_rt.trace.recording.recent import RecentBag, WrittenSnapshot
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

TEXT = "mauve_test_msgs/msg/Text"
LATCHED = TopicQos(depth=1, transient_local=True)
RECORDS = 10  # a second
SECOND_NS = 1_000_000_000


@pytest.fixture(autouse=True)
def _messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed_messages(tmp_path / "prefix", monkeypatch)
    monkeypatch.setattr("mauve_rt.trace.recording.recent._NEWEST_S", 0.0)  # the test flushes itself


def text(size: int = 6) -> bytes:
    return b"\0\1\0\0" + (size + 1).to_bytes(4, "little") + b"x" * size + b"\0"


class Batch:
    """Messages of a topic of other nodes, as the bridge receives them."""

    def __init__(self, times_ns: list[int]) -> None:
        self.sizes = [len(times_ns)]
        self._times_ns = times_ns

    def messages(self, topic: int) -> list[tuple[int, bytes]]:
        assert topic == 0
        return [(time_ns, text()) for time_ns in self._times_ns]


class Run:
    """A recording that the test flushes itself, a second of the trace each time."""

    def __init__(self, folder: Path, window: Window, **options: Any) -> None:
        self.source = SyntheticSource(["control"])
        self.errors: list[str] = []
        self.recent = RecentBag(
            self.source, folder, window=window, node_name="/e", on_error=self.errors.append, **options
        )
        self.received: Counter[str] = Counter()
        self.lost: Counter[str] = Counter()
        self.others = Entry(numbered=True)
        self.seconds = 0

    def second(self, *, size: int = 6, sent: list[SentMessage] | None = None, lose: int = 0) -> None:
        now_ns = self.seconds * SECOND_NS
        for number in range(RECORDS):
            self.source.add("control", Kind.MARK, now_ns + number, name="mark", a=self.seconds)
        self.source.now_ns = now_ns + RECORDS
        drain = self.source.drain_trace()
        messages = [SentMessage("/words", TEXT, text(size), now_ns, None), *(sent or [])]
        self.received += Counter(message.topic for message in messages)
        self.received["/words"] += lose
        self.lost["/words"] += lose
        self.others = self.others._replace(received=self.others.received + 2)
        self.recent.write(drain, messages, whole=True)
        topic = ReceivedTopic("/other", TEXT, TopicQos())
        self.recent.write_received(Batch([now_ns, now_ns + 1]), [topic], drain)
        self.recent.tell_ledger(self.received.copy(), self.lost.copy(), {"/other": self.others})
        self.recent.tell_dropped(self.lost.total())
        self.recent.flush()
        self.seconds += 1

    def snapshot(self, folder: Path) -> WrittenSnapshot:
        written = self.recent.snapshot(folder)
        assert written is not None
        assert written.wait(60)
        return written


def seconds_of(bag: Path) -> list[int]:
    return sorted({int(row["a"]) for row in mauve_rt.trace.open(bag).of("control")})


def kinds(bag: Path) -> set[str]:
    return {finding.kind for finding in check_bag(bag)}


def snapshot_in(bag: Path) -> Snapshot:
    found = snapshot_of(examine_bag(bag).custom_data)
    assert found is not None
    return found


def test_a_snapshot_is_a_whole_bag_of_the_last_seconds(tmp_path: Path) -> None:
    run = Run(tmp_path, Window(seconds=5))
    description = SentMessage("/description", TEXT, text(30), 0, LATCHED)
    for number in range(20):
        run.second(sent=[description] if number == 0 else None, lose=3 if number == 2 else 0)
    assert not list(tmp_path.glob("*.mcap"))
    written = run.snapshot(tmp_path / "now")
    assert (written.error, run.errors) == ("", [])
    assert seconds_of(tmp_path / "now") == [15, 16, 17, 18, 19]
    assert mauve_rt.trace.open(tmp_path / "now").lost == 0, "what came before the window is no loss"
    assert kinds(tmp_path / "now") == {"note"}
    ledger = ledger_of(examine_bag(tmp_path / "now").custom_data)
    assert ledger["/words"] == Entry(received=5)
    assert ledger["/other"] == Entry(received=10, numbered=True)
    assert ledger["/description"] == Entry(repeated=1)
    assert snapshot_in(tmp_path / "now").text == "snapshot of 5.0 s"
    assert snapshot_in(tmp_path / "now").is_complete
    with (tmp_path / "now" / "now_0.mcap").open("rb") as stream:
        by_mcap = Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())
    with AnyReader([tmp_path / "now"]) as reader:
        by_rosbags = {one.topic: one.msgcount for one in reader.connections if one.msgcount}
    assert by_mcap == by_rosbags
    assert {name: by_mcap[name] for name in ("/words", "/other", "/description")} == {
        "/words": 5,
        "/other": 10,
        "/description": 1,
    }
    assert written.messages == by_mcap.total()


def test_a_snapshot_may_be_written_again_and_again(tmp_path: Path) -> None:
    run = Run(tmp_path, Window(seconds=3))
    for _ in range(5):
        run.second()
    run.snapshot(tmp_path / "first")
    run.second()
    run.snapshot(tmp_path / "second")
    assert seconds_of(tmp_path / "first") == [2, 3, 4]
    assert seconds_of(tmp_path / "second") == [3, 4, 5]
    again = run.snapshot(tmp_path / "second")
    assert "exists already" in again.error
    assert run.errors == [f"snapshot: {again.error}"]
    assert seconds_of(tmp_path / "second") == [3, 4, 5]


def test_the_memory_is_bounded_and_the_bag_says_what_the_bound_cost(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    limit = 200_000
    run = Run(tmp_path, Window(seconds=50, max_bytes=limit))
    for _ in range(40):
        run.second(size=20_000)
    run.snapshot(tmp_path / "now")
    held = len(seconds_of(tmp_path / "now"))
    assert 5 <= held < 10
    definitions = 40_000  # of the messages, in each file
    assert sum(file.stat().st_size for file in (tmp_path / "now").glob("*.mcap")) < limit + definitions
    expected = f"snapshot of {held}.0 s: the memory (snapshot_bytes, 200,000) holds no more of 50 s"
    assert snapshot_in(tmp_path / "now").text == expected
    assert main(["trace", "check", str(tmp_path / "now")]) == 0
    assert f"note: {expected}" in capsys.readouterr().out


def test_one_flush_that_exceeds_the_memory_stays(tmp_path: Path) -> None:
    run = Run(tmp_path, Window(seconds=50, max_bytes=100_000))
    run.second()
    run.second(size=300_000)
    run.snapshot(tmp_path / "now")
    assert seconds_of(tmp_path / "now") == [1]


def test_losses_in_the_window_are_losses_of_the_snapshot(tmp_path: Path) -> None:
    run = Run(tmp_path, Window(seconds=3))
    for _ in range(5):
        run.second()
    run.second(lose=2, sent=[SentMessage("/strange", "no_package/msg/No", text(), 0, None)])
    run.source.drop("control", 4)
    run.second()
    run.snapshot(tmp_path / "now")
    ledger = ledger_of(examine_bag(tmp_path / "now").custom_data)
    assert ledger["/words"] == Entry(received=5, lost=2)
    assert ledger["/strange"] == Entry(received=1, lost=1)
    assert mauve_rt.trace.open(tmp_path / "now").losses["control"].lost == 4
    assert "topic /strange is not recorded" in run.errors[0]
    assert sorted(finding.text for finding in check_bag(tmp_path / "now") if finding.is_loss) == [
        (
            "component 'control': 4 of 34 records (11.76%) are missing: 4 found no room in its ring "
            "(trace_records in the architecture file), and the sequence numbers have gaps of 4"
        ),
        "topic /strange: 1 of 1 messages that came are not in the bag",
        "topic /words: 2 of 5 messages that came are not in the bag",
    ]


def test_nothing_to_write_yet_is_an_error(tmp_path: Path) -> None:
    run = Run(tmp_path, Window(seconds=3))
    assert "nothing in memory yet" in run.snapshot(tmp_path / "now").error
    assert not (tmp_path / "now").exists()


class HangingDisk:
    """Disk.write() that waits from the second call on, until it may go on."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.hangs, self.may_go_on = threading.Event(), threading.Event()
        self._write, self._calls = Disk.write, 0
        hanging = self

        def write(disk: Disk, *arguments: Any, **options: Any) -> None:
            hanging._calls += 1
            if hanging._calls == 3:
                hanging.hangs.set()
                assert hanging.may_go_on.wait(60)
            hanging._write(disk, *arguments, **options)

        monkeypatch.setattr(Disk, "write", write)


def test_a_disk_that_hangs_holds_up_its_own_snapshot_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Run(tmp_path, Window(seconds=3))
    run.second()
    disk = HangingDisk(monkeypatch)
    hanging = run.recent.snapshot(tmp_path / "hanging")
    assert hanging is not None
    assert disk.hangs.wait(60)
    assert not hanging.wait(0.01)
    assert run.recent.snapshot(tmp_path / "other") is None, "one at a time"
    run.second()
    assert run.recent.message_count == 8
    disk.may_go_on.set()
    assert hanging.wait(60)
    assert seconds_of(tmp_path / "hanging") == [0], "as of its request"
    assert seconds_of(run.snapshot(tmp_path / "later").directory) == [0, 1]


def test_a_disk_that_is_full_leaves_a_bag_that_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Run(tmp_path, Window(seconds=100))
    for _ in range(10):
        run.second(size=400_000)
    write, calls = Disk.write, []

    def fail(disk: Disk, *arguments: Any, **options: Any) -> None:
        calls.append(1)
        if len(calls) == 5:
            raise OSError(errno.ENOSPC, "No space left on device")
        write(disk, *arguments, **options)

    monkeypatch.setattr(Disk, "write", fail)
    written = run.snapshot(tmp_path / "now")
    assert "No space left on device" in written.error
    assert run.errors == [f"snapshot: {written.error}"]
    texts = [finding.text for finding in check_bag(tmp_path / "now") if finding.is_loss]
    assert any("the bag has its begin only" in one for one in texts), texts


def test_a_recorder_with_a_window_writes_nothing_but_snapshots(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mauve_rt.trace.recording.recent._NEWEST_S", 60.0)
    source = SyntheticSource(["control"])
    recorder = Recorder(
        source, tmp_path / "bags", node_name="/e", window=Window(seconds=60), flush_period_s=0.01
    )
    recorder.start()
    try:
        assert recorder.recent is not None
        recorder.record("/words", TEXT, text(), monotonic_ns=0)
        source.add("control", Kind.MARK, 1, name="mark", a=7)
        written = recorder.recent.snapshot(tmp_path / "bags" / "now")
        assert written is not None
        assert written.wait(60)
        assert written.error == ""
        assert seconds_of(tmp_path / "bags" / "now") == [7], "what came just before the request, too"
        assert recorder.recording
    finally:
        assert recorder.stop()
    assert [path.name for path in (tmp_path / "bags").iterdir()] == ["now"]
    assert recorder.error == ""


def test_snapshots_of_others_are_ignored() -> None:
    for other in ("3", "{}", '{"asked_s": "x"}', "no"):
        assert snapshot_of({"mauve_snapshot": other}) is None


def test_no_snapshot_without_a_folder_that_can_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    run = Run(tmp_path, Window(seconds=3))
    run.second()
    assert "cannot be created" in run.snapshot(tmp_path / "file" / "now").error
    with pytest.raises(TraceError):
        mauve_rt.trace.open(tmp_path / "file" / "now")
