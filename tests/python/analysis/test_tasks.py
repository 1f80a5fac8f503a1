"""Parameters that are refused, and that the package needs nothing of the rest."""

import subprocess
import sys

import pytest
from textbook_sets import section, task

from mauve_rt.analysis import AnalysisError, response_times


@pytest.mark.parametrize(
    ("field", "value", "text"),
    [
        ("priority", 100, "task a: priority: expected a whole number >= 1 and <= 99, found 100."),
        ("jitter_ns", -1, "task a: jitter_ns: expected a whole number >= 0, found -1."),
        (
            "deadline_ns",
            1.5,
            "task a: deadline_ns: expected a whole number >= 1, found 1.5. Use whole numbers",
        ),
        ("cpu", True, "task a: cpu: expected a whole number >= 0, found True."),
        ("waits_ns", (0,), "task a: waits_ns: expected a whole number >= 1, found 0."),
        ("sections", (section("s", 4),), "task a, section of s: length_ns: expected a whole number <= 3"),
        ("sections", (section("s", 1, "t"),), "inside: expected a resource that the task locks, found t."),
    ],
)
def test_what_is_refused(field: str, value: object, text: str):
    with pytest.raises(AnalysisError) as error:
        task("a", **{"period": 10, "cost": 3, "priority": 1, field: value})  # type: ignore[arg-type]
    assert text in str(error.value)


def test_a_resource_inside_itself_is_refused():
    with pytest.raises(AnalysisError, match="expected another resource, found s"):
        section("s", 1, "s")


def test_two_tasks_of_one_name_are_refused():
    one = task("a", period=10, cost=3, priority=1)
    with pytest.raises(AnalysisError, match="expected one task, found 2 tasks"):
        response_times([one, one])


def test_locks_in_both_orders_are_refused():
    tasks = [
        task("a", period=10, cost=3, priority=2, sections=(section("s", 2), section("t", 1, "s"))),
        task("b", period=10, cost=3, priority=1, sections=(section("t", 2), section("s", 1, "t"))),
    ]
    with pytest.raises(AnalysisError, match="order of locks: expected no cycle"):
        response_times(tasks)


def test_it_needs_neither_the_native_library_nor_ros():
    program = (
        "import sys\n"
        "for name in ('mauve_rt._kernel', 'mauve_rt._bridge', 'mauve_msgs', 'rclpy'):\n"
        "    sys.modules[name] = None\n"
        "import mauve_rt.analysis\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
