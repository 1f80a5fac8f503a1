"""Bounds with offsets: no run is above them, and where priorities are distinct a run comes to each of them.

MAUVE_ANALYSIS_SETS=10000 tries more sets than CI does.
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import lcm
from random import Random

import pytest
from analysis_machines import MS, execution, machine
from random_digraphs import random_sections
from schedule_simulation import LOCK, RUN, UNLOCK, Release, Step, simulate

from mauve_rt.analysis import offsets as module
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, digraph_times
from mauve_rt.analysis.offsets import Grid, times_with_offsets
from mauve_rt.analysis.schedule import Member, run

SETS = int(os.environ.get("MAUVE_ANALYSIS_SETS", "600"))
PERIODS = (4, 5, 6, 8, 10, 12, 15, 20, 24)


@dataclass(frozen=True)
class Placed:
    """Components of one CPU, those with a grid on it."""

    components: list[Component]
    grids: dict[str, Grid]

    @property
    def hyperperiod(self) -> int:
        return lcm(*(grid.period_ns for grid in self.grids.values()))

    def bounds(self) -> tuple[dict[str, DigraphTimes], dict[str, DigraphTimes]]:
        """Without offsets, and with them."""
        without = digraph_times(self.components)
        return without, {
            one.name: times_with_offsets(one, self.components, self.grids, without[one.name])
            for one in self.components
        }


def loop(name: str, cost: int, period: int) -> DigraphTask:
    return DigraphTask(name, (Job("W", (), cost, "W", period, 10**6),))


def plain(random: Random, *, most_period: int = PERIODS[-1]) -> Placed:
    """Periodic components with distinct priorities."""
    count = random.randint(2, 5)
    share = random.uniform(0.4, 1.0) / count
    components, grids = [], {}
    for number in range(count):
        period = random.choice([one for one in PERIODS if one <= most_period])
        task = loop(f"T{number}", max(1, round(share * period * random.uniform(0.4, 1.6))), period)
        components.append(Component(task, 1 + number, states=(("Run", task.jobs[0].cost_ns or 0),)))
        grids[task.name] = Grid(period, random.randrange(period))
    return Placed(components, grids)


def on_grid(random: Random, name: str, *, share: float) -> tuple[DigraphTask, int]:
    """Jobs between waits that are multiples of a period."""
    period = random.choice(PERIODS)
    waits = {f"W{number}": period * random.choice((1, 1, 1, 2)) for number in range(random.randint(1, 3))}
    jobs = [
        Job(after, (), max(1, round(share * period * random.uniform(0.3, 1.5))), until, waits[until], 10**6)
        for after in waits
        for until in random.sample([*waits], random.randint(1, len(waits)))
    ]
    return DigraphTask(name, tuple(jobs)), period


def mixed(random: Random) -> Placed:
    """With paths, equal priorities, late releases, locks, and tasks without a grid."""
    count = random.randint(2, 5)
    share = random.uniform(0.3, 0.9) / count
    jitter = random.choice((0, 0, 1, 3))
    with_locks = random.random() < 0.4
    components, grids = [], {}
    for number in range(count):
        task, period = on_grid(random, f"T{number}", share=share)
        if random.random() < 0.75:
            grids[task.name] = Grid(period, random.randrange(2 * period))
        sections = random_sections(random, task) if with_locks else ()
        longest = max(job.cost_ns or 0 for job in task.jobs)
        states = (("Run", longest),)
        priority = random.randint(1, 3)
        components.append(Component(task, priority, jitter_ns=jitter, sections=sections, states=states))
    return Placed(components, grids)


def path(random: Random, placed: Placed, one: Component, until: int) -> Iterator[Release]:
    """One way through its jobs; `dense`: as early as it may."""
    job, grid = random.choice(one.task.jobs), placed.grids.get(one.name)
    arrival = grid.offset_ns % grid.period_ns if grid else random.randint(0, 40)
    last, dense = 0, random.random() < 0.6
    while arrival < until:
        last = max(last, arrival + random.choice((0, one.jitter_ns)))
        yield Release(arrival, last, program(random, one, job))
        more = 0 if dense else random.choice((0, 0, random.randint(0, 2)))
        arrival += job.separation_ns + (more * grid.period_ns if grid else more * random.randint(1, 5))
        following = one.task.after(job)
        if not following:
            return
        job = random.choice(following)


def program(random: Random, one: Component, job: Job) -> list[Step]:
    left, steps = job.cost_ns or 0, list[Step]()
    for section in random.sample(one.sections, len(one.sections)):
        before = random.randint(0, left // 2)
        held = min(section.length_ns, left - before)
        if held:
            steps += [(RUN, before)] if before else []
            steps += [(LOCK, section.resource), (RUN, held), (UNLOCK, section.resource)]
            left -= before + held
    return [*steps, (RUN, left)] if left else steps


def longest_runs(random: Random, placed: Placed, *, runs: int = 6) -> dict[str, int]:
    longest = {one.name: 0 for one in placed.components}
    until = max(200, min(2 * placed.hyperperiod + 50, 500)) if placed.grids else 200
    for _ in range(runs):
        order = random.sample(placed.components, len(placed.components))
        releases = {one.name: [*path(random, placed, one, until)] for one in order}
        for name, response in simulate(order, releases).items():
            longest[name] = max(longest[name], response)
    return longest


def periodic(placed: Placed, one: Component, first: int, until: int) -> list[Release]:
    """Each job from an instant on; those that arrive within the jitter come together at its end."""
    job, grid, begin = one.task.jobs[0], placed.grids.get(one.name), first + one.jitter_ns
    arrivals = range(grid.from_ns(first) if grid else first, until, job.separation_ns)
    return [Release(at, max(at, begin), [(RUN, job.cost_ns or 0)]) for at in arrivals]


def longest_of_all(placed: Placed, most: int) -> dict[str, int]:
    """The longest responses of runs that begin at each instant of the hyperperiod."""
    longest = {one.name: 0 for one in placed.components}
    for first in range(placed.hyperperiod):
        releases = {one.name: periodic(placed, one, first, first + most) for one in placed.components}
        for name, response in simulate(placed.components, releases).items():
            longest[name] = max(longest[name], response)
    return longest


@pytest.mark.parametrize("late", [False, True], ids=["on time", "late"])
@pytest.mark.parametrize("threads", [False, True], ids=["all on grids", "one thread without a grid"])
def test_each_bound_is_the_longest_response_of_a_run(*, late: bool, threads: bool) -> None:
    shorter = total = 0
    for seed in range(SETS // 10):
        random = Random(seed)  # noqa: S311 - not for secrets
        placed = plain(random, most_period=12)
        jitter = random.randint(1, 3) if late else 0
        components = [replace(one, jitter_ns=jitter) for one in placed.components]
        grids = dict(placed.grids)
        if threads:
            del grids[random.choice([*grids])]
        placed = Placed(components, grids)
        without, with_them = placed.bounds()
        responses = [one.response_ns for one in without.values()]
        if not grids or None in responses:
            continue
        longest = longest_of_all(placed, 3 * placed.hyperperiod)
        for name, one in with_them.items():
            assert one.response_ns is not None
            if len(grids) > 1:
                assert one.response_ns == longest[name], (seed, name)
                total += 1
            shorter += one.response_ns < (without[name].response_ns or 0)
    assert total > SETS / 10
    assert shorter > total / 20


def test_no_run_is_above_a_bound_with_offsets() -> None:
    shorter = 0
    for seed in range(2 * SETS):
        random = Random(seed)  # noqa: S311 - not for secrets
        placed = mixed(random)
        without, with_them = placed.bounds()
        longest = longest_runs(random, placed)
        for name, one in with_them.items():
            simple = without[name].response_ns
            if simple is None:
                continue
            assert one.response_ns is not None
            assert longest[name] <= one.response_ns <= simple, (seed, name)
            shorter += one.response_ns < simple
    assert shorter > SETS / 4


def test_random_sets_are_schedulable_only_with_offsets() -> None:
    """About 8 % of sets of two to five components: each deadline is the period, offsets are random."""
    only = 0
    for seed in range(SETS):
        placed = plain(Random(seed))  # noqa: S311 - not for secrets
        without, with_them = placed.bounds()
        only += meets_deadlines(placed, with_them) and not meets_deadlines(placed, without)
    assert only > SETS / 100, only


def meets_deadlines(placed: Placed, times: dict[str, DigraphTimes]) -> bool:
    return all(
        (response := times[one.name].response_ns) is not None and response <= one.task.jobs[0].separation_ns
        for one in placed.components
    )


class OnTheGrid:
    """Each job as early as it may be, but for a late wake-up."""

    def __init__(self, random: Random, jitter: int) -> None:
        self.random, self.jitter = random, jitter

    def first(self, member: Member) -> tuple[Job, int]:
        return member.task.jobs[0], member.machine.offset_ns

    def next(self, member: Member, job: Job) -> tuple[Job, int]:
        return member.task.after(job)[0], job.separation_ns

    def late_ns(self) -> int:
        return self.random.choice((0, self.jitter))

    def before_locks_ns(self, left_ns: int) -> int:
        return left_ns


def test_no_state_lasts_longer_than_its_bound_with_offsets() -> None:
    reached = shorter = total = 0
    for seed in range(SETS // 3):
        random = Random(seed)  # noqa: S311 - not for secrets
        placed, jitter = plain(random, most_period=12), random.choice((0, 0, 2))
        placed = Placed([replace(one, jitter_ns=jitter) for one in placed.components], placed.grids)
        without, with_them = placed.bounds()
        machines = [
            machine(execution("Run", bound_ms=one.states[0][1] / MS), name=one.name, priority=one.priority)
            for one in placed.components
        ]
        members = []
        for one, found in zip(placed.components, machines, strict=True):
            job = replace(one.task.jobs[0], states=("Run",))
            of_run = replace(found, offset_ns=placed.grids[one.name].offset_ns, overrun="catch_up")
            members.append(Member(of_run, DigraphTask(one.name, (job,))))
        longest = dict.fromkeys(with_them, 0)
        cycles = run(members, OnTheGrid(random, jitter), most_jobs=300).cycles
        for cycle in cycles:
            for _, begin, end in cycle.states:
                longest[cycle.component] = max(longest[cycle.component], end - begin)
        for name, one in with_them.items():
            if one.reason:
                continue
            assert longest[name] <= one.walls_ns["Run"] <= without[name].walls_ns["Run"], (seed, name)
            total += 1
            reached += longest[name] == one.walls_ns["Run"]
            shorter += one.walls_ns["Run"] < without[name].walls_ns["Run"]
    assert total > SETS / 2
    assert reached > total / 3
    assert shorter > total / 50


def test_too_many_releases_leave_the_bound_without_offsets(monkeypatch: pytest.MonkeyPatch) -> None:
    placed = Placed(
        [Component(loop("low", 5, 10), 1), Component(loop("high", 4, 10), 2)],
        {"low": Grid(10, 5), "high": Grid(10, 0)},
    )
    assert placed.bounds()[1]["low"].response_ns == 5
    monkeypatch.setattr(module, "MOST_STEPS", 1)
    without, with_them = placed.bounds()
    assert with_them == without
    assert with_them["low"].response_ns == 9


def test_the_load_of_components_that_fill_the_processor() -> None:
    """An offset leaves no backlog where the demand in a hyperperiod is all of it."""
    full = Placed(
        [Component(loop("low", 5, 10), 1), Component(loop("high", 5, 10), 2)],
        {"low": Grid(10, 15), "high": Grid(10, 0)},
    )
    assert full.bounds()[1]["low"].response_ns == 5


# ---- mistakes that the runs find


def every_release_at_its_instant(windows: module._Windows, first_ns: int) -> Iterator[tuple[Job, int]]:
    return RESPONSES(replace(windows, jitter_ns=0), first_ns)


def only_jobs_of_own_instants(windows: module._Windows) -> Iterator[int]:
    """As if each job began a window: nothing is left of work that was released before."""
    grid = windows.own.grid
    return (
        FIRSTS(windows)
        if grid is None
        else iter(range(grid.offset_ns, windows.hyperperiod_ns, grid.period_ns))
    )


RESPONSES, FIRSTS = module._Windows._responses, module._Windows._firsts
MUTANTS: dict[str, tuple[object, str, object]] = {
    "offset ignored": (module, "_instants", lambda grid, end_ns: range(0, end_ns, grid.period_ns)),
    "work from before forgotten": (module._Windows, "_firsts", only_jobs_of_own_instants),
    "jitter forgotten": (module._Windows, "_responses", every_release_at_its_instant),
    "equal priorities forgotten": (module, "level_of", lambda one, all_: (LEVEL_OF(one, all_)[0], [])),
}
LEVEL_OF = module.level_of


@pytest.mark.parametrize("name", MUTANTS)
def test_the_runs_find(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(*MUTANTS[name])
    for seed in range(2 * SETS):
        random = Random(seed)  # noqa: S311 - not for secrets
        placed = mixed(random)
        longest = longest_runs(random, placed)
        for one, bound in placed.bounds()[1].items():
            if bound.response_ns is not None and longest[one] > bound.response_ns:
                return
    pytest.fail("no run is above its bound")
