"""Readers that others wrote find in each kind of bag the same messages: mcap, rosbags, and libmcap in C++.

libmcap, by which Jazzy's rosbag2 reads, is headers only, and no wheel has them. It takes part where they are
found: `ros-jazzy-mcap-vendor`, or the folder `cpp/mcap/include` of a checkout, which MCAP_INCLUDE names.
"""

import os
import resource
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from bag_kills import TEXT, kill_in_a_write
from mcap.reader import NonSeekingReader, make_reader
from rosbags.rosbag2 import Reader

from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.repair import examine_bag, repair_bag
from mauve_rt.trace.bag.writer import BagWriter

LARGE = 8_000_000  # bytes
Counts = Counter[str]


pytestmark = pytest.mark.usefixtures("test_messages")


# ---- the bags


def text(size: int) -> bytes:
    return bytes([0, 1, 0, 0]) + size.to_bytes(4, "little") + b"x" * (size - 1) + bytes(1)


def fill(bag: BagWriter, *, flushes: int = 20, size: int = 10) -> None:
    """Two topics, one of which comes later, and one without a message; and words about the recording."""
    bag.add_topic("/silent", TEXT)
    bag.set_custom_data("about", "x" * 3000)
    for flush in range(flushes):
        for topic in ("/early", "/late")[: 1 + (flush > flushes // 2)]:
            bag.add_topic(topic, TEXT)
            for number in range(3):
                bag.write(topic, 1_000_000 * flush + number, text(size))
        bag.flush()


def plain(bag: Path) -> None:
    with BagWriter(bag) as writer:
        fill(writer)


def split(bag: Path) -> None:
    with BagWriter(bag) as writer:
        for _ in range(4):
            fill(writer, flushes=5)
            writer.split()
        fill(writer)


def compressed(bag: Path) -> None:
    with BagWriter(bag, compression="zstd") as writer:
        fill(writer, flushes=5, size=2000)
        writer.split()
        fill(writer, flushes=5)
    for file in bag.glob("*.mcap"):
        with file.open("rb") as stream:
            chunks = make_reader(stream).get_summary().chunk_indexes
        assert any(chunk.compression == "zstd" for chunk in chunks)
        assert all(chunk.compressed_size <= chunk.uncompressed_size for chunk in chunks)
    told = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (told["compression_format"], told["compression_mode"]) == ("", "")


def killed_compressed(bag: Path) -> None:
    kill_in_a_write(bag, size=1_000_000, split_every=4, at=6, compression="zstd")
    assert examine_bag(bag).is_finished
    with (bag / f"{bag.name}_0.mcap").open("rb") as stream:
        assert {chunk.compression for chunk in make_reader(stream).get_summary().chunk_indexes} == {"zstd"}


def repaired_compressed(bag: Path) -> None:
    compressed(bag)
    last = bag / f"{bag.name}_1.mcap"
    os.truncate(last, last.stat().st_size * 3 // 4)
    repair_bag(examine_bag(bag))


def killed(bag: Path) -> None:
    kill_in_a_write(bag, size=1_000_000, split_every=4, at=6)


def repaired(bag: Path) -> None:
    split(bag)
    last = bag / f"{bag.name}_4.mcap"
    os.truncate(last, last.stat().st_size * 3 // 4)
    repair_bag(examine_bag(bag))


def full_disk(bag: Path) -> None:
    writer = BagWriter(bag)
    fill(writer)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, limits[1]))
    try:
        with pytest.raises(TraceError, match="File too large"):
            fill(writer, size=50_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    writer.abort()


def large(bag: Path) -> None:
    with BagWriter(bag) as writer:
        fill(writer, flushes=3, size=LARGE)


@pytest.fixture(scope="session")
def libmcap(tmp_path_factory: pytest.TempPathFactory) -> Path | None:
    """A program that reads by it."""
    named = os.environ.get("MCAP_INCLUDE")
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(":")
    places = [Path(named)] if named else [Path(prefix) / "include" / "mcap_vendor" for prefix in prefixes]
    for place in places:
        if (place / "mcap" / "reader.hpp").is_file():
            program = tmp_path_factory.mktemp("libmcap") / "read_by_libmcap"
            source = Path(__file__).with_name("read_by_libmcap.cpp")
            subprocess.run(["c++", "-std=c++17", "-isystem", place, source, "-o", program], check=True)
            return program
    return None


# ---- the readers: messages by topic in a file


def by_mcap(file: Path) -> Counts:
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        return Counter(channel.topic for _, channel, _ in reader.iter_messages())


def by_mcap_from_begin(file: Path) -> Counts:
    with file.open("rb") as stream:
        reader = NonSeekingReader(stream, validate_crcs=True)
        return Counter(channel.topic for _, channel, _ in reader.iter_messages())


def by_rosbags(bag: Path) -> Counts:
    with Reader(bag) as reader:
        return Counter(connection.topic for connection, _, _ in reader.messages())


def by_libmcap(program: Path, file: Path) -> Counts:
    said = subprocess.run([program, file], capture_output=True, text=True, check=False)
    assert said.returncode == 0, said.stderr
    return Counter({topic: int(count) for topic, count in map(str.split, said.stdout.splitlines())})


def by_us(file: Path) -> Counts:
    return Counter({topic.name: topic.messages for topic in examine_bag(file).topics() if topic.messages})


@pytest.mark.parametrize(
    "make",
    [
        plain,
        split,
        compressed,
        killed,
        killed_compressed,
        repaired,
        repaired_compressed,
        full_disk,
        large,
    ],
)
def test_all_find_the_same(tmp_path: Path, make: Callable[[Path], None], libmcap: Path | None) -> None:
    bag = tmp_path / "bag"
    make(bag)
    files = sorted(bag.glob("*.mcap"))
    found = [by_us(file) for file in files]
    for file, counts in zip(files, found, strict=True):
        assert by_mcap(file) == by_mcap_from_begin(file) == by_rosbags(file) == counts, file
        if libmcap is not None and counts:
            assert by_libmcap(libmcap, file) == counts, file
    total = sum(found, Counter())
    assert total.total() > 3, "there is something to find"
    told = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    if make in (killed, killed_compressed):  # between a file and metadata.yaml
        assert told["message_count"] <= by_rosbags(bag).total() <= total.total()
        return
    assert by_rosbags(bag) == total
    by_topic = {
        one["topic_metadata"]["name"]: one["message_count"] for one in told["topics_with_message_count"]
    }
    assert {topic: count for topic, count in by_topic.items() if count} == total


def test_libmcap_took_part(libmcap: Path | None) -> None:
    if libmcap is None:
        pytest.skip("libmcap's headers are not there: install ros-jazzy-mcap-vendor, or set MCAP_INCLUDE")
    nothing = subprocess.run([libmcap, sys.executable], check=False, capture_output=True)
    assert nothing.returncode == 1, "it refuses what is no bag"
    assert shutil.which("c++")
