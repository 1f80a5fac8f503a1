"""How fast a report of a bag of many small messages is, beside a bare read of it by the package mcap."""

import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import native
from mcap.reader import make_reader
from rows import Row, compared
from settings import Settings
from trace_bags import make_bag

from mauve_rt.trace.report import write_report
from mauve_rt.trace.report.bags import open_bags

_RECORDS, _TOPICS = 200_000, 40  # two messages for each record: as a mission whose values are recorded
_ROUNDS = 5  # of seconds each


def report_large_rows(settings: Settings) -> Iterator[Row]:
    """One row: CPU time of both."""
    with tempfile.TemporaryDirectory(prefix="mauve_bench_") as folder:
        bag = make_bag(Path(folder) / "bag", _RECORDS, topics=_TOPICS)
        files = sorted(bag.glob("*.mcap"))
        megabytes = sum(file.stat().st_size for file in files) / 1e6
        rounds = min(settings.rounds, _ROUNDS)
        found = native.interleaved(rounds, lambda _: _report_s(bag), lambda _: _read_s(files))
        speeds = [megabytes / pair[0] for pair in found]
        yield compared(
            f"report of a bag of {megabytes:.0f} MB with {_TOPICS} topics, CPU time",
            [(pair[0], pair[1]) for pair in found],
            unit="s",
            beside="reading its messages with the package mcap, none decoded",
            note=f"the report reads {min(speeds):.0f} to {max(speeds):.0f} MB/s",
        )


def _report_s(bag: Path) -> float:
    begin_s = time.process_time()
    write_report(bag / "report.html", open_bags([bag]))
    return time.process_time() - begin_s


def _read_s(files: list[Path]) -> float:
    begin_s = time.process_time()
    for path in files:
        with path.open("rb") as file:
            for _ in make_reader(file).iter_messages(log_time_order=False):
                pass
    return time.process_time() - begin_s
