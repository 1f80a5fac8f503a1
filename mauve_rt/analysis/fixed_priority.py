"""Response times of all tasks under SCHED_FIFO: fixed priority, preemptive, no preemption among equals.

**Waits** for ROS services are self-suspensions. Source: Chen et al., "Many suspensions, many problems: a
review of self-suspending tasks in real-time systems", Real-Time Systems 55, 2019, on suspension as release
jitter. A task's own waits count as execution. A waiting task of higher priority counts as a stream with
jitter R - C, its response time minus its cost. The paper lists jitter S, the duration of the waits, as a
flaw of published analyses. The bound R - C holds in windows of several jobs, too: among the pending jobs of
such a task, the first executes x <= C in [0, t), so it arrived at x - R or later, and the next ones are
separated from it as usual. While a job waits, tasks of lower priority may lock resources again, so each
wait adds one more blocking.

**Equal priorities.** Tasks of equal priority do not preempt a task that never leaves the kernel's queue
between release and finish: a task without waits and without shared resources (see `window`). A thread that
waits goes to the end of the queue when it wakes up, so for such a task all others of its priority count as
higher. If a task of equal priority waits, its deadline stands for its response time; the bound is used only
if that deadline holds.
"""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mauve_rt.analysis.blocking import blocking_ns, shares_a_resource
from mauve_rt.analysis.errors import AnalysisError
from mauve_rt.analysis.task import Task
from mauve_rt.analysis.window import Arrivals, Level, UnboundedError, job_bounds, window_ns


@dataclass(frozen=True, kw_only=True)
class ResponseTime:
    """The bound of one task.

    Attributes:
        task: the task.
        response_ns: longest time from arrival to finish; None if there is no bound.
        reason: why there is no bound; empty if there is one.
        blocking_ns: execution of lower priorities in a busy window.
        window_ns: length of the longest busy window.
        worst_job: number of the job in the window, from 0, that reaches the bound.

    """

    task: Task
    response_ns: int | None
    reason: str = ""
    blocking_ns: int = 0
    window_ns: int = 0
    worst_job: int = 0

    @property
    def meets_deadline(self) -> bool:
        """Whether each job is known to finish by its deadline."""
        return self.response_ns is not None and self.response_ns <= self.task.deadline_ns


def response_times(tasks: Sequence[Task]) -> list[ResponseTime]:
    """The bounds of all tasks, in the order of the tasks.

    Args:
        tasks: all tasks with threads on the CPUs that are analysed.

    Raises:
        AnalysisError: two tasks have one name, or locks are nested in both orders.

    """
    for name, count in Counter(task.name for task in tasks).items():
        if count > 1:
            found = f"{count} tasks"
            raise AnalysisError(
                f"task {name}", "name", expected="one task", found=found, remedy="Rename the others"
            )
    found_by_name: dict[str, ResponseTime] = {}
    for cpu in {task.cpu for task in tasks}:
        here = [task for task in tasks if task.cpu == cpu]
        elsewhere = {name for task in tasks if task.cpu != cpu for name in task.resources}
        remote = sorted(elsewhere & {name for task in here for name in task.resources})
        if remote:
            reason = f"resource {remote[0]} is shared with another CPU: the bound on blocking is for one CPU"
            bounds = [ResponseTime(task=task, response_ns=None, reason=reason) for task in here]
        else:
            bounds = _of_cpu(here)
        found_by_name.update((bound.task.name, bound) for bound in bounds)
    return [found_by_name[task.name] for task in tasks]


def release_jitter_ns(task: Task) -> int:
    """The longest delay from arrival to release: what the machine needs to wake the thread up."""
    return task.jitter_ns


def interference_jitter_ns(task: Task, response_ns: int) -> int:
    """The jitter of a task as others see it: R - C for a task that waits (Chen et al. 2019)."""
    if not task.waits_ns:
        return release_jitter_ns(task)
    return max(release_jitter_ns(task), response_ns - task.cost_ns)


def _of_cpu(tasks: list[Task]) -> list[ResponseTime]:
    by_priority: dict[int, list[Task]] = defaultdict(list)
    for task in tasks:
        by_priority[task.priority].append(task)
    found: list[ResponseTime] = []
    for priority in sorted(by_priority, reverse=True):
        found += _of_equals(by_priority[priority], tasks=tasks, higher=tuple(found))
    return found


def _of_equals(
    equals: list[Task], *, tasks: list[Task], higher: tuple[ResponseTime, ...]
) -> list[ResponseTime]:
    """The bounds of the tasks of one priority."""
    missing = [bound.task.name for bound in higher if bound.task.waits_ns and bound.response_ns is None]
    if missing:
        reason = f"task {missing[0]} of higher priority waits for services and has no bound"
        return [ResponseTime(task=task, response_ns=None, reason=reason) for task in equals]
    above = tuple(_stream(bound.task, bound.response_ns or 0) for bound in higher)
    levels = [_level(task, equals, tasks=tasks, above=above) for task in equals]
    return _without_broken_assumptions([_bound(*pair) for pair in zip(equals, levels, strict=True)])


def _level(task: Task, equals: list[Task], *, tasks: list[Task], above: tuple[Arrivals, ...]) -> Level:
    """All that delays a task."""
    blocking = blocking_ns(task, tasks)
    own_ns = task.cost_ns + sum(task.waits_ns) + blocking * len(task.waits_ns)
    others = tuple(_stream(other, other.deadline_ns) for other in equals if other is not task)
    in_queue = _stays_in_queue(task, tasks)
    return Level(
        own=Arrivals(separation_ns=task.separation_ns, cost_ns=own_ns, jitter_ns=release_jitter_ns(task)),
        blocking_ns=blocking,
        higher=above if in_queue else (*above, *others),
        equal=others if in_queue else (),
    )


def _stream(task: Task, response_ns: int) -> Arrivals:
    jitter_ns = interference_jitter_ns(task, response_ns)
    return Arrivals(separation_ns=task.separation_ns, cost_ns=task.cost_ns, jitter_ns=jitter_ns)


def _bound(task: Task, level: Level) -> ResponseTime:
    try:
        worst = max(job_bounds(level), key=lambda job: job.response_ns)
        length_ns = window_ns(level)
    except UnboundedError as reason:
        return ResponseTime(task=task, response_ns=None, reason=str(reason), blocking_ns=level.blocking_ns)
    return ResponseTime(
        task=task,
        response_ns=worst.response_ns,
        blocking_ns=level.blocking_ns,
        window_ns=length_ns,
        worst_job=worst.number,
    )


def _stays_in_queue(task: Task, tasks: list[Task]) -> bool:
    """Whether the thread of a task is in the queue from release to finish."""
    return not task.waits_ns and not shares_a_resource(task, tasks)


def _without_broken_assumptions(bounds: list[ResponseTime]) -> list[ResponseTime]:
    """Withdraw each bound that relies on the deadline of another task, if that task can miss its deadline."""
    while True:
        broken = {bound.task.name for bound in bounds if bound.task.waits_ns and not bound.meets_deadline}
        kept = [
            _withdrawn(bound, name)
            if bound.response_ns is not None and (name := min(broken - {bound.task.name}, default=""))
            else bound
            for bound in bounds
        ]
        if kept == bounds:
            return bounds
        bounds = kept


def _withdrawn(bound: ResponseTime, name: str) -> ResponseTime:
    reason = f"task {name} of equal priority waits for services and can miss its deadline"
    return replace(bound, response_ns=None, reason=reason)
