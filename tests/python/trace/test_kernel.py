"""The kernel's records, recorded and read back, tell the same as the kernel's own counters and reports."""

import time
from pathlib import Path

import pytest
from perfetto_decoding import Decoded

from mauve_rt import _kernel
from mauve_rt.trace.export.perfetto import export_perfetto
from mauve_rt.trace.format.records import Kind, ReconfigurationPhase
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.split_changes import split_changes
from mauve_rt.trace.reading.statistics import all_statistics
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.recorder import Recorder

PERIODS_MS = {"fast": 2, "slow": 20}
CORES = ("Backwards", "Counter", "Reluctant", "Backwards")


class Run:
    """Two components for a moment; the core of one replaced while they run, once refused."""

    def __init__(self, prefix: Path, directory: Path) -> None:
        registry = _kernel.PluginRegistry()
        registry.load_library(str(prefix / "lib" / "libexecutor_tests.so"))
        architecture = _kernel.Architecture(registry)
        names = {"shell": "Shell", "core": "", "fsm": "Fsm"}
        plugins = {kind: f"executor_tests/Counter{suffix}" for kind, suffix in names.items()}
        alternatives = [f"executor_tests/{core}" for core in CORES]
        for component, period_ms in PERIODS_MS.items():
            architecture.add_component(component, **plugins, alternatives=alternatives)
            architecture.set_property(component, "period_ms", period_ms)
        architecture.configure()
        deployer = _kernel.Deployer(architecture)
        recorder = Recorder(deployer, directory, node_name="/robot/executor")
        recorder.start()
        deployer.deploy()
        self.epoch_ns = deployer.epoch_ns
        self.reports = []
        for core in CORES:
            time.sleep(0.05)
            if core == "Reluctant":
                with pytest.raises(_kernel.MauveError):
                    deployer.replace_core("slow", "executor_tests/Reluctant")
            else:
                self.reports.append(deployer.replace_core("slow", f"executor_tests/{core}"))
        deployer.stop("fast")
        deployer.start("fast")
        time.sleep(0.05)
        deployer.shutdown()
        recorder.stop()
        self.components = {one.name: one for one in architecture.components()}
        self.trace: Trace = open_trace(directory)


@pytest.fixture(scope="module")
def run(plugin_prefix: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return Run(plugin_prefix, tmp_path_factory.mktemp("trace") / "bag")


def test_every_record_is_there(run: Run):
    assert run.trace.components == tuple(PERIODS_MS)
    for loss in run.trace.losses.values():
        assert loss.received == loss.written > 0
        assert loss.lost == 0


def test_counts_are_the_kernels(run: Run):
    for name, found in all_statistics(run.trace).items():
        told = run.components[name]
        assert (found.releases, found.overruns, found.skipped) == (told.releases, told.overruns, told.skipped)
        assert found.faults == 0
        assert found.wakeup.min_ns >= 0


def test_deployment_tells_the_grid(run: Run):
    for name, period_ms in PERIODS_MS.items():
        grids = run.trace.deployments(name)
        assert {grid[1:] for grid in grids} == {(run.epoch_ns, 0, period_ms * 1_000_000)}
        nominal_ns = run.trace.of(name, Kind.RELEASE)["a"]
        assert {grids[0].phase_ns(int(instant)) for instant in nominal_ns} == {0}


def test_swaps_are_as_the_kernel_reported_them(run: Run):
    found = reconfigurations(run.trace)
    assert [one.committed for one in found] == [True, True, False, True]
    assert all(one.complete and one.component == "slow" for one in found)
    for one, told in zip([one for one in found if one.committed], run.reports, strict=True):
        assert one.what == told.step.replace(f"{told.component} ", "")  # the record has its component already
        assert (one.blackout_ns, one.missed_releases) == (told.blackout_ns, told.missed_releases)
        assert (one.phase_nominal_ns, one.phase_actual_ns) == (told.phase_nominal_ns, told.phase_actual_ns)
        assert one.parked_ns + one.adopt_ns + one.take_ns <= one.armed_ns


def test_every_take_tells_the_instant_that_was_reported(run: Run):
    changes = run.trace.of("slow", Kind.RECONFIGURATION)
    takes = changes[changes["a"] == ReconfigurationPhase.TAKE]
    assert takes["c"].tolist() == [told.instant_ns for told in run.reports]
    assert all(told.release_ns >= told.instant_ns for told in run.reports)
    assert [split_changes(run.trace.of(name)) for name in run.trace.components] == [[], []]


def test_perfetto_shows_them(run: Run, tmp_path: Path):
    export_perfetto({"robot": run.trace}, tmp_path / "trace.pftrace")
    decoded = Decoded(tmp_path / "trace.pftrace")
    for name, told in all_statistics(run.trace).items():
        events = decoded.of(name)
        assert sum(event.category == "state" for event in events) == sum(
            found.count for found in told.execution.values()
        )
        assert sum(event.category == "release" for event in events) == told.releases
        latencies = [count for event in events for count in event.counts]
        assert (min(latencies), max(latencies)) == (told.wakeup.min_ns, told.wakeup.max_ns)
    swaps = [event for event in decoded.of("slow") if event.category == "reconfiguration"]
    found = reconfigurations(run.trace)
    assert [(one.begin_ns, one.end_ns) for one in swaps] == [(one.parked_ns, one.armed_ns) for one in found]
    for one, ((_, _, begin), (_, _, end)) in zip(found, decoded.flows.values(), strict=True):
        assert (begin.begin_ns, end.name) == (one.parked_ns, "late")
        assert end.begin_ns == max(one.nominal_ns or 0, one.armed_ns)
