"""No simulated response time exceeds its bound; the critical instant reaches the bound."""

from dataclasses import replace
from random import Random

import pytest
from schedule_simulation import RUN, WAIT, Release, longest_simulated, simulate
from task_sets import Change, small_set, with_both, with_resources, with_waits
from textbook_sets import EXAMPLES

from mauve_rt.analysis import Task, response_times


@pytest.mark.parametrize("change", [None, with_resources, with_waits, with_both])
def test_no_response_time_exceeds_its_bound(change: Change | None):
    reached = bounded = 0
    for seed in range(1500):
        random = Random(seed)  # noqa: S311 - no cryptography
        tasks = small_set(random, changed=change)
        bounds = {bound.task.name: bound.response_ns for bound in response_times(tasks)}
        longest = longest_simulated(random, tasks)
        for name, bound_ns in bounds.items():
            if bound_ns is not None:
                assert longest[name] <= bound_ns, f"seed {seed}, task {name}"
                bounded += 1
                reached += longest[name] == bound_ns
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
        assert simulate(tasks, releases) == {bound.task.name: bound.response_ns for bound in bounds}, (
            f"seed {seed}"
        )


def test_waits_delay_more_than_their_duration_as_jitter():
    """Chen et al. 2019: b waits where it could run, so two whole jobs of b delay c, which arrives at 10."""
    a, b, c = next(example for example in EXAMPLES if "Chen" in example.name).tasks
    waits_first = [*((WAIT, wait_ns) for wait_ns in b.waits_ns), (RUN, b.cost_ns)]
    releases = {
        "a": _dense(a, 0, until=100),
        "b": [Release(0, 0, waits_first), Release(20, 20, [(RUN, b.cost_ns)])],
        "c": [Release(10, 10, [(RUN, c.cost_ns)])],
    }
    longest = simulate([a, b, c], releases)
    assert longest == {"a": 1, "b": 20, "c": 22}


def _dense(task: Task, start: int, *, until: int) -> list[Release]:
    arrivals = range(start - task.jitter_ns, until, task.separation_ns)
    return [Release(arrival, max(arrival, start), [(RUN, task.cost_ns)]) for arrival in arrivals]
