"""What a run writes for docs/figures.md: each figure and what it shows, in the numbers of the same run."""

import os
import platform
import textwrap
import time
from dataclasses import dataclass
from pathlib import Path

from mauve_examples.figures.measures import (
    Task,
    microseconds,
    milliseconds,
    phase_ns,
    start_offset_ns,
    swap_of,
    tasks_of,
)
from mauve_examples.figures.runs import PREPARE_MS, Run
from mauve_rt.trace.reading.reconfigurations import Reconfiguration

_PARAGRAPH_WIDTH = 120
_HEAD = """\
These runs are of {date}, {machine}, {scheduling}.

Boxes: {boxes}. Faint: they want it, another has it. Arrows: nominal releases. Circles:
the task's thread is there and waits for its first instant. Dotted: the grids of instants.
"""
_WITHOUT_BARRIER = """\
## Fig. 3: synchronisation lost

![Timeline: the second task is started when the first has run, off its grid](figure3.svg)

What happens without the barrier, made on purpose: each task has a deployer's call of its own, and the
second call is made when the first task was seen to run. From {t_0} to {t_1}, the first release of
{tau_1}, it takes {start} ({lead} of it is the time that a deployment leaves itself). {then}:
{t_2} is {offset} after {t_1}. {tau_2} is {phase} off the grid of {tau_1}, and stays so. Nobody knows these
times before.
"""
_PREEMPTED = (
    "Then {tau_1} keeps the deployer from the processor for {taken}, and only then is {tau_2} started"
)
_SHARED = "Then it shares the processor with {tau_1} and comes to start {tau_2} at some time"
_DEPLOYMENT = """\
## Fig. 5: tasks synchronised

![Timeline: both tasks are released at the same instants](figure5.svg)

What MAUVE RT does. One call, which takes {deploy}, creates the threads, meets them at the barrier and
publishes one epoch, {t_1}, which is {start} after {t_0}. It is the first instant of both: their nominal
releases are {offset} apart, and {tau_2} is {phase} off the grid of {tau_1}. With one processor
for two, {tau_1} begins {first_late} after {t_1} and {tau_2} {second_late}.
"""
_RECONFIGURATION = """\
## Fig. 6: a core replaced, synchronisation kept

![Timeline: the second task goes on with another core at its next instant](figure6.svg)

R, from {t_0} on, takes {request}: the core {c_b} is built and configured, which is {prepare_ms} ms of
computing, by an ordinary thread while both tasks are running. Then {tau_2}, inside its wait, puts it in the
place of {c_a}. Only that keeps {tau_2} from anything: a blackout of {blackout}, {pause} before its next
instant {t_1}. Releases missed: {missed}. Nominal phase error of its release then: {phase}. {c_b} needs half
the time of {c_a}. {tau_1} was released {first_late} late at most, all through the run; overruns of both:
{overruns}.
"""
_SYMBOLS = {
    **{f"t_{index}": f"t<sub>{index}</sub>" for index in range(3)},
    **{f"tau_{index}": f"&tau;<sub>{index}</sub>" for index in (1, 2)},
    "c_a": "C<sub>A</sub>",
    "c_b": "C<sub>B</sub>",
}


@dataclass(frozen=True)
class Runs:
    """One of each."""

    without_barrier: Run
    deployment: Run
    reconfiguration: Run


def write_page(path: Path, runs: Runs) -> None:
    """Write the page beside its figures."""
    parts = (
        _head(runs),
        _without_barrier(runs.without_barrier),
        _deployment(runs.deployment),
        _reconfiguration(runs.reconfiguration),
    )
    path.write_text("\n".join(parts), encoding="utf-8")


def _filled(template: str, **facts: object) -> str:
    """The text with its facts, its paragraphs wrapped anew."""
    text = template.format(**_SYMBOLS, **facts)
    paragraphs = (
        textwrap.fill(part, _PARAGRAPH_WIDTH, break_on_hyphens=False) for part in text.split("\n\n")
    )
    return "\n\n".join(paragraphs) + "\n"


def _head(runs: Runs) -> str:
    denied = "under `SCHED_OTHER`, real-time rights being denied: the tasks' priorities had no effect"
    real_time = _is_real_time(runs.deployment)
    return _filled(
        _HEAD,
        date=time.strftime("%Y-%m-%d", time.gmtime()),
        machine=machine(),
        scheduling="under `SCHED_FIFO`" if real_time else denied,
        boxes="the task runs" if real_time else "the task executes, in turns with others where they overlap",
    )


def _without_barrier(run: Run) -> str:
    first, _ = tasks_of(run)
    taken_ns = first.executions[0][1] - first.executions[0][0]
    then = (_PREEMPTED if _is_real_time(run) else _SHARED).format(taken=milliseconds(taken_ns), **_SYMBOLS)
    return _filled(
        _WITHOUT_BARRIER,
        start=milliseconds(first.nominal_ns[0] - run.deployer[0].begin_ns),
        lead=milliseconds(first.nominal_ns[0] - first.grid.time_ns),
        then=then,
        offset=milliseconds(start_offset_ns(run)),
        phase=milliseconds(phase_ns(run)),
    )


def _deployment(run: Run) -> str:
    first, second = tasks_of(run)
    deploy = run.deployer[0]
    return _filled(
        _DEPLOYMENT,
        deploy=milliseconds(deploy.end_ns - deploy.begin_ns),
        start=milliseconds(first.nominal_ns[0] - deploy.begin_ns),
        offset=f"{start_offset_ns(run)} ns",
        phase=f"{phase_ns(run)} ns",
        first_late=microseconds(first.actual_ns[0] - first.nominal_ns[0]),
        second_late=milliseconds(second.actual_ns[0] - second.nominal_ns[0]),
    )


def _reconfiguration(run: Run) -> str:
    first, second = tasks_of(run)
    swap: Reconfiguration = swap_of(run)
    request = run.deployer[0]
    return _filled(
        _RECONFIGURATION,
        request=milliseconds(request.end_ns - request.begin_ns),
        prepare_ms=PREPARE_MS,
        blackout=microseconds(swap.blackout_ns),
        pause=milliseconds(swap.pending_ns - swap.armed_ns),
        missed=swap.missed_releases,
        phase=f"{swap.phase_nominal_ns} ns",
        first_late=microseconds(_latest_ns(first)),
        overruns=first.overruns + second.overruns,
    )


def _latest_ns(task: Task) -> int:
    return max(actual - nominal for nominal, actual in zip(task.nominal_ns, task.actual_ns, strict=True))


def _is_real_time(run: Run) -> bool:
    return run.policy == "SCHED_FIFO"


def machine() -> str:
    """What the runs were on: processor, its number, kernel."""
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    model = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), model)
    return f"{model}, {os.cpu_count()} processors, {platform.system()} {platform.release().partition('-')[0]}"
