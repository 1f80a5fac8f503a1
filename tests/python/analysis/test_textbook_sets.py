"""Sets whose response times are known."""

from dataclasses import replace

import pytest
from sporadic_tasks import response_times
from textbook_sets import EXAMPLES, Example, task

from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, digraph_times
from mauve_rt.analysis.machines import FOREVER_NS


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_response_times(example: Example):
    found = tuple(bound.response_ns for bound in response_times(example.tasks))
    assert found == example.expected_ns


def test_every_job_of_the_busy_window_of_lehoczky():
    """114, 102, 116, 104, 118, 106, 94: of a path that ends, a job can be any up to its number."""
    separations = [100] * 6 + [FOREVER_NS]
    jobs = tuple(
        Job(str(number), (), 62, str(number + 1), separation, 118)
        for number, separation in enumerate(separations)
    )
    above = task("a", period=70, cost=26, priority=2).component()
    found = digraph_times([above, Component(DigraphTask("b", jobs), 1)])["b"].jobs
    assert [one.response_ns for one in found] == [114, 114, 116, 116, 118, 118, 118]


def test_why_there_is_no_bound():
    full = [task("a", period=10, cost=6, priority=2), task("b", period=10, cost=4, priority=1)]
    assert [bound.response_ns for bound in response_times(full)] == [6, 10]
    late = [full[0], task("b", period=10, cost=4, priority=1, jitter_ns=1)]
    reason = (
        "the utilization at this priority is 1, and blocking or late wake-ups come on top: nothing is left"
    )
    assert response_times(late)[1].reason == reason
    above_late = [replace(full[0], jitter_ns=1), full[1]]
    assert [bound.response_ns for bound in response_times(above_late)] == [7, None]
    assert response_times(above_late)[1].reason == reason
    below_late = [*full, task("c", period=10, cost=1, priority=1, jitter_ns=1)]
    assert response_times(below_late)[0].response_ns == 6
    more = [full[0], task("b", period=10, cost=5, priority=1)]
    assert response_times(more)[1].reason == "the utilization at this priority is 1.1: nothing is left"


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
