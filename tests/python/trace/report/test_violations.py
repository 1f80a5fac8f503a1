"""Jobs above their bound in a report: markers, places to go to, the verdict."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from synthetic_traces import EPOCH_NS, MS, periodic_trace

from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.statistics import job_response_times
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.reading.violations import VIOLATION_TYPE, violations
from mauve_rt.trace.report import write_report
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.timeline import timeline_data


def told(component: str, *, topic: str = "/executor/violations") -> Message:
    """The worst of three jobs took 5 ms, from 10 ms after the epoch on, and its bound is 2 ms."""
    msg = SimpleNamespace(
        component=component,
        instant_ns=EPOCH_NS + 10 * MS,
        response_ns=5 * MS,
        bound_ns=2 * MS,
        count=3,
        message="a job took too long",
    )
    return Message(topic, 0, 0, msg)


@pytest.fixture
def trace() -> Trace:
    def only(topics: tuple[str, ...]) -> Iterator[Message]:
        return iter([told("c")] if VIOLATION_TYPE in topics else [])

    return replace(periodic_trace(), message_source=only)


def test_each_has_a_marker_a_place_and_a_sentence(trace: Trace, tmp_path: Path) -> None:
    analysis = analyse(trace)
    described, _ = timeline_data(analysis)
    (row,) = described["rows"]
    assert "violation" in [one["kind"] for one in row["markers"]]
    assert described["jumps"]["violation"] == [[0, EPOCH_NS + 12 * MS - analysis.begin_ns, 3 * MS]]
    page = tmp_path / "page.html"
    write_report(page, trace, title="t")
    text = page.read_text("utf-8")
    assert "3 jobs took longer than proved" in text
    assert "no overrun, no fault" in text, "a deadline is another thing"
    assert "a job took too long" in text
    assert 'data-jump="violation"' in text


def test_without_one_nothing_is_said(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    write_report(page, periodic_trace(), title="t")
    assert "job above its bound" not in page.read_text("utf-8")


def test_of_several_executors_each_has_its_own() -> None:
    messages = [told("c", topic="/left/executor/violations")]
    assert [one.component for one in violations(messages, ("left/c", "right/c"))] == ["left/c"]


def test_response_times_of_each_kind_of_job(trace: Trace) -> None:
    found = job_response_times(trace, "c")
    (times_ns,) = (one for waits, one in found.items() if waits == ("wait", "wait"))
    assert len(times_ns) == analyse(trace).statistics["c"].releases
