"""Fig. 3, 5 and 6 of the paper, each from a run."""

from mauve_examples.figures.canvas import CHANGE, DEPLOYER, FAINT, FIRST, REPLACED, SECOND, Canvas
from mauve_examples.figures.measures import (
    Interval,
    Task,
    microseconds,
    phase_ns,
    start_offset_ns,
    swap_of,
    tasks_of,
    without,
)
from mauve_examples.figures.runs import Run
from mauve_rt.trace.reading.facts import Deployment

_MARGIN_NS = 6_000_000
_EXECUTIONS = 3  # of tau_2 that are shown
_ROWS = (("Deployer", DEPLOYER), (r"$\tau_1$", FIRST), (r"$\tau_2$", SECOND))
_DEPLOYER_ROW, _FIRST_ROW, _SECOND_ROW = range(3)


def draw_without_barrier(run: Run) -> Canvas:
    """Fig. 3: synchronisation lost."""
    first, second = tasks_of(run)
    t_0 = run.deployer[0].begin_ns
    canvas, window = _from_start("Fig. 3   Without the barrier: synchronisation lost", run)
    canvas.grid(_instants(first.grid, window), FIRST, (_FIRST_ROW, _SECOND_ROW))
    canvas.grid(_instants(second.grid, window), SECOND, (_SECOND_ROW, _SECOND_ROW))
    canvas.instant(t_0, "$t_0$")
    canvas.instant(first.nominal_ns[0], "$t_1$", row=_FIRST_ROW)
    canvas.instant(second.nominal_ns[0], "$t_2$", row=_SECOND_ROW)
    phase = phase_ns(run)
    later = second.nominal_ns[1]
    canvas.span(_DEPLOYER_ROW, (t_0, first.nominal_ns[0]), f"{(first.nominal_ns[0] - t_0) / 1e6:.1f} ms")
    canvas.span(
        _DEPLOYER_ROW, (first.nominal_ns[0], second.nominal_ns[0]), f"{start_offset_ns(run) / 1e6:.1f} ms"
    )
    canvas.span(_SECOND_ROW, (later - phase, later), rf"$\varphi$ = {phase / 1e6:.1f} ms")
    return canvas


def draw_deployment(run: Run) -> Canvas:
    """Fig. 5: tasks synchronised."""
    first, _ = tasks_of(run)
    canvas, window = _from_start("Fig. 5   The barrier and one epoch: tasks synchronised", run)
    canvas.grid(_instants(first.grid, window), FAINT)
    canvas.instant(run.deployer[0].begin_ns, "$t_0$")
    canvas.instant(first.nominal_ns[0], "$t_1$", row=_FIRST_ROW)
    canvas.remark(_DEPLOYER_ROW, run.deployer[0].end_ns, "all threads have met: the epoch is $t_1$, for both")
    return canvas


def draw_reconfiguration(run: Run) -> Canvas:
    """Fig. 6: the core of tau_2 replaced."""
    first, second = tasks_of(run)
    swap = swap_of(run)
    before = [instant for instant in second.nominal_ns if instant < swap.parked_ns]
    after = [execution for execution in second.executions if execution[0] > swap.armed_ns]
    window = (before[-2:][0] - _MARGIN_NS, after[:2][-1][1] + 2 * _MARGIN_NS)
    request = run.deployer[0]
    title = "Fig. 6   The core of a running task replaced: synchronisation kept"
    canvas = Canvas(title, _ROWS, window, request.begin_ns)
    _draw_deployer(canvas, run)
    _draw_tasks(canvas, run, (first, second), window, new_core_ns=swap.armed_ns)
    canvas.grid(_instants(first.grid, window), FAINT)
    canvas.instant(request.begin_ns, "$t_0$")
    canvas.instant(swap.pending_ns, "$t_1$", row=_SECOND_ROW)
    canvas.remark(_DEPLOYER_ROW, request.end_ns, "$C_B$ is built and configured, both tasks running", CHANGE)
    canvas.change(_SECOND_ROW, swap.parked_ns, f"$C_A \\to C_B$: {microseconds(swap.blackout_ns)}")
    return canvas


def _from_start(title: str, run: Run) -> tuple[Canvas, tuple[int, int]]:
    """Return a canvas with deployer and tasks from the deployer's first act on, and the time it shows."""
    first, second = tasks_of(run)
    t_0 = run.deployer[0].begin_ns
    window = (t_0 - _MARGIN_NS, second.executions[:_EXECUTIONS][-1][1] + 2 * _MARGIN_NS)
    canvas = Canvas(title, _ROWS, window, t_0)
    _draw_deployer(canvas, run)
    _draw_tasks(canvas, run, (first, second), window)
    return canvas, window


def _draw_deployer(canvas: Canvas, run: Run) -> None:
    for activity in run.deployer:
        label = activity.label.replace("tau_1", r"$\tau_1$").replace("tau_2", r"$\tau_2$")
        colour = CHANGE if label == "R" else DEPLOYER
        longest = max(activity.parts, key=lambda part: part[1] - part[0])
        for part in activity.parts:
            canvas.box(_DEPLOYER_ROW, part, colour, label if part == longest else "")
        canvas.box(_DEPLOYER_ROW, (activity.begin_ns, activity.end_ns), colour, faint=True)


def _draw_tasks(
    canvas: Canvas, run: Run, tasks: tuple[Task, Task], window: Interval, *, new_core_ns: int | None = None
) -> None:
    """Boxes where a task had the processor, faint ones from its release on where it waited for it."""
    preempts = tasks[0].executions if run.policy == "SCHED_FIFO" else []
    rows: tuple[tuple[int, str, Task, list[Interval]], ...] = (
        (_FIRST_ROW, FIRST, tasks[0], []),
        (_SECOND_ROW, SECOND, tasks[1], preempts),
    )
    for row, colour, task, others in rows:
        canvas.releases(row, task.nominal_ns)
        if window[0] <= task.grid.time_ns:
            canvas.ready(row, task.grid.time_ns)
        for nominal_ns, execution in zip(task.nominal_ns, task.executions, strict=False):
            if not (window[0] <= nominal_ns and execution[1] <= window[1]):
                continue
            label, shade = "", colour
            if new_core_ns is not None and row == _SECOND_ROW:
                is_new = execution[0] >= new_core_ns
                label, shade = ("$C_B$", REPLACED) if is_new else ("$C_A$", colour)
            parts = without(execution, others)
            longest = max(parts, key=lambda part: part[1] - part[0])
            for part in parts:
                canvas.box(row, part, shade, label if part == longest else "")
            canvas.box(row, (nominal_ns, execution[1]), shade, faint=True)


def _instants(grid: Deployment, window: Interval) -> list[int]:
    """Those of a grid in a window, from its first instant on."""
    begin_ns = grid.epoch_ns + grid.offset_ns
    return [instant for instant in range(begin_ns, window[1], grid.period_ns) if instant >= window[0]]
