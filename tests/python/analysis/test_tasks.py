"""Parameters that are refused, and that the package needs nothing of the rest."""

import subprocess
import sys

import pytest
from sporadic_tasks import response_times
from textbook_sets import section, task

from mauve_rt.analysis.errors import AnalysisError


@pytest.mark.parametrize("length", [0, 1.5, True])
def test_the_length_of_a_section_is_a_positive_whole_number(length: object):
    with pytest.raises(AnalysisError) as error:
        section("s", length)  # type: ignore[arg-type]
    assert f"section of s: length_ns: expected a whole number >= 1, found {length}." in str(error.value)


def test_a_section_inside_a_resource_that_is_not_locked_is_refused():
    one = task("a", period=10, cost=3, priority=1, sections=(section("s", 1, "t"),))
    with pytest.raises(AnalysisError) as error:
        response_times([one])
    assert str(error.value) == (
        "component a, section of s: inside: expected a resource that the component locks, found t. "
        "Add the section of t."
    )


def test_a_resource_inside_itself_is_refused():
    with pytest.raises(AnalysisError, match="expected another resource, found s"):
        section("s", 1, "s")


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
        "import mauve_rt.analysis.verdict\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
