"""No simulated response time exceeds its bound; the critical instant reaches the bound."""

from dataclasses import replace
from random import Random

import pytest
from schedule_simulation import RUN, Release, longest_simulated, simulate
from sporadic_tasks import SporadicTask, response_times
from task_sets import Change, nearly_full, small_set, with_resources

from mauve_rt.analysis.digraph_times import digraph_times


@pytest.mark.parametrize("change", [None, with_resources, nearly_full])
def test_no_response_time_exceeds_its_bound(change: Change | None):
    reached = bounded = 0
    for seed in range(1500):
        random = Random(seed)  # noqa: S311 - no cryptography
        tasks = small_set(random, changed=change)
        bounds = response_times(tasks)
        longest = longest_simulated(random, tasks)
        for task, bound in zip(tasks, bounds, strict=True):
            if bound.response_ns is not None:
                assert longest[task.name] <= bound.response_ns, f"seed {seed}, task {task.name}"
                bounded += 1
                reached += longest[task.name] == bound.response_ns
    assert reached > bounded / 10, "the simulation comes near the bounds"


def test_the_critical_instant_reaches_the_bound():
    """Distinct priorities, no blocking: all first jobs are released at one instant, after their jitter."""
    for seed in range(500):
        random = Random(seed)  # noqa: S311 - no cryptography
        tasks = [replace(task, priority=index + 1) for index, task in enumerate(small_set(random))]
        bounds = response_times(tasks)
        if any(bound.response_ns is None for bound in bounds):
            continue
        start = max(task.jitter_ns for task in tasks)
        releases = {task.name: _dense(task, start, until=start + 2000) for task in tasks}
        expected = {task.name: bound.response_ns for task, bound in zip(tasks, bounds, strict=True)}
        assert simulate(tasks, releases) == expected, f"seed {seed}"


def test_no_response_time_exceeds_its_bound_where_jobs_wait_for_services():
    """Their waits are part of their costs, and their equals count as higher."""
    waited = bounded = too_low = 0
    for seed in range(1500):
        random = Random(seed)  # noqa: S311 - no cryptography
        tasks = small_set(random, changed=random.choice((None, nearly_full)))
        waits = {task.name: random_waits(random, task.cost_ns) for task in tasks}
        found = digraph_times([task.component(waits_for_services=bool(waits[task.name])) for task in tasks])
        longest = longest_simulated(random, tasks, waits=waits)
        in_queue = digraph_times([task.component() for task in tasks])
        too_low += any(longest[name] > (one.response_ns or longest[name]) for name, one in in_queue.items())
        for name, bound in found.items():
            if bound.response_ns is not None:
                assert longest[name] <= bound.response_ns, f"seed {seed}, task {name}"
                bounded += 1
                waited += bool(waits[name])
    assert waited > bounded / 4
    assert too_low > 0, "bounds of threads that stay in the queue"


def random_waits(random: Random, cost_ns: int) -> list[int]:
    """Up to two waits; something of the cost is left to execute."""
    waits: list[int] = []
    while len(waits) < 2 and cost_ns - sum(waits) > 1 and random.random() < 0.6:
        waits.append(random.randint(1, cost_ns - sum(waits) - 1))
    return waits


def _dense(task: SporadicTask, start: int, *, until: int) -> list[Release]:
    arrivals = range(start - task.jitter_ns, until, task.separation_ns)
    return [Release(arrival, max(arrival, start), [(RUN, task.cost_ns)]) for arrival in arrivals]
