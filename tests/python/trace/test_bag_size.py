"""A bag of limited size: the oldest files go, the rest is a whole bag, and what went is reported."""

import re
import shutil
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from synthetic_traces import installed_messages

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.deletion import DELETED, Deleted, deleted_of
from mauve_rt.trace.bag.disk import Disk, Metadata
from mauve_rt.trace.bag.recorded import SentMessage, Split, TopicQos
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.bag.snapshot import snapshot_bag
from mauve_rt.trace.bag.writer import BagWriter
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.recording.ledger import ledger_of
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.recording.trace_bag import TraceBag

TEXT = "mauve_test_msgs/msg/Text"
HELLO = b"\0\1\0\0" + (1001).to_bytes(4, "little") + b"x" * 1000 + b"\0"
LATCHED = TopicQos(depth=1, transient_local=True)
FLUSHES, RECORDS, MESSAGES = 60, 10, 5
LIMIT = 160_000


@pytest.fixture(autouse=True)
def _messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed_messages(tmp_path / "prefix", monkeypatch)


class Recording:
    """A bag that the test flushes itself, a second of the trace each time."""

    def __init__(self, folder: Path, split: Split) -> None:
        self.source = SyntheticSource(["control"])
        self.bag = TraceBag(self.source, folder, node_name="/e", on_error=pytest.fail, split=split)
        self.received: Counter[str] = Counter()
        self.flushes = 0

    def flush(self) -> None:
        self.write()
        self.bag.flush()

    def write(self) -> None:
        begin_ns = self.flushes * 1_000_000_000
        for number in range(RECORDS):
            self.source.add("control", Kind.MARK, begin_ns + number, name="mark", a=self.flushes)
        sent = [SentMessage("/words", TEXT, HELLO, begin_ns, None)] * MESSAGES
        if not self.flushes:
            sent.append(SentMessage("/description", TEXT, HELLO, begin_ns, LATCHED))
        self.received += Counter(message.topic for message in sent)
        self.bag.write(self.source.drain_trace(), sent, whole=True)
        self.bag.tell_ledger(self.received, {})
        self.flushes += 1


def record(folder: Path, split: Split, *, flushes: int = FLUSHES) -> Path:
    recording = Recording(folder, split)
    for _ in range(flushes):
        recording.flush()
    recording.bag.close()
    return folder


def size_of(bag: Path) -> int:
    return sum(file.stat().st_size for file in bag.glob("*.mcap"))


def named(bag: Path) -> list[str]:
    return yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"][
        "relative_file_paths"
    ]


def files_of(bag: Path) -> list[str]:
    return sorted((file.name for file in bag.glob("*.mcap")), key=lambda name: (len(name), name))


def test_the_oldest_files_are_deleted_and_the_rest_is_a_whole_bag(tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", Split(after_s=0, after_bytes=40_000, max_bytes=LIMIT))
    assert named(bag) == files_of(bag)
    assert "bag_0.mcap" not in named(bag)
    assert size_of(record(tmp_path / "all", Split(after_s=0, after_bytes=40_000))) > 2 * LIMIT
    assert size_of(bag) < LIMIT + 40_000, "a flush more than the limit at most"
    assert size_of(bag) > LIMIT - 40_000, "and no more than needed is deleted"
    assert {finding.kind for finding in check_bag(bag)} == {"note"}
    trace = mauve_rt.trace.open(bag)
    kept = [int(row["a"]) for row in trace.of("control")]
    assert kept[-1] == FLUSHES - 1
    assert kept == sorted(kept), "the newest ones, without a gap"
    assert len(kept) == RECORDS * len(set(kept)) < RECORDS * FLUSHES
    assert trace.lost == 0


def test_what_was_deleted_is_reported_and_is_no_loss(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = record(tmp_path / "bag", Split(after_s=0, after_bytes=40_000, max_bytes=LIMIT))
    trace = mauve_rt.trace.open(bag)
    (deleted,) = trace.deleted
    assert deleted.records == RECORDS * FLUSHES - len(trace.of("control")) > 0
    words = ledger_of(examine_bag(bag).custom_data)["/words"]
    in_bag = trace.topics["/words"][1]
    assert (words.received, words.lost, words.recorded) == (MESSAGES * FLUSHES, 0, in_bag)
    assert words.deleted == MESSAGES * FLUSHES - in_bag
    first_s = min(int(row["a"]) for row in trace.of("control")) - 1
    expected = f"the first {first_s}.0 s were deleted by max_size_bytes (160,000): "
    assert deleted.text.startswith(expected)
    assert main(["trace", "check", str(bag)]) == 0
    shown = capsys.readouterr().out
    assert f"note: {expected}" in shown
    assert "lost" not in re.sub("whole, nothing.*", "", shown)
    assert main(["trace", "info", str(bag)]) == 0
    assert "were deleted by max_size_bytes" in " ".join(capsys.readouterr().out.split())
    assert main(["report", str(bag), "--out", str(tmp_path / "page.html")]) == 0
    assert f"<p>T{expected[1:]}" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_a_long_time_is_shown_in_minutes() -> None:
    assert Deleted(5, from_ns=0, until_ns=723_000_000_000).text.startswith(
        "the first 12 min 3 s were deleted"
    )


def test_each_file_that_is_left_can_be_read_alone(tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", Split(after_s=0, after_bytes=40_000, max_bytes=LIMIT))
    for name in named(bag):
        with (bag / name).open("rb") as stream:
            by_mcap = Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())
        with Reader(bag / name) as reader:
            by_rosbags = Counter(connection.topic for connection, _, _ in reader.messages())
        assert by_mcap == by_rosbags
        assert by_mcap["/description"] == 1, "what a latched topic said last"
        assert by_mcap["/e/trace/names"] == 1
        assert mauve_rt.trace.open(bag / name).components == ("control",)
    with Reader(bag) as reader:
        assert reader.message_count == sum(count for _, count in mauve_rt.trace.open(bag).topics.values())


def test_a_limit_alone_makes_files_of_a_quarter(tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", Split(after_s=0, max_bytes=LIMIT))
    sizes = [(bag / name).stat().st_size for name in named(bag)]
    assert 3 <= len(sizes) <= 5
    assert max(sizes) < LIMIT // 2


def test_no_file_is_missing_that_metadata_names_at_any_deletion(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A kill right before a deletion leaves a bag that every reader opens, and a repair ends the deletion."""
    seen: list[Path] = []
    unlink = Path.unlink

    def unlinks(path: Path, *, missing_ok: bool = False) -> None:
        if path.suffix == ".mcap" and path.parent.name == "bag":
            copy = tmp_path / f"killed_{len(seen)}"
            shutil.copytree(path.parent, copy)
            seen.append(copy)
        unlink(path, missing_ok=missing_ok)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", unlinks)
        record(tmp_path / "bag", Split(after_s=0, after_bytes=40_000, max_bytes=LIMIT))
    assert len(seen) > 3
    for killed in seen:
        (left,) = set(files_of(killed)) - set(named(killed))
        assert set(named(killed)) < set(files_of(killed))
        findings = check_bag(killed)
        assert {finding.kind for finding in findings} == {"note"}
        assert any(finding.text.startswith(f"{left}: no longer part of the bag") for finding in findings)
        with Reader(killed) as reader:
            assert list(reader.messages())
        assert main(["trace", "repair", str(killed)]) == 0
        assert named(killed) == files_of(killed)
        assert {finding.kind for finding in check_bag(killed)} == {"note"}
        assert main(["trace", "repair", str(killed)]) == 0


def test_a_repair_deletes_nothing_that_metadata_names(tmp_path: Path) -> None:
    """Custom data that somebody else wrote costs no file."""
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/words", TEXT)
        writer.set_custom_data(DELETED, '{"max_bytes": 1, "last_file": "zzzzzzzzzzzzzzz.mcap"}')
        writer.write("/words", 1, HELLO)
    assert examine_bag(tmp_path / "bag").removed == ()
    assert main(["trace", "repair", str(tmp_path / "bag")]) == 0
    assert files_of(tmp_path / "bag") == ["bag_0.mcap"]


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"max_bytes": "x", "files": []}', '{"other": 1}'])
def test_custom_data_of_others_is_not_taken_for_a_deletion(text: str) -> None:
    assert deleted_of({DELETED: text}) is None


def test_a_flush_that_fails_deletes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recording = Recording(tmp_path / "bag", Split(after_s=0, after_bytes=40_000, max_bytes=LIMIT))
    write = Disk.write

    def refuses(disk: Disk, *words: Any, metadata: Metadata | None = None, **more: Any) -> None:
        if metadata is not None and b'paths: ["bag_0.mcap"' not in metadata.data:
            raise OSError(28, "No space left on device")
        write(disk, *words, metadata=metadata, **more)

    def flush_all() -> None:
        for _ in range(FLUSHES):
            recording.flush()

    with monkeypatch.context() as patch:
        patch.setattr(Disk, "write", refuses)
        with pytest.raises(TraceError, match="No space left"):
            flush_all()
    recording.bag.abort()
    assert files_of(tmp_path / "bag") == named(tmp_path / "bag")
    assert "bag_0.mcap" in named(tmp_path / "bag")
    assert mauve_rt.trace.open(tmp_path / "bag").deleted == ()


def test_a_bag_is_read_and_copied_while_its_oldest_file_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    split = Split(after_s=0, after_bytes=40_000)
    for name, read in {
        "open": mauve_rt.trace.open,
        "check": check_bag,
        "copy": lambda bag: snapshot_bag(bag, tmp_path / "now"),
    }.items():
        bag = record(tmp_path / name, split)
        gone = bag / f"{name}_0.mcap"

        def own(_path: Path, files: list[Path], *, gone: Path = gone) -> list[Path]:
            gone.unlink(missing_ok=True)
            return files

        monkeypatch.setattr("mauve_rt.trace.bag.files._own", own)
        read(bag)
        assert not gone.exists()


@pytest.mark.parametrize(
    ("split", "words"),
    [
        (Split(after_bytes=40_000, max_bytes=79_999), "expected at least twice the size of a file, 80,000"),
        (Split(after_bytes=40_000, max_bytes=80_000), ""),
        (Split(max_bytes=1), ""),
        (Split(after_bytes=40_000), ""),
    ],
)
def test_a_bag_holds_two_files_at_least(split: Split, words: str) -> None:
    assert split.misfit().startswith(words)
    assert bool(split.misfit()) == bool(words)
