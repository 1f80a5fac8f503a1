"""The busy window of one priority level, and the finish of each job in it.

Sources: Lehoczky, "Fixed priority scheduling of periodic task sets with arbitrary deadlines", RTSS 1990
(busy window, every job of it); Tindell, Burns, Wellings, "An extendible approach for analyzing fixed
priority hard real-time tasks", Real-Time Systems 6, 1994 (release jitter, blocking).

Time 0 is the start of the busy window. Intervals of execution are half-open: a job that finishes at F
occupied [0, F), and a job of higher priority that is released at F itself does not delay it. Intervals
before a start are closed: a job that starts at S has waited for all jobs of higher and equal priority
released in [0, S].

Under SCHED_FIFO, a job of equal priority that is released later does not preempt. That does not make jobs
first in, first out: the kernel queues threads, and a thread keeps its place until it sleeps. A thread with
a backlog goes on with jobs that are released after those of the threads behind it. So all jobs of equal
priority released up to the start count, not only those released up to the job's own release. Both are equal
where each job of equal priority finishes before the next one of its thread is released.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction

# Jobs, or steps of a fixed point: some seconds of work. A utilization very close to 1 can need more.
MOST_STEPS = 200_000


class UnboundedError(Exception):
    """There is no bound, or it takes too many steps to find. `str()` is the reason."""


@dataclass(frozen=True, kw_only=True)
class Arrivals:
    """A stream of jobs: least separation of arrivals, cost of a job, longest delay of a release."""

    separation_ns: int
    cost_ns: int
    jitter_ns: int = 0


@dataclass(frozen=True, kw_only=True)
class Level:
    """A task under analysis and all that can delay it.

    Attributes:
        own: the task under analysis.
        blocking_ns: execution of lower priorities in the busy window.
        higher: streams that always go first.
        equal: streams that go first if they are released before the job starts.

    """

    own: Arrivals
    blocking_ns: int = 0
    higher: tuple[Arrivals, ...] = ()
    equal: tuple[Arrivals, ...] = ()


@dataclass(frozen=True)
class JobBound:
    """A job of the window, numbered from 0: earliest arrival and latest finish, from the window's start."""

    number: int
    arrival_ns: int
    finish_ns: int

    @property
    def response_ns(self) -> int:
        """From arrival, not release, to finish."""
        return self.finish_ns - self.arrival_ns


def jobs_in(length_ns: int, stream: Arrivals) -> int:
    """The most jobs released in a half-open interval of this length: ceil((length + jitter) / separation)."""
    return -(-(length_ns + stream.jitter_ns) // stream.separation_ns) if length_ns > 0 else 0


def jobs_until(instant_ns: int, stream: Arrivals) -> int:
    """The most jobs released in the closed [0, instant]: floor((instant + jitter) / separation) + 1."""
    return (instant_ns + stream.jitter_ns) // stream.separation_ns + 1


def own_work_ns(level: Level, number: int) -> int:
    """The task's own execution up to the end of job `number`: the jobs before carry their work over."""
    return (number + 1) * level.own.cost_ns


def window_ns(level: Level) -> int:
    """The longest busy window: the least L > 0 with blocking + sum of jobs_in(L) * cost <= L (Lehoczky 1990).

    Raises:
        UnboundedError: the utilization exceeds 1, or is 1 and there is blocking or jitter.

    """
    streams = (level.own, *level.higher, *level.equal)
    load = sum(Fraction(stream.cost_ns, stream.separation_ns) for stream in streams)
    if load > 1:
        raise UnboundedError(f"the utilization at this priority is {float(load):.4g}, above 1")
    if load == 1 and (level.blocking_ns or any(stream.jitter_ns for stream in streams)):
        raise UnboundedError("the utilization at this priority is 1, and blocking or jitter exceeds it")
    fixed_ns, start_ns = level.blocking_ns, sum(stream.cost_ns for stream in streams)
    return least_time_ns(lambda length_ns: fixed_ns + _work_ns(streams, length_ns), start_ns)


def job_numbers(level: Level) -> range:
    """The numbers of the task's jobs in its longest busy window, from 0.

    Raises:
        UnboundedError: as for `window_ns`, or the window has too many jobs.

    """
    count = jobs_in(window_ns(level), level.own)
    _limit(count)
    return range(count)


def job_bounds(level: Level) -> Iterator[JobBound]:
    """The bounds of every job of the busy window.

    Job q arrives at q * separation - jitter at the earliest, since the first job of the window is released at
    0 or later (Tindell 1994). No later arrival is worse: the bound on the finish does not depend on it.

    Raises:
        UnboundedError: as for `job_numbers`.

    """
    start_ns = finish_ns = 0
    for number in job_numbers(level):
        start_ns = _start_ns(level, number, least_ns=start_ns)
        finish_ns = _finish_ns(level, number, start_ns=start_ns, least_ns=finish_ns)
        yield JobBound(number, number * level.own.separation_ns - level.own.jitter_ns, finish_ns)


def least_time_ns(work_ns: Callable[[int], int], start_ns: int) -> int:
    """The least time t >= start with work(t) <= t; `work_ns` never decreases.

    Raises:
        UnboundedError: not found within `MOST_STEPS` steps.

    """
    time_ns = start_ns
    for _ in range(MOST_STEPS):
        needed_ns = work_ns(time_ns)
        if needed_ns <= time_ns:
            return time_ns
        time_ns = needed_ns
    _limit(MOST_STEPS)
    raise AssertionError


def _start_ns(level: Level, number: int, *, least_ns: int) -> int:
    """The least S with blocking + own work of the jobs before + work of all others in [0, S] <= S.

    Only for tasks of equal priority: 0 if there is none.
    """
    if not level.equal:
        return 0
    before_ns = level.blocking_ns + own_work_ns(level, number) - level.own.cost_ns
    others = (*level.higher, *level.equal)
    return least_time_ns(
        lambda time_ns: before_ns + sum(jobs_until(time_ns, stream) * stream.cost_ns for stream in others),
        max(least_ns, before_ns),
    )


def _finish_ns(level: Level, number: int, *, start_ns: int, least_ns: int) -> int:
    """The least F with blocking + own work + work of equals in [0, S] + higher work in [0, F) <= F."""
    equal_ns = sum(jobs_until(start_ns, stream) * stream.cost_ns for stream in level.equal)
    fixed_ns = level.blocking_ns + own_work_ns(level, number) + equal_ns
    return least_time_ns(lambda end_ns: fixed_ns + _work_ns(level.higher, end_ns), max(least_ns, fixed_ns))


def _work_ns(streams: tuple[Arrivals, ...], length_ns: int) -> int:
    return sum(jobs_in(length_ns, stream) * stream.cost_ns for stream in streams)


def _limit(count: int) -> None:
    if count >= MOST_STEPS:
        raise UnboundedError(f"the busy window has more than {MOST_STEPS} steps")
