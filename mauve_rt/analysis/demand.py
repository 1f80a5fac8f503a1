"""How much a digraph task can ask for in any interval: its request bound function, and its utilization.

Source: Stigge, Ekberg, Guan, Yi, "The Digraph Real-Time Task Model", RTAS 2011: paths are abstracted to
tuples (time since the first release, work so far, job), and one that another of the same job dominates is
left out. Here each path ends in its first instant with more work than any before: what remains is the whole
function, a staircase.
"""

import heapq
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import NamedTuple

from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.fixed_point import MOST_STEPS, UnboundedError
from mauve_rt.analysis.machines import FOREVER_NS

_MOST_PATHS = 100  # that are looked at, of a task


class Path(NamedTuple):
    """A way through a digraph, by what the analysis needs of it."""

    release_ns: int
    """Of its last job, after the release of the first one."""
    work_ns: int
    """Of all its jobs."""
    job: Job
    """The last one."""


def paths(task: DigraphTask) -> Iterator[Path]:
    """Paths by the release of their last job; for each job those that no earlier one of it dominates.

    Endless, unless the task ends.

    Raises:
        UnboundedError: they are too many to look at.

    """
    costs_ns = [cost_of(job) for job in task.jobs]
    numbers = {job: number for number, job in enumerate(task.jobs)}
    followers = [[numbers[other] for other in task.after(job)] for job in task.jobs]
    most_ns = [0] * len(task.jobs)
    waiting = [(0, -cost_ns, number) for number, cost_ns in enumerate(costs_ns)]
    heapq.heapify(waiting)
    steps = 0
    while waiting:
        release_ns, negative_ns, number = heapq.heappop(waiting)
        work_ns, job = -negative_ns, task.jobs[number]
        if work_ns <= most_ns[number]:
            continue
        most_ns[number] = work_ns
        if (steps := steps + 1) > MOST_STEPS:
            raise UnboundedError(f"the busy window has more than {MOST_STEPS} steps")
        yield Path(release_ns, work_ns, job)
        if job.separation_ns == FOREVER_NS:
            continue
        for follower in followers[number]:
            work = work_ns + costs_ns[follower]
            if work > most_ns[follower]:
                heapq.heappush(waiting, (release_ns + job.separation_ns, -work, follower))


def cost_of(job: Job) -> int:
    """Of a job whose cost is known; one that executes nothing has to get the processor all the same: 1 ns."""
    return max(job.cost_ns or 0, 1)


class Staircase:
    """Work by the instants from which on it may be asked for."""

    def __init__(self) -> None:
        self._instants_ns: list[int] = []
        self._work_ns: list[int] = []  # all until then

    def add(self, instant_ns: int, work_ns: int) -> None:
        """Up to and with this instant; later ones are added later."""
        self._instants_ns.append(instant_ns)
        self._work_ns.append(work_ns)

    def in_ns(self, length_ns: int) -> int:
        """In a half-open interval of this length."""
        if length_ns <= 0:
            return 0
        self._look_to(length_ns)
        return self._before(bisect_left(self._instants_ns, length_ns))

    def until_ns(self, instant_ns: int) -> int:
        """In the closed [0, instant]."""
        self._look_to(instant_ns)
        return self._before(bisect_right(self._instants_ns, instant_ns))

    def dominates(self, other: "Staircase") -> bool:
        """Whether it has no less work at any instant."""
        return all(
            self._before(bisect_right(self._instants_ns, instant_ns)) >= work_ns
            for instant_ns, work_ns in other.found()
        )

    def found(self) -> Iterator[tuple[int, int]]:
        """The instants so far, each with the work until then."""
        return zip(self._instants_ns, self._work_ns, strict=True)

    def steps(self, until_ns: int, *, after: int) -> list[tuple[int, int]]:
        """At which instants more comes and how much, but for the first `after` ones."""
        self._look_to(until_ns)
        end = bisect_right(self._instants_ns, until_ns)
        return [
            (self._instants_ns[step], self._work_ns[step] - self._before(step)) for step in range(after, end)
        ]

    def _before(self, step: int) -> int:
        return self._work_ns[step - 1] if step else 0

    def _look_to(self, instant_ns: int) -> None:
        """All that comes up to then is there."""


class Together(Staircase):
    """What several ask for, as one: each question looks at all of them once."""

    def __init__(self, parts: Sequence[Staircase]) -> None:
        super().__init__()
        self._parts = parts
        self._taken = [0] * len(parts)  # steps of each that are in it
        self._until_ns = -1

    def _look_to(self, instant_ns: int) -> None:
        if instant_ns <= self._until_ns:
            return
        found: list[tuple[int, int]] = []
        for number, part in enumerate(self._parts):
            steps = part.steps(instant_ns, after=self._taken[number])
            self._taken[number] += len(steps)
            found += steps
        work_ns = self._before(len(self._work_ns))
        for at_ns, more_ns in sorted(found):
            work_ns += more_ns
            self.add(at_ns, work_ns)
        self._until_ns = instant_ns


class Demand(Staircase):
    """The most that jobs of a task, released in an interval, ask for: whatever paths they are of.

    Each release comes up to `jitter_ns` late. Its answers raise UnboundedError where there are too many paths
    to look at.
    """

    def __init__(self, task: DigraphTask, *, jitter_ns: int = 0) -> None:
        super().__init__()
        self._task, self._jitter_ns = task, jitter_ns
        self._paths = paths(task)
        self._failure: UnboundedError | None = None
        self._ahead: Path | None = next(self._paths, None)

    def _look_to(self, instant_ns: int) -> None:
        while self._ahead is not None and self._ahead.release_ns <= instant_ns + self._jitter_ns:
            if self._failure is not None:  # nothing is known of what comes after this one
                raise self._failure
            if not self._work_ns or self._ahead.work_ns > self._work_ns[-1]:
                self.add(self._at_ns(self._ahead.release_ns), self._ahead.work_ns)
            try:
                self._ahead = next(self._paths, None)
            except UnboundedError as error:
                self._failure = error

    def _at_ns(self, release_ns: int) -> int:
        return max(release_ns - self._jitter_ns, 0)

    def of_each_path(self, until_ns: int, *, most: int) -> list[Staircase] | None:
        """One for each path that no other one dominates, up to then; None: there are more than `most`."""
        if len(self._task.jobs) == 1:
            return [self]
        found: list[Staircase] = []
        for count, releases in enumerate(_all_paths(self._task, until_ns + self._jitter_ns)):
            if count >= _MOST_PATHS:
                return None
            one, work_ns = Staircase(), 0
            for release_ns, cost_ns in releases:
                work_ns += cost_ns
                one.add(self._at_ns(release_ns), work_ns)
            if not any(other.dominates(one) for other in found):
                found = [other for other in found if not one.dominates(other)] + [one]
        return found if len(found) <= most else None


def _all_paths(task: DigraphTask, until_ns: int) -> Iterator[list[tuple[int, int]]]:
    """Release and cost of each job, as dense as they may be, of every path that lasts until then."""
    waiting = [[(job, 0)] for job in task.jobs]
    while waiting:
        path = waiting.pop()
        job, release_ns = path[-1]
        next_ns = release_ns + job.separation_ns
        following = task.after(job) if next_ns <= until_ns else ()
        if following:
            waiting += [[*path, (other, next_ns)] for other in following]
        else:
            yield [(release_ns, cost_of(job)) for job, release_ns in path]


def utilization_of(task: DigraphTask) -> Fraction:
    """The largest share of a processor that a cycle of the task asks for; 0: it has no cycle.

    By Dinkelbach's method: from a cycle to one with a larger ratio, until there is none.
    """
    ratio = Fraction(0)
    while (cycle := _better_cycle(task, ratio)) is not None:
        ratio = Fraction(sum(map(cost_of, cycle)), sum(job.separation_ns for job in cycle))
    return ratio


def _better_cycle(task: DigraphTask, ratio: Fraction) -> list[Job] | None:
    """A cycle whose work exceeds `ratio` of its length, by Bellman and Ford; None: there is none."""
    gains = dict.fromkeys(range(len(task.jobs)), 0)  # times the ratio's denominator
    before: dict[int, int] = {}
    numbers = {job: number for number, job in enumerate(task.jobs)}
    edges = [
        (
            numbers[job],
            numbers[other],
            cost_of(job) * ratio.denominator - ratio.numerator * job.separation_ns,
        )
        for job in task.jobs
        if job.separation_ns != FOREVER_NS
        for other in task.after(job)
    ]
    for _ in range(len(task.jobs) + 1):
        changed = [other for job, other, gain in edges if _relax(gains, before, job, other, gain)]
        if not changed:
            return None
    at = changed[-1]
    for _ in task.jobs:  # into the cycle
        at = before[at]
    cycle = [at]
    while (at := before[at]) != cycle[0]:
        cycle.append(at)
    return [task.jobs[number] for number in cycle]


def _relax(gains: dict[int, int], before: dict[int, int], job: int, other: int, gain: int) -> bool:
    if gains[job] + gain <= gains[other]:
        return False
    gains[other], before[other] = gains[job] + gain, job
    return True
