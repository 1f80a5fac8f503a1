"""Bounds of a running executor are watched: what exceeds one is found, with the term."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from mauve_rt._kernel import Simulation
from mauve_rt.analysis.excess import Term
from mauve_rt.control.bound_watch import BoundWatch, Violation
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.control.timing import Timing
from mauve_rt.model import load_architecture

MS = 1_000_000
PATIENCE_S = 60
HEAD = """\
mauve: 1
executor: {wakeup_us: 2000, overhead_ns: 100000}
components:
"""
COUNTER = "shell: executor_tests/CounterShell, fsm: executor_tests/CounterFsm, cpus: [0]"
LOCKING = (
    "shell: executor_tests/LockingShell, core: executor_tests/Locking, fsm: executor_tests/LockingFsm, "
    "cpus: [0], states: {Lock: {wcet_ns: 100000}}"
)
IN_VIRTUAL_TIME = f"""{HEAD}
  urgent: {{{COUNTER}, core: executor_tests/Counter, priority: 80, offset_ms: 1,
           properties: {{period_ms: 40}},
           states: {{Count: {{wcet_ns: 2000000, simulated_execution_ns: 1000000}}}}}}
  slow: {{{COUNTER}, core: executor_tests/Counter, priority: 40, properties: {{period_ms: 20}},
         states: {{Count: {{wcet_ns: 6000000, simulated_execution_ns: 12000000}}}}}}
"""


@contextmanager
def running(runtime: Runtime) -> Iterator[BoundWatch]:
    runtime.configure()
    runtime.activate()
    watch = BoundWatch(runtime, Timing(runtime))
    try:
        yield watch
    finally:
        watch.end()
        runtime.deactivate()
        runtime.cleanup()


@pytest.fixture
def runtime_of(tmp_path: Path, plugin_prefix: Path) -> Callable[[str], Runtime]:
    """A runtime of an architecture file with this text."""

    def make(text: str) -> Runtime:
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        return Runtime(lambda: load_architecture(path))

    return make


def violations(watch: BoundWatch, is_found: Callable[[Violation], bool]) -> list[Violation]:
    """Until one of them is found."""
    found: list[Violation] = []
    until_s = time.monotonic() + PATIENCE_S
    while not any(is_found(one) for one in found):
        assert time.monotonic() < until_s, f"never found: {found}, {watch.bounds()}"
        time.sleep(0.05)
        found += watch.look()
    return found


def require_fifo(runtime: Runtime) -> None:
    if any(part.policy == "SCHED_OTHER" for part in runtime.components()):
        pytest.skip("without real-time rights there are no bounds")


def test_in_virtual_time_each_job_is_judged(tmp_path: Path, plugin_prefix: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(IN_VIRTUAL_TIME, encoding="utf-8")
    simulation = Simulation()
    runtime = SimulatedRuntime(simulation, lambda: load_architecture(path))
    runtime.configure()
    simulation.deploy()
    runtime.activate()
    watch = BoundWatch(runtime, Timing(runtime))

    def run_to(after_epoch_ms: int) -> list[Violation]:
        simulation.run_until(runtime.host.epoch_ns + after_epoch_ms * MS)
        runtime.host.drain_trace()
        return watch.look()

    assert run_to(5) == []
    bounds = {(name, one.bound_ns) for name, jobs in watch.bounds().items() for one in jobs}
    assert bounds == {("urgent", 4_100_000), ("slow", 10_200_000)}
    assert run_to(205) == []  # records of others may come with the next drain
    found = {one.component: one for one in run_to(206)}
    assert found["slow"].excess[:3] == (Term.EXECUTION, "slow.Count", 12 * MS)
    assert found["slow"].jobs > 1
    assert found["urgent"].excess[:3] == (Term.WAKE_UP, "urgent", 11 * MS)
    assert "jobs above the bound since the last message" in found["slow"].message
    (bound,) = (one for one in watch.bounds()["slow"] if one.after == "Pause")
    assert (bound.longest_ns, bound.violations) == (12 * MS, bound.jobs)


def test_one_that_executes_longer_than_declared_is_named(runtime_of: Callable[[str], Runtime]) -> None:
    runtime = runtime_of(f"""{HEAD}
  spinning: {{{COUNTER}, core: executor_tests/Spinning, priority: 60,
             properties: {{period_ms: 40, step: 8.0}}, states: {{Count: {{wcet_ns: 1000000}}}}}}
""")
    with running(runtime) as watch:
        require_fifo(runtime)
        found = violations(watch, lambda one: one.excess.term is Term.EXECUTION)
        worst = next(one for one in found if one.excess.term is Term.EXECUTION)
        assert (worst.component, worst.excess.element) == ("spinning", "spinning.Count")
        assert worst.response_ns >= worst.excess.took_ns >= 8 * MS
        assert worst.bound_ns == 3_100_000
        (bound,) = (one for one in watch.bounds()["spinning"] if one.after == "Pause")
        assert bound.violations > 0
        assert bound.longest_ns >= 8 * MS


def test_one_that_holds_a_lock_longer_than_declared_is_named(runtime_of: Callable[[str], Runtime]) -> None:
    runtime = runtime_of(f"""{HEAD}
  low: {{{LOCKING}, priority: 40, properties: {{period_ms: 13, hold_ms: 9.0}}}}
  high: {{{LOCKING}, priority: 60, properties: {{period_ms: 20}}}}
resources:
  vault: {{kind: executor_tests/Vault, longest_hold_ns: 100000}}
connections:
  - [low.vault, vault.hold]
  - [high.vault, vault.hold]
""")
    with running(runtime) as watch:
        require_fifo(runtime)
        found = violations(watch, lambda one: one.component == "high" and one.excess.term is Term.BLOCKING)
        worst = next(one for one in found if one.excess.term is Term.BLOCKING)
        assert worst.excess.element == "vault"
        assert worst.excess.declared_ns == 100_000


def test_a_change_withdraws_the_bounds_until_they_are_computed(
    runtime_of: Callable[[str], Runtime],
) -> None:
    runtime = runtime_of(f"""{HEAD}
  one: {{{COUNTER}, core: executor_tests/Counter, priority: 60, states: {{Count: {{wcet_ns: 1000000}}}}}}
""")
    with running(runtime) as watch:
        require_fifo(runtime)
        until_s = time.monotonic() + PATIENCE_S
        while not watch.bounds():
            assert time.monotonic() < until_s
            watch.look()
        runtime.host.set_property("one", "step", 2.0)
        while watch.bounds():
            assert time.monotonic() < until_s
        while not watch.bounds():
            assert time.monotonic() < until_s
            watch.look()


def test_where_nothing_is_proved_nothing_is_watched(runtime_of: Callable[[str], Runtime]) -> None:
    runtime = runtime_of(f"""{HEAD}
  one: {{{COUNTER}, core: executor_tests/Counter, priority: 60}}
""")
    with running(runtime) as watch:
        assert watch.look() == []
        assert not runtime.host.watches_jobs()
        assert watch.bounds() == {}
