"""What it costs that a keeper writes the files of a recording, and not the recording process itself."""

import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from native import ROOT, BenchmarkError, interleaved
from rows import Row, compared
from settings import Settings

_LIBRARY = ROOT / "build" / "benchmarks" / "libbench_talker.so"
_PROGRAM = Path(__file__).with_name("recording_process.py")
_SETTLE_S = 0.3


def kept_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of a process whose files a keeper writes, and of the same that writes them itself."""
    for what, words in (
        ("records", "CPU of recording 100,000 records a second, a keeper writing the files"),
        ("images", "CPU of recording 30 MB a second of images, a keeper writing the files"),
    ):
        with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
            sides = [_side(Path(folder), what, by, settings.recording_s) for by in ("keeper", "itself")]
            rounds = interleaved(settings.rounds, *sides)
        pairs = [(kept, itself) for kept, itself in rounds]
        beside = "the recording process writes them itself"
        yield compared(words, pairs, unit="%", beside=beside, ratio_limit=1.3)


def _side(folder: Path, what: str, by: str, duration_s: float) -> Callable[[int], float]:
    def measure(number: int) -> float:
        bag = folder / f"{by}_{number}"
        words = [sys.executable, "-P", str(_PROGRAM), str(_LIBRARY), str(bag), what, by]
        with subprocess.Popen(words, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None  # noqa: S101 - a pipe
            if process.stdout.readline() != b"records\n":
                raise BenchmarkError("the recording process did not start")
            time.sleep(_SETTLE_S)
            before, began_s = cpu_s(process.pid), time.monotonic()
            time.sleep(duration_s)
            percent = 100 * (cpu_s(process.pid) - before) / (time.monotonic() - began_s)
            process.kill()
        shutil.rmtree(bag)
        return percent

    return measure


def cpu_s(process: int) -> float:
    """CPU time of all its threads but the components', and of its children."""
    total_ns = 0
    tasks = [*Path(f"/proc/{process}/task").iterdir()]
    for child in {word for task in tasks for word in (task / "children").read_text("utf-8").split()}:
        tasks += Path(f"/proc/{child}/task").iterdir()
    for task in tasks:
        if not (task / "comm").read_text("utf-8").startswith("talker_"):
            total_ns += int((task / "schedstat").read_text("utf-8").split()[0])
    return total_ns / 1e9
