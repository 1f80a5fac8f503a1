"""The timing of a running executor, by its own analysis."""

from mauve_rt.control.runtime import Runtime
from mauve_rt.control.timing import Timing
from mauve_rt.model.threads import ThreadInfo

FILE = """\
mauve: 1
executor: {wakeup_us: 0, overhead_ns: 0}
components:
  high: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
         priority: 80, cpus: [0], properties: {period_ms: 16}, states: {Count: {wcet_ns: 6000000}}}
  low: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
        priority: 70, cpus: [0], properties: {period_ms: 16}, states: {Count: {wcet_ns: 2000000}}}
"""


def test_what_runs_is_judged_once_until_it_changes(runtime: Runtime) -> None:
    others: list[ThreadInfo] = []
    timing = Timing(runtime, others=lambda: others)
    now = timing.now()
    assert [one.name for one in now.components] == ["high", "low"]
    if all(part.policy == "SCHED_FIFO" for part in runtime.components()):
        bounds = {name: bound.response_ns for name, bound in now.study.bounds.items()}
        assert bounds == {"high": 6_000_000, "low": 8_000_000}
    assert timing.now() is now
    others.append(ThreadInfo("foreign", 90))
    after = timing.now()
    assert after is not now
    assert [one.name for one in after.study.subjects] == ["high", "low", "trace", "foreign"]
