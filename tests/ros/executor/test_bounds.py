"""Bounds of a running executor: in ~/list_components, /diagnostics, ~/violations, the log and the bag."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

import mauve_rt.trace
from mauve_msgs.msg import BoundViolation
from mauve_msgs.srv import ListComponents
from mauve_rt.trace.reading.violations import VIOLATION_TYPE

NODE = "/robot_1/executor"
MS = 1_000_000
FILE = """\
mauve: 1
executor: {namespace: /robot_1, wakeup_us: 2000, overhead_ns: 100000}
components:
  spinning: {shell: executor_tests/CounterShell, core: executor_tests/Spinning,
             fsm: executor_tests/CounterFsm, cpus: [0], priority: 60, properties: {period_ms: 40, step: 8.0},
             states: {Count: {wcet_ns: 1000000}}}
"""


@pytest.fixture
def start(tmp_path: Path, start_executor: Callable[..., Any]) -> Callable[..., Any]:
    """An executor with this architecture."""

    def start(text: str, *arguments: str) -> Any:
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        return start_executor("-p", f"architecture:={path}", *arguments)

    return start


def threads(process_id: int) -> set[str]:
    """Their names."""
    return {(task / "comm").read_text("ascii").strip() for task in Path(f"/proc/{process_id}/task").iterdir()}


def listed(graph: Any) -> Any:
    (component,) = graph.ask(ListComponents, f"{NODE}/list_components").components
    return component


def test_a_job_above_its_bound_is_one_event_everywhere(
    start: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    executor = start(FILE, "-p", f"bag:={tmp_path / 'bag'}")
    statuses = graph.hear(DiagnosticArray, "/diagnostics")
    events = graph.hear(BoundViolation, f"{NODE}/violations")
    if listed(graph).policy != "SCHED_FIFO":
        pytest.skip("without real-time rights there are no bounds")

    def spun() -> list[Any]:
        return [one for one in events if one.term == BoundViolation.EXECUTION]

    def warned() -> list[Any]:
        mine = (one for array in statuses for one in array.status if one.name == f"{NODE}: spinning")
        return [one for one in mine if "took longer than proved" in one.message]

    graph.spin_until(lambda: bool(spun() and warned()), "a violation")
    event = spun()[0]
    assert (event.component, event.element, event.declared_ns) == ("spinning", "spinning.Count", MS)
    assert event.response_ns >= event.took_ns >= 8 * MS
    assert (event.bound_ns, event.until) == (3_100_000, "Pause")
    assert event.count >= 1
    status = warned()[0]
    assert status.level == DiagnosticStatus.WARN
    values = {item.key: item.value for item in status.values}
    assert values["bound_ns[Pause -> Pause]"] == "3100000"
    assert int(values["longest_ns[Pause -> Pause]"]) >= 8 * MS
    assert int(values["violations"]) > 0
    job = next(one for one in listed(graph).bounds if one.after == "Pause")
    assert (list(job.states), job.bound_ns, job.deadline_ns) == (["Count"], 3_100_000, 40 * MS)
    assert job.jobs >= job.violations > 0
    assert job.longest_ns >= 8 * MS
    assert "trace" in threads(executor.process.pid)
    executor.await_output("component 'spinning': Pause -> Pause took ")
    executor.process.terminate()
    executor.wait()
    recorded = mauve_rt.trace.open(tmp_path / "bag").messages(VIOLATION_TYPE)
    assert event.instant_ns in [one.msg.instant_ns for one in recorded]


def test_without_declared_times_nothing_is_watched(start: Callable[..., Any], graph: Any) -> None:
    executor = start(FILE.replace(", wakeup_us: 2000, overhead_ns: 100000", ""))
    statuses = graph.hear(DiagnosticArray, "/diagnostics")
    graph.spin_until(lambda: len(statuses) > 2, "a while")
    assert not listed(graph).bounds
    assert "trace" not in threads(executor.process.pid), "nothing takes the records of jobs"
