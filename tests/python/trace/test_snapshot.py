"""A bag that is being written: our reader reads it, and `mauve trace snapshot` makes a bag for all others."""

import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from bag_kills import KEEPER, TEXT, until
from bag_rules import assert_rosbag2_reads
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from mauve_rt.cli.main import main
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.reader import open_trace

TURNS = 10
RECORDING = f"""
import sys, time
from pathlib import Path
from mauve_rt.trace.bag.recorded import Split
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource
source = SyntheticSource(["c"])
recorder = Recorder(
    source, Path(sys.argv[1]), node_name="/executor", keeper=Path(sys.argv[2]), flush_period_s=0.002,
    split=Split(after_s=0, after_bytes=2_000_000),
)
recorder.start()
text = bytes([0, 1, 0, 0]) + (3000).to_bytes(4, "little") + b"x" * 2999 + bytes(1)
for number in range(10**9):
    source.add("c", 16, time.monotonic_ns())
    recorder.record("/words", "{TEXT}", text, monotonic_ns=time.monotonic_ns())
    time.sleep(0.001 if number < 5000 else 0.05)  # else a slow reader has ever more to read
"""


@pytest.fixture
def running(tmp_path: Path, test_messages: None) -> Iterator[Path]:
    """A bag that a process writes: five hundred times a second at first, then slower."""
    messages = Path(__file__).parents[3] / "mauve_msgs" / "msg"
    shutil.copytree(messages, tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    bag = tmp_path / "bag"
    with subprocess.Popen([sys.executable, "-c", RECORDING, bag, KEEPER]) as process:
        try:
            until(lambda: _size(bag) > 100_000 or process.poll() is not None, "the recording")
            yield bag
            assert process.poll() is None, "it recorded all the time"
        finally:
            process.kill()


def _size(bag: Path) -> int:
    return sum(file.stat().st_size for file in bag.glob("*.mcap"))


def test_our_reader_reads_a_bag_that_is_being_written(running: Path) -> None:
    counts = []
    for _ in range(TURNS):
        trace = open_trace(running)
        counts.append(len(trace.of("c")))
        assert trace.lost == 0
    assert counts == sorted(counts)
    until(lambda: len(open_trace(running).of("c")) > counts[0], "more records")


def test_every_reader_reads_a_snapshot_of_a_bag_that_is_being_written(
    running: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for turn in range(TURNS):
        before = len(open_trace(running).of("c"))
        out = tmp_path / f"snapshot_{turn}"
        assert main(["trace", "snapshot", str(running), "--out", str(out)]) == 0
        assert capsys.readouterr().out == f"{out}\n"
        assert {finding.kind for finding in check_bag(out)} == {"note"}, "no architecture, no loss"
        ours = open_trace(out)
        assert len(ours.of("c")) >= before, "all that was there"
        expected = sum(1 for _ in ours.messages("/words"))
        by_mcap = 0
        for file in out.glob("*.mcap"):
            with file.open("rb") as stream:
                messages = make_reader(stream, validate_crcs=True).iter_messages(topics=["/words"])
                by_mcap += sum(1 for _ in messages)
        assert by_mcap == expected
        with AnyReader([out]) as reader:
            words = [each for each in reader.connections if each.topic == "/words"]
            assert sum(1 for _ in reader.messages(connections=words)) == expected
        assert_rosbag2_reads(out)


def test_a_snapshot_overwrites_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sample = Path(__file__).parents[3] / "docs" / "sample" / "metronome"
    for bag, out, said in (
        (sample, tmp_path, "exists already; remove it or choose another name"),
        (sample, Path("/proc/none/snapshot"), "cannot be written"),
        (tmp_path, tmp_path / "new", "no .mcap file in it"),
    ):
        assert main(["trace", "snapshot", str(bag), "--out", str(out)]) != 0
        assert said in capsys.readouterr().err
    assert not [*tmp_path.iterdir()]
