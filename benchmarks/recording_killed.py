"""What `kill -9` at a random moment takes from a bag: how much time, and how often a repair is needed."""

import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mcap.reader import make_reader
from native import ROOT, BenchmarkError
from rosbags.rosbag2 import Reader
from rows import Row, alone, exactly_zero, never_over
from settings import Settings

import mauve_rt.trace
from mauve_rt.trace.bag.repair import examine_bag, repair_bag

_LIBRARY = ROOT / "build" / "benchmarks" / "libbench_talker.so"
_PROGRAM = Path(__file__).with_name("recording_process.py")
_RUN_S = (0.3, 0.8)


class _Killed(NamedTuple):
    lost_ms: float
    """From the last record in the bag to the kill."""
    gaps: int
    """Records missing before the last one."""
    needed_repair: bool
    unreadable: bool
    """After the repair."""


def kill_rows(settings: Settings) -> Iterator[Row]:
    """Kill a process that records 100,000 records a second, and look at what it left."""
    chance = random.Random(1)  # noqa: S311 - no cryptography
    with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
        found = [_kill(Path(folder) / f"bag_{number}", chance) for number in range(settings.kills)]
    kills = f"of {settings.kills} kills"
    note = f"{sum(one.needed_repair for one in found)} {kills} left a bag that rosbags or mcap would not open"
    yield never_over(
        "lost by kill -9 while recording 100,000 records a second, worst",
        [one.lost_ms for one in found],
        limit=200,
        unit="ms",
        note=note,
    )
    yield alone("the same, median", [one.lost_ms for one in found], unit="ms")
    yield exactly_zero(f"records missing before the last one, {kills}", [one.gaps for one in found])
    yield exactly_zero(
        f"bags that could not be read after the repair, {kills}", [one.unreadable for one in found]
    )


def _kill(bag: Path, chance: random.Random) -> _Killed:
    words = [sys.executable, "-P", str(_PROGRAM), str(_LIBRARY), str(bag)]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None  # noqa: S101 - a pipe
        if process.stdout.readline() != b"records\n":
            raise BenchmarkError("the recording process did not start")
        time.sleep(chance.uniform(*_RUN_S))
        killed_ns = time.monotonic_ns()
        process.kill()
    trace = mauve_rt.trace.open(bag)  # as it is
    needed_repair = not _others_open(bag)
    repair_bag(examine_bag(bag))
    last_ns = trace.span_ns[1]
    result = _Killed((killed_ns - last_ns) / 1e6, trace.lost, needed_repair, not _others_open(bag))
    shutil.rmtree(bag)
    return result


def _others_open(bag: Path) -> bool:
    """Whether rosbags and mcap open it, by its summary and to the last message."""
    try:
        with Reader(bag) as reader:
            by_rosbags = sum(1 for _ in reader.messages())
        with (bag / f"{bag.name}_0.mcap").open("rb") as stream:
            by_mcap = sum(1 for _ in make_reader(stream, validate_crcs=True).iter_messages())
    except Exception:  # noqa: BLE001 - they raise whatever their parts raise
        return False
    return by_rosbags == by_mcap > 0
