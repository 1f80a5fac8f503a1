"""Sets whose response times are known."""

import pytest
from textbook_sets import EXAMPLES, Example, section, task

from mauve_rt.analysis import response_times
from mauve_rt.analysis.window import Arrivals, Level, job_bounds


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_response_times(example: Example):
    found = tuple(bound.response_ns for bound in response_times(example.tasks))
    assert found == example.expected_ns


def test_every_job_of_the_busy_window_of_lehoczky():
    level = Level(
        own=Arrivals(separation_ns=100, cost_ns=62), higher=(Arrivals(separation_ns=70, cost_ns=26),)
    )
    assert [job.response_ns for job in job_bounds(level)] == [114, 102, 116, 104, 118, 106, 94]


def test_why_there_is_no_bound():
    full = [task("a", period=10, cost=6, priority=2), task("b", period=10, cost=4, priority=1)]
    assert [bound.response_ns for bound in response_times(full)] == [6, 10]
    late = [full[0], task("b", period=10, cost=4, priority=1, jitter_ns=1)]
    assert "is 1, and blocking or jitter" in response_times(late)[1].reason
    more = [full[0], task("b", period=10, cost=5, priority=1)]
    assert response_times(more)[1].reason == "the utilization at this priority is 1.1, above 1"


def test_a_window_of_very_many_jobs_ends_with_a_reason():
    """Half a million jobs of each task: the jitter adds half a period, and each period catches up by 1 ns."""
    period = 10**6
    bounds = response_times(
        [
            task("a", period=period, cost=period // 2, priority=2),
            task("b", period=period, cost=period // 2 - 1, priority=1, jitter_ns=period - 1),
        ]
    )
    assert "steps" in bounds[1].reason


def test_waits_without_a_bound_leave_lower_priorities_without_one():
    tasks = [
        task("a", period=10, cost=2, priority=2, waits_ns=(9,)),
        task("b", period=100, cost=1, priority=1),
    ]
    first, second = response_times(tasks)
    assert first.response_ns is None
    assert second.reason == "task a of higher priority waits for services and has no bound"


def test_a_bound_is_withdrawn_that_relies_on_a_missed_deadline():
    tasks = [
        task("a", period=50, cost=2, priority=1, waits_ns=(9,), deadline_ns=12),
        task("b", period=100, cost=3, priority=1),
    ]
    first, second = response_times(tasks)
    assert (first.response_ns, first.meets_deadline) == (14, False)
    assert second.reason == "task a of equal priority waits for services and can miss its deadline"


def test_cpus_are_analysed_apart():
    tasks = [task("a", period=10, cost=6, priority=2), task("b", period=10, cost=6, priority=1, cpu=1)]
    assert [bound.response_ns for bound in response_times(tasks)] == [6, 6]


def test_a_resource_of_two_cpus_has_no_bound():
    locked = {"sections": (section("s", 1),)}
    tasks = [
        task("a", period=10, cost=1, priority=2, **locked),
        task("b", period=10, cost=1, priority=1, cpu=1, **locked),
        task("c", period=10, cost=1, priority=1, cpu=2),
    ]
    bounds = response_times(tasks)
    assert [bound.response_ns for bound in bounds] == [None, None, 1]
    assert bounds[0].reason.startswith("resource s is shared with another CPU")
