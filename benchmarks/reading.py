"""How long it takes to read a bag and measure it, beside reading its bytes; and to make its report."""

import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import native
from native import BenchmarkError
from rows import Row, alone, compared
from settings import Settings
from trace_bags import make_bag

import mauve_rt.trace
from mauve_rt.trace.reading.statistics import all_statistics

_ROUNDS = 5  # of the larger bags, which vary less
_MANY = 5_000_000
_BLOCK_BYTES = 1 << 20


def reading_rows(settings: Settings) -> Iterator[Row]:
    """Rounds for each number of records."""
    with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
        for number in settings.read_records:
            bag = make_bag(Path(folder) / f"bag_{number}", number)
            rounds = min(settings.rounds, _ROUNDS) if number > _MANY else settings.rounds
            yield from _rows(bag, number, rounds)


def _rows(bag: Path, number: int, rounds: int) -> Iterator[Row]:
    found = native.interleaved(rounds, lambda _: _seconds(bag, _measure), lambda _: _seconds(bag, _checksum))
    millions = f"{number // 1_000_000} million records"
    yield compared(
        f"reading a bag of {millions} and its statistics",
        [(pair[0], pair[1]) for pair in found],
        unit="s",
        beside="reading its bytes, with a CRC",
    )
    whole = [_report_s(bag) for _ in range(rounds)]
    size = (bag / "report.html").stat().st_size / 1e6
    yield alone(
        f"`mauve report` of {millions}, whole process",
        whole,
        unit="s",
        limit=10.0 if number <= _MANY else None,
        note=f"the page of {millions} has {size:.1f} MB",
    )


def _seconds(bag: Path, work: Callable[[Path], object]) -> float:
    begin_s = time.monotonic()
    work(bag)
    return time.monotonic() - begin_s


def _measure(bag: Path) -> object:
    return all_statistics(mauve_rt.trace.open(bag))


def _checksum(bag: Path) -> object:
    crc = 0
    for path in sorted(bag.glob("*.mcap")):
        with path.open("rb") as file:
            while block := file.read(_BLOCK_BYTES):
                crc = zlib.crc32(block, crc)
    return crc


def _report_s(bag: Path) -> float:
    begin_s = time.monotonic()
    words = [
        sys.executable,
        "-P",
        "-m",
        "mauve_rt.cli",
        "report",
        str(bag),
        "--out",
        str(bag / "report.html"),
    ]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise BenchmarkError(f"mauve report: {done.stderr.strip()}")
    return time.monotonic() - begin_s
