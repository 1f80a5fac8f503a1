"""Response times on one CPU where releases lie on grids of one epoch: every busy window of the hyperperiod.

A busy window without offsets begins with a release of each component at once. Offsets can prevent that. So
each instant of a grid at which a window can begin is tried, with the releases that the grids have from then
on. Tasks without a grid ask for the most that they can, from the begin of the window on.

Instants are nominal, and each release comes up to `jitter_ns` late. A window that begins at s has the
releases of instants from s - jitter on. Between two instants of the grids the latest s is the worst one:
later releases come sooner after s. So s - jitter is an instant of a grid.

Source: Palencia, Gonzalez Harbour, "Schedulability Analysis for Tasks with Static and Dynamic Offsets", RTSS
1998: its exact analysis, with all phases known.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate, takewhile
from math import lcm

from mauve_rt.analysis.demand import Demand, Path, cost_of, paths
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, JobTime, level_of
from mauve_rt.analysis.fixed_point import MOST_STEPS, UnboundedError, least_time_ns


@dataclass(frozen=True)
class Grid:
    """Instants at which jobs of a component arrive: offset + k * period after the epoch."""

    period_ns: int
    offset_ns: int

    def from_ns(self, instant_ns: int) -> int:
        """The first instant that is not before this one."""
        return instant_ns + (self.offset_ns - instant_ns) % self.period_ns


Grids = Mapping[str, Grid]
"""By component. The separations of its jobs are multiples of the period."""


def times_with_offsets(
    one: Component, components: Sequence[Component], grids: Grids, without: DigraphTimes
) -> DigraphTimes:
    """The bounds of a component and of its states, which are never above those `without` offsets.

    The longest `jitter_ns` of all components counts for each of them.
    """
    higher, equal = level_of(one, components)
    level = [each for each in (one, *higher, *equal) if each.name in grids]
    hyperperiod_ns = lcm(*(grids[each.name].period_ns for each in level))
    releases = sum(hyperperiod_ns // grids[each.name].period_ns for each in level)
    if without.reason or len(level) <= 1 or releases > MOST_STEPS:
        return without
    jitter_ns = max(each.jitter_ns for each in (one, *higher, *equal))
    windows = _Windows(
        _Own(one, grids.get(one.name)),
        _Work(higher, grids, hyperperiod_ns),
        _Work(equal, grids, hyperperiod_ns),
        without.blocking_ns,
        jitter_ns,
        hyperperiod_ns,
    )
    try:
        longest = windows.longest_ns()
        responses_ns = {
            each.job: min(each.response_ns, longest.get(each.job, each.response_ns)) for each in without.jobs
        }
        response_ns = max(responses_ns.values(), default=0)
        walls_ns = {name: windows.wall_ns(cost_ns, response_ns) for name, cost_ns in one.states}
    except UnboundedError:
        return without
    jobs = tuple(JobTime(job, job_ns) for job, job_ns in responses_ns.items())
    shorter_ns = {
        name: min(wall_ns, walls_ns.get(name, wall_ns)) for name, wall_ns in without.walls_ns.items()
    }
    return replace(without, jobs=jobs, walls_ns=shorter_ns)


class _Work:
    """What some components ask for, by the instants of their grids; of others the most they can ask for."""

    def __init__(self, components: Sequence[Component], grids: Grids, hyperperiod_ns: int) -> None:
        self.components, self._hyperperiod_ns = components, hyperperiod_ns
        self.grids = [grids[each.name] for each in components if each.name in grids]
        self.at_ns: dict[int, int] = {}
        """The work of those that ask for the same at each instant, by instant in the hyperperiod."""
        self._others: list[tuple[Grid | None, Demand]] = []
        for each in components:
            grid = grids.get(each.name)
            cost_ns = _steady_cost_ns(each.task, grid) if grid is not None else None
            if grid is None or cost_ns is None:
                self._others.append((grid, Demand(each.task)))
                continue
            for instant_ns in _instants(grid, hyperperiod_ns):
                self.at_ns[instant_ns] = self.at_ns.get(instant_ns, 0) + cost_ns

    @cached_property
    def _instants_ns(self) -> list[int]:
        return sorted(self.at_ns)

    @cached_property
    def _sums_ns(self) -> list[int]:
        return [0, *accumulate(self.at_ns[instant_ns] for instant_ns in self._instants_ns)]

    def _before_ns(self, instant_ns: int) -> int:
        rounds, rest_ns = divmod(instant_ns, self._hyperperiod_ns)
        return rounds * self._sums_ns[-1] + self._sums_ns[bisect_left(self._instants_ns, rest_ns)]

    def in_ns(self, first_ns: int, end_ns: int) -> int:
        """The most that arrives in the half-open interval."""
        sums_ns = self._before_ns(end_ns) - self._before_ns(first_ns) if self.at_ns else 0
        anchors = ((first_ns if grid is None else grid.from_ns(first_ns), one) for grid, one in self._others)
        return sums_ns + sum(one.in_ns(end_ns - anchor_ns) for anchor_ns, one in anchors)


def _steady_cost_ns(task: DigraphTask, grid: Grid) -> int | None:
    """The most of any job, where a job of this cost can come at each instant of the grid."""
    most_ns = max((cost_of(job) for job in task.jobs), default=0)
    steady = (job for job in task.jobs if job.separation_ns == grid.period_ns and job in task.after(job))
    return most_ns if any(cost_of(job) == most_ns for job in steady) else None


def _instants(grid: Grid, hyperperiod_ns: int) -> range:
    return range(grid.offset_ns % grid.period_ns, hyperperiod_ns, grid.period_ns)


class _Own:
    """The component under analysis."""

    def __init__(self, component: Component, grid: Grid | None) -> None:
        self.grid = grid
        self.demand = Demand(component.task)
        self._ahead = paths(component.task)
        self._found: list[Path] = []

    def anchor_ns(self, first_ns: int) -> int:
        """The earliest arrival from an instant on."""
        return first_ns if self.grid is None else self.grid.from_ns(first_ns)

    def paths(self) -> Iterator[Path]:
        """As those of its task."""
        yield from self._found
        for path in self._ahead:
            self._found.append(path)
            yield path


@dataclass(frozen=True)
class _Windows:
    """The busy windows of a component."""

    own: _Own
    higher: _Work
    equal: _Work
    blocking_ns: int
    jitter_ns: int
    hyperperiod_ns: int

    def longest_ns(self) -> dict[Job, int]:
        """The longest response of each job, over all windows."""
        longest: dict[Job, int] = {}
        for first_ns in self._firsts():
            for job, response_ns in self._responses(first_ns):
                longest[job] = max(response_ns, longest.get(job, 0))
        return longest

    def _firsts(self) -> Iterator[int]:
        """The first instants of windows, in one hyperperiod.

        Not those at which others on grids still have work of earlier instants: the window from there is
        no longer than the one in which that work arrives.
        """
        own = [] if self.own.grid is None else [self.own.grid]
        instants = {
            instant_ns
            for grid in (*own, *self.higher.grids, *self.equal.grids)
            for instant_ns in _instants(grid, self.hyperperiod_ns)
        }
        in_order = sorted(instants)
        arriving = [self.higher.at_ns.get(at_ns, 0) + self.equal.at_ns.get(at_ns, 0) for at_ns in in_order]
        backlog_ns, last_ns = 0, -self.hyperperiod_ns
        for round_ns in (-self.hyperperiod_ns, 0):  # the first round finds the backlog at 0
            for instant_ns, work_ns in zip(in_order, arriving, strict=True):
                at_ns = round_ns + instant_ns
                backlog_ns = max(0, backlog_ns - (at_ns - last_ns))
                if not round_ns and not backlog_ns:
                    yield at_ns
                backlog_ns, last_ns = backlog_ns + work_ns, at_ns

    def _responses(self, first_ns: int) -> Iterator[tuple[Job, int]]:
        """Of the jobs in the window that begins with the releases of instants from `first_ns` on."""
        begin_ns, anchor_ns = first_ns + self.jitter_ns, self.own.anchor_ns(first_ns)
        before_ns = anchor_ns - begin_ns  # any other work
        if before_ns > 0 and self._others_ns(first_ns, anchor_ns) <= before_ns:
            return  # the window ends before a job arrives
        length_ns = least_time_ns(
            lambda time_ns: (
                self.own.demand.in_ns(begin_ns + time_ns - anchor_ns)
                + self._others_ns(first_ns, begin_ns + time_ns)
            ),
            1,
        )
        in_window_ns = begin_ns + length_ns - anchor_ns
        for path in takewhile(lambda one: one.release_ns < in_window_ns, self.own.paths()):
            finish_ns = begin_ns + self._finish_ns(first_ns, path)
            yield path.job, finish_ns - anchor_ns - path.release_ns

    def _others_ns(self, first_ns: int, end_ns: int) -> int:
        """What arrives of others in the half-open interval, and blocking."""
        others_ns = self.higher.in_ns(first_ns, end_ns) + self.equal.in_ns(first_ns, end_ns)
        return self.blocking_ns + others_ns

    def _finish_ns(self, first_ns: int, path: Path) -> int:
        """When the last job of the path is done, from the begin of the window on."""
        begin_ns, equal_ns = first_ns + self.jitter_ns, 0
        if self.equal.components:
            before_ns = path.work_ns - cost_of(path.job)
            start_ns = least_time_ns(
                lambda time_ns: before_ns + self._others_ns(first_ns, begin_ns + time_ns + 1),
                self.blocking_ns + before_ns,
            )
            equal_ns = self.equal.in_ns(first_ns, begin_ns + start_ns + 1)
        return self._execution_ns(first_ns, path.work_ns + equal_ns)

    def _execution_ns(self, first_ns: int, cost_ns: int) -> int:
        begin_ns, fixed_ns = first_ns + self.jitter_ns, self.blocking_ns + cost_ns
        return least_time_ns(
            lambda time_ns: fixed_ns + self.higher.in_ns(first_ns, begin_ns + time_ns), fixed_ns
        )

    def wall_ns(self, cost_ns: int, response_ns: int) -> int:
        """How long an execution can last in a job that ends at most `response_ns` after its arrival.

        Where it begins, no component of higher priority has work.
        """
        longest_ns = 0
        for begin_ns in self._begins(response_ns - cost_ns):
            first_ns = begin_ns - self.jitter_ns
            work_ns = self.blocking_ns + cost_ns + self.higher.in_ns(first_ns, begin_ns + longest_ns)
            if work_ns > longest_ns:  # else it is no longer
                longest_ns = max(longest_ns, self._execution_ns(first_ns, cost_ns))
        return longest_ns

    def _begins(self, latest_ns: int) -> Iterator[int]:
        """The worst instants of executions that begin at most so long after the arrival of their jobs."""
        end_ns, grids = self.hyperperiod_ns, self.higher.grids
        firsts = sorted({first_ns for grid in grids for first_ns in _instants(grid, end_ns)})
        if self.own.grid is None:
            yield from (first_ns + self.jitter_ns for first_ns in firsts or [0])
            return
        twice = [*firsts, *(end_ns + first_ns for first_ns in firsts)]
        for arrival_ns in _instants(self.own.grid, end_ns):
            yield arrival_ns + latest_ns
            from_ns = (arrival_ns - self.jitter_ns) % end_ns
            to_ns = from_ns + min(latest_ns, end_ns)
            for first_ns in twice[bisect_left(twice, from_ns) : bisect_left(twice, to_ns)]:
                yield first_ns + self.jitter_ns
