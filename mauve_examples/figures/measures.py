"""What the figures say in numbers, from the traces."""

from dataclasses import dataclass

from mauve_examples.figures.runs import Run
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.facts import Deployment
from mauve_rt.trace.reading.reconfigurations import Reconfiguration, reconfigurations
from mauve_rt.trace.reading.statistics import component_statistics, state_spans
from mauve_rt.trace.reading.trace import Trace

Interval = tuple[int, int]


@dataclass(frozen=True)
class Task:
    """What a task did. Times in ns of CLOCK_MONOTONIC."""

    grid: Deployment
    nominal_ns: list[int]
    """Of its releases, as they should be."""
    actual_ns: list[int]
    executions: list[Interval]
    """From begin to end, preemption included."""
    overruns: int


def task_of(trace: Trace, component: str) -> Task:
    """Measure one of the two tasks."""
    releases = trace.of(component, Kind.RELEASE)
    spans = state_spans(trace.of(component))
    return Task(
        grid=trace.deployments(component)[0],
        nominal_ns=releases["a"].tolist(),
        actual_ns=releases["b"].tolist(),
        executions=list(zip(spans["begin_ns"].tolist(), spans["end_ns"].tolist(), strict=True)),
        overruns=component_statistics(trace, component).overruns,
    )


def tasks_of(run: Run) -> tuple[Task, Task]:
    """tau_1 and tau_2."""
    first, second = (task_of(run.trace, name) for name in run.tasks)
    return first, second


def start_offset_ns(run: Run) -> int:
    """From the first nominal instant of tau_1 to that of tau_2."""
    first, second = tasks_of(run)
    return second.nominal_ns[0] - first.nominal_ns[0]


def phase_ns(run: Run) -> int:
    """Of tau_2's first nominal instant after the last one on tau_1's grid: 0 when they are synchronised."""
    first, _ = tasks_of(run)
    return start_offset_ns(run) % first.grid.period_ns


def swap_of(run: Run) -> Reconfiguration:
    """The replacement of tau_2's core."""
    (one,) = reconfigurations(run.trace)
    return one


def microseconds(time_ns: float) -> str:
    """A short time with its unit."""
    return f"{time_ns / 1e3:.0f} \N{MICRO SIGN}s"


def milliseconds(time_ns: float) -> str:
    """A longer time with its unit."""
    return f"{time_ns / 1e6:.1f} ms"


def without(interval: Interval, others: list[Interval]) -> list[Interval]:
    """The parts of an interval that none of the others covers; these are in order and do not overlap."""
    begin_ns, end_ns = interval
    parts = []
    for other_begin, other_end in others:
        if other_end <= begin_ns or other_begin >= end_ns:
            continue
        if other_begin > begin_ns:
            parts.append((begin_ns, other_begin))
        begin_ns = other_end
    return [*parts, (begin_ns, end_ns)] if begin_ns < end_ns else parts
