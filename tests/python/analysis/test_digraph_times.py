"""Response times of digraph tasks: sound against runs, exact for loops, near to exact where paths are few.

MAUVE_ANALYSIS_SETS=10000 tries more sets than CI does.
"""

import os
from dataclasses import replace
from fractions import Fraction
from itertools import product
from random import Random

import networkx as nx
import pytest
from random_digraphs import random_digraph, random_run, random_sections
from schedule_simulation import simulate

from mauve_rt.analysis import digraph_times as module
from mauve_rt.analysis.demand import Demand, paths, utilization_of
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, digraph_times

SETS = int(os.environ.get("MAUVE_ANALYSIS_SETS", "600"))


def loop(name: str, cost: int, separation: int) -> DigraphTask:
    return DigraphTask(name, (Job("W", (), cost, "W", separation, 10**6),))


def random_set(
    random: Random,
    *,
    largest: int = 4,
    most_waits: int = 3,
    with_locks: bool = False,
    with_jitter: bool = False,
) -> list[Component]:
    count = random.randint(2, largest)
    share = random.uniform(0.3, 0.9) / count
    tasks = [
        random_digraph(random, f"T{number}", share=share, most_waits=most_waits) for number in range(count)
    ]
    return [
        Component(
            task,
            random.randint(1, 3),
            jitter_ns=random.choice((0, 0, 3)) if with_jitter else 0,
            sections=random_sections(random, task) if with_locks else (),
        )
        for task in tasks
    ]


# ---- what a task asks for


def all_work(task: DigraphTask, job: Job, left: int) -> int:
    """The most work of paths from a job on whose last release is at most `left` later: by trying all."""
    rest = left - job.separation_ns
    more = max((all_work(task, other, rest) for other in task.after(job)), default=0) if rest >= 0 else 0
    return (job.cost_ns or 0) + more


def test_the_demand_is_that_of_the_costliest_path() -> None:
    for seed in range(60):
        task = random_digraph(Random(seed), "T", share=0.5)  # noqa: S311 - not for secrets
        demand = Demand(task)
        for instant in range(0, 90, 7):
            expected = max(all_work(task, job, instant) for job in task.jobs)
            assert demand.until_ns(instant) == expected, (seed, instant)
            assert demand.in_ns(instant + 1) == expected
        assert demand.in_ns(0) == 0


def test_late_releases_come_closer() -> None:
    demand, late = Demand(loop("T", 3, 10)), Demand(loop("T", 3, 10), jitter_ns=4)
    assert [demand.in_ns(length) for length in (1, 10, 11, 20, 21)] == [3, 3, 6, 6, 9]
    assert [late.in_ns(length) for length in (1, 6, 7, 16, 17)] == [3, 3, 6, 6, 9]
    assert [late.until_ns(instant) for instant in (0, 5, 6, 15, 16)] == [3, 3, 6, 6, 9]


def test_the_utilization_is_that_of_the_densest_cycle() -> None:
    for seed in range(200):
        task = random_digraph(Random(seed), "T", share=0.5, most_waits=4)  # noqa: S311 - not for secrets
        graph = nx.DiGraph((job, other) for job in task.jobs for other in task.after(job))
        ratios = [
            Fraction(sum(job.cost_ns or 0 for job in cycle), sum(job.separation_ns for job in cycle))
            for cycle in nx.simple_cycles(graph)
        ]
        assert utilization_of(task) == max(ratios, default=0), seed


def test_a_task_that_ends_has_no_utilization_and_a_demand_that_ends() -> None:
    first = Job("", (), 3, "A", 10, 10**6)
    last = Job("A", (), 5, "B", 2**63 - 1, 10**6)
    task = DigraphTask("T", (first, last))
    assert utilization_of(task) == 0
    assert [path.job for path in paths(task)] == [last, last] or len([*paths(task)]) == 3
    assert (Demand(task).in_ns(10), Demand(task).in_ns(10**9)) == (5, 8)


# ---- response times


def longest_runs(random: Random, components: list[Component]) -> dict[str, int]:
    """The longest response time of each component in some runs."""
    longest = {one.name: 0 for one in components}
    for _ in range(6):
        dense = random.random() < 0.7
        runs = {
            one.name: random_run(
                random, one.task, until=300, jitter=one.jitter_ns, dense=dense, sections=one.sections
            )
            for one in components
        }
        for name, response in simulate(components, runs).items():
            longest[name] = max(longest[name], response)
    return longest


@pytest.mark.parametrize("with_locks", [False, True])
def test_no_run_is_above_its_bound(*, with_locks: bool) -> None:
    bounded = reached = blocked = 0
    for seed in range(SETS):
        random = Random(seed)  # noqa: S311 - not for secrets
        components = random_set(random, with_locks=with_locks, with_jitter=True)
        found = digraph_times(components)
        longest = longest_runs(random, components)
        for name, one in found.items():
            if one.response_ns is not None:
                assert longest[name] <= one.response_ns, f"seed {seed}, {name}"
                bounded += 1
                blocked += one.blocking_ns > 0
                reached += longest[name] == one.response_ns
    assert bounded > SETS
    assert (blocked > bounded / 5) == with_locks
    assert reached > bounded / (10 if with_locks else 5), "runs come to the bounds"


def no_blocking(_one: Component, _components: list[Component]) -> int:
    return 0


def test_runs_find_that_blocking_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "blocking_ns", no_blocking)
    for seed in range(SETS):
        random = Random(seed)  # noqa: S311 - not for secrets
        components = random_set(random, with_locks=True, with_jitter=True)
        longest = longest_runs(random, components)
        for name, one in digraph_times(components).items():
            if one.response_ns is not None and longest[name] > one.response_ns:
                return
    pytest.fail("no run is above its bound")


def test_never_more_than_as_a_sporadic_task() -> None:
    less = 0
    for seed in range(300):
        components = random_set(Random(seed))  # noqa: S311 - not for secrets
        found = digraph_times(components)
        loops = [
            replace(
                one, task=loop(one.task.name, one.task.largest_cost_ns or 0, one.task.shortest_separation_ns)
            )
            for one in components
        ]
        as_loops = digraph_times(loops)
        for name, one in found.items():
            if as_loops[name].response_ns is None:
                less += one.response_ns is not None
                continue
            assert one.response_ns is not None
            assert one.response_ns <= as_loops[name].response_ns, (seed, name)
            less += one.response_ns < as_loops[name].response_ns
    assert less > 100, "which is what the digraph is for"


def concrete_paths(task: DigraphTask, until: int) -> list[list[tuple[int, int]]]:
    """All paths, as (release, cost), as dense as they may be."""

    def on(job: Job, release: int) -> list[list[tuple[int, int]]]:
        here, later = (release, job.cost_ns or 0), release + job.separation_ns
        following = task.after(job) if later < until else ()
        return [[here, *rest] for other in following for rest in on(other, later)] or [[here]]

    return [path for job in task.jobs for path in on(job, 0)]


def exact(components: list[Component], name: str, until: int) -> int:
    """The longest response at the lowest of distinct priorities: every combination of paths."""
    own = next(one.task for one in components if one.task.name == name)
    others = [concrete_paths(one.task, until) for one in components if one.task.name != name]
    longest = 0
    for combination in product(*others):
        releases = [release for path in combination for release in path]
        for path in concrete_paths(own, until):
            work = 0
            for release, cost in path:
                work += cost
                finish, before = work, -1
                while finish != before:
                    before, finish = finish, work + sum(one for at, one in releases if at < finish)
                longest = max(longest, finish - release)
                if finish <= release + cost and release:
                    break
    return longest


def test_the_bounds_are_within_5_percent_of_exact_for_95_percent() -> None:
    near = total = 0
    for seed in range(250):
        random = Random(seed)  # noqa: S311 - not for secrets
        components = [
            replace(one, priority=1 + number)
            for number, one in enumerate(random_set(random, largest=3, most_waits=2))
        ]
        bound = digraph_times(components)["T0"].response_ns
        if bound is None:
            continue
        truth = exact(components, "T0", min(bound + 1, 120))
        assert truth <= bound, seed
        if bound <= 100:  # the paths tried reach as far
            total += 1
            near += bound <= truth * 1.05
    assert total > 150
    assert near >= 0.95 * total, f"{near} of {total}"


def test_what_is_overloaded_has_no_bound_and_says_so() -> None:
    components = [Component(loop("high", 6, 10), 2), Component(loop("low", 5, 10), 1)]
    found = digraph_times(components)
    assert found["high"].response_ns == 6
    assert found["low"].response_ns is None
    assert found["low"].reason == "the utilization at this priority is 1.1: nothing is left"
