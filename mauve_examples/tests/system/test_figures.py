"""`scripts/figures`: what the paper's timelines show is what the traces of one run of it show."""

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

import mauve_rt.trace
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.statistics import state_spans
from mauve_rt.trace.reading.trace import Trace, merge_traces

FIRST_WORK_NS, PERIOD_NS = 8_000_000, 40_000_000
DEPLOYMENT_LEAD_NS = 20_000_000


def run(*, out: Path, bags: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "mauve_examples.figures", "--out", out, "--bags", bags]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=400)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("figures")
    told = run(out=folder / "drawn", bags=folder / "bags")
    assert told.returncode == 0, told.stderr
    names = ["figure3.svg", "figure5.svg", "figure6.svg", "figures.md"]
    assert told.stdout.splitlines() == [str(folder / "drawn" / name) for name in names]
    return folder


def trace_of(out: Path, figure: str) -> Trace:
    trace = mauve_rt.trace.open(out / "bags" / figure)
    assert trace.lost == 0
    return trace


def first_instant_ns(trace: Trace, task: str) -> int:
    return int(trace.of(task, Kind.RELEASE)["a"][0])


def test_without_the_barrier_the_second_task_comes_late(out: Path):
    trace = merge_traces({task: trace_of(out, f"figure3/{task}") for task in ("tau_1", "tau_2")})
    first, second = (first_instant_ns(trace, f"{task}/{task}") for task in ("tau_1", "tau_2"))
    is_real_time = "under `SCHED_FIFO`" in (out / "drawn" / "figures.md").read_text(encoding="utf-8")
    assert second - first >= DEPLOYMENT_LEAD_NS + (FIRST_WORK_NS if is_real_time else 0)
    (grid,) = trace.deployments("tau_1/tau_1")
    assert grid.period_ns == PERIOD_NS
    assert grid.phase_ns(second) != 0
    releases = trace.of("tau_2/tau_2", Kind.RELEASE)
    assert {grid.phase_ns(int(instant)) for instant in releases["a"]} == {grid.phase_ns(second)}


def test_with_it_both_are_on_one_grid(out: Path):
    trace = trace_of(out, "figure5")
    (grid,), (other,) = (trace.deployments(task) for task in ("tau_1", "tau_2"))
    assert grid[1:] == other[1:]
    assert first_instant_ns(trace, "tau_1") == first_instant_ns(trace, "tau_2") == grid.epoch_ns
    for task in ("tau_1", "tau_2"):
        instants = trace.of(task, Kind.RELEASE)["a"]
        assert {grid.phase_ns(int(instant)) for instant in instants} == {0}
        spans = state_spans(trace.of(task))
        assert (spans["end_ns"] - spans["begin_ns"]).min() >= FIRST_WORK_NS


def test_a_replaced_core_goes_on_at_the_pending_instant(out: Path):
    trace = trace_of(out, "figure6")
    (swap,) = reconfigurations(trace)
    assert (swap.component, swap.committed, swap.complete) == ("tau_2", True, True)
    assert swap.what == "replace_core mauve_examples/ShortWork"
    assert (swap.missed_releases, swap.phase_nominal_ns) == (0, 0)
    assert swap.nominal_ns == swap.pending_ns
    (grid,) = trace.deployments("tau_1")
    assert grid.phase_ns(swap.pending_ns) == 0
    assert len(trace.of("tau_1", Kind.PARKED)) == 0


def test_the_drawings_are_whole(out: Path):
    page = (out / "drawn" / "figures.md").read_text(encoding="utf-8")
    for number in (3, 5, 6):
        path = out / "drawn" / f"figure{number}.svg"
        root = ET.parse(path).getroot()  # noqa: S314 - our own file
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert len(list(root.iter("{http://www.w3.org/2000/svg}path"))) > 30
        assert "prefers-color-scheme: dark" in path.read_text(encoding="utf-8")
        assert f"(figure{number}.svg)" in page
    assert "Releases missed: 0." in page
    assert "{" not in page


def test_a_folder_that_is_there_is_said(out: Path):
    told = run(out=out / "other", bags=out / "bags")
    assert (told.returncode, told.stderr.count("\n")) == (2, 1)
    assert "exists already" in told.stderr
