"""Bounds equal those of pyRTA, the package response-time-analysis, on random task sets."""

from dataclasses import replace
from random import Random

from pyrta_oracle import disagreements, fifo_ns, random_set
from sporadic_tasks import response_times
from task_sets import waters_set, with_jitter

SETS = 10_000


def test_fixed_priority_with_jitter_and_blocking():
    assert disagreements(range(SETS)) == []


def test_equal_priorities_are_first_in_first_out_where_no_thread_has_a_backlog():
    """A thread with a backlog goes first, other than pyRTA's jobs: then the bound may only be larger."""
    compared = 0
    for seed in range(3000):
        random = Random(seed)  # noqa: S311 - no cryptography
        tasks = waters_set(random, count=random.randint(2, 5), total=random.uniform(0.1, 0.95))
        tasks = [replace(task, priority=50) for task in with_jitter(random, tasks)]
        tasks[0] = replace(tasks[0], jitter_ns=0)  # then release and arrival of its worst job are one
        expected = fifo_ns(tasks)
        bounds = [bound.response_ns for bound in response_times(tasks)]
        assert expected is not None, f"seed {seed}"
        if all(expected < task.separation_ns - task.jitter_ns for task in tasks):
            compared += 1
            assert bounds[0] == expected, f"seed {seed}"
        else:
            assert max(bound or 0 for bound in bounds) >= expected, f"seed {seed}"
    assert compared > 100


def test_the_sets_have_what_is_compared():
    sets = [random_set(seed) for seed in range(300)]
    assert sum(any(task.sections for task in tasks) for tasks in sets) > 50
    assert sum(any(task.jitter_ns for task in tasks) for tasks in sets) > 50
    bounds = [bound for tasks in sets for bound in response_times(tasks)]
    assert sum(bound.blocking_ns > 0 for bound in bounds) > 50
