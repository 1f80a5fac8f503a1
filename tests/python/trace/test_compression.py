"""Chunks compressed by zstd: smaller, and read by ours. Other readers: test_strangers.py."""

import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader
from synthetic_traces import installed_messages

from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.recorded import COMPRESSIONS
from mauve_rt.trace.bag.writer import BagWriter
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

TEXT = "mauve_test_msgs/msg/Text"


@pytest.fixture(autouse=True)
def _messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed_messages(tmp_path / "prefix", monkeypatch)


def recorded(folder: Path, compression: str) -> Path:
    source = SyntheticSource(["control"])
    for number in range(5000):
        source.add("control", Kind.MARK, number * 1000, name="mark", a=number % 7)
    recorder = Recorder(source, folder, node_name="/e", compression=compression)
    recorder.start()
    recorder.stop()
    return folder


def size_of(bag: Path) -> int:
    return sum(file.stat().st_size for file in bag.glob("*.mcap"))


def test_a_compressed_trace_is_smaller_and_the_same(tmp_path: Path) -> None:
    plain, small = (recorded(tmp_path / name, name) for name in COMPRESSIONS)
    assert size_of(small) < size_of(plain) / 3
    assert open_trace(small).of("control").tobytes() == open_trace(plain).of("control").tobytes()
    assert check_bag(small) == check_bag(plain)


@pytest.mark.parametrize("data", [bytes(3_000_000), bytes(1)], ids=["too small to be believed", "no smaller"])
def test_data_that_no_reader_would_believe_stay_as_they_are(tmp_path: Path, data: bytes) -> None:
    """Zeros become a thousandth, which readers refuse as an attack."""
    with BagWriter(tmp_path / "bag", compression="zstd") as writer:
        writer.add_topic("/zeros", TEXT)
        writer.write("/zeros", 1, data)
        writer.flush()  # with the definition of the type
        for number in range(2, 5):
            writer.write("/zeros", number, data)
            writer.flush()
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    assert [chunk.compression for chunk in chunks][1:] == ["", "", ""]


def test_a_compression_that_there_is_not_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(TraceError, match="compression 'lz4': expected none or zstd"):
        BagWriter(tmp_path / "bag", compression="lz4")
    monkeypatch.setitem(sys.modules, "zstandard", None)
    with pytest.raises(TraceError, match="install it by: pip install zstandard"):
        BagWriter(tmp_path / "bag", compression="zstd")
    assert not (tmp_path / "bag").exists(), "nothing is left behind"
    BagWriter(tmp_path / "bag").close()
