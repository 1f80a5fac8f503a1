"""Log lines in a report: markers with their texts, and places to go to."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from synthetic_traces import EPOCH_NS, MS, periodic_trace

from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.log_lines import LOG_TYPE, log_lines
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report import write_report
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.markers import MOST_TEXTS, NO_NAME, numbered
from mauve_rt.trace.report.timeline import timeline_data

INFO, WARN = 20, 30


def written(time_ns: int, level: int, text: str, *, name: str = "robot_1.executor.c") -> Message:
    return Message("/rosout", 0, time_ns, SimpleNamespace(name=name, level=level, msg=text))


@pytest.fixture
def trace() -> Trace:
    lines = [
        written(EPOCH_NS + 20 * MS, WARN, "Run: tracking error 3 m"),
        written(EPOCH_NS + 10 * MS, INFO, "Run: on my way"),
        written(EPOCH_NS + 10 * MS, INFO, "of a resource", name="robot_1.executor.scan"),
    ]

    def only(topics: tuple[str, ...]) -> Iterator[Message]:
        return iter(lines if LOG_TYPE in topics else [])

    return replace(periodic_trace(), message_source=only)


def test_each_is_a_marker_with_its_text_and_a_warning_a_place(trace: Trace, tmp_path: Path) -> None:
    analysis = analyse(trace)
    assert [line.text for line in analysis.log] == ["Run: on my way", "Run: tracking error 3 m"]
    described, _ = timeline_data(analysis)
    (row,) = described["rows"]
    assert {"log", "warning"} <= {one["kind"] for one in row["markers"]}
    assert described["names"][-2:] == ["Run: on my way", "Run: tracking error 3 m"]
    assert described["jumps"]["warning"] == [[0, EPOCH_NS + 20 * MS - analysis.begin_ns, 0]]
    page = tmp_path / "page.html"
    write_report(page, trace, title="t")
    text = page.read_text("utf-8")
    assert 'data-jump="warning"' in text
    assert "Run: tracking error 3 m" in text
    assert '<i class="key-log"></i>log line' in text


def test_without_one_nothing_is_said(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    write_report(page, periodic_trace(), title="t")
    assert '<i class="key-log"></i>' not in page.read_text("utf-8")


def test_of_several_executors_each_has_its_own() -> None:
    messages = [written(1, INFO, "here", name="left.executor.c")]
    assert [one.component for one in log_lines(messages, ("left/c", "right/c"))] == ["left/c"]


def test_of_very_many_different_texts_the_page_has_the_first_ones() -> None:
    messages = [written(number, INFO, f"line {number}") for number in range(MOST_TEXTS + 5)]
    texts, names = numbered(log_lines(messages, ("c",)), 7)
    assert len(names) == MOST_TEXTS
    assert (texts[0].name, texts[-1].name) == (7, NO_NAME)
