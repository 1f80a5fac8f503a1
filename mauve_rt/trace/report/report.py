"""The report of a trace, put together from its blocks."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report.analysis import Analysis, analyse
from mauve_rt.trace.report.architecture_section import architecture_section
from mauve_rt.trace.report.blocks import Card, Section, cards
from mauve_rt.trace.report.comparison import reconfigurations_section
from mauve_rt.trace.report.decisions import decisions_section
from mauve_rt.trace.report.detail import BUDGET
from mauve_rt.trace.report.distributions import distributions_section
from mauve_rt.trace.report.key_figures import key_figures
from mauve_rt.trace.report.page import data_element, page, write_page
from mauve_rt.trace.report.shadows import shadows_section
from mauve_rt.trace.report.tables import (
    components_section,
    losses_section,
    resources_section,
    words_section,
)
from mauve_rt.trace.report.timeline import json_for_script, timeline_data
from mauve_rt.trace.report.timeline_section import timeline_section
from mauve_rt.trace.report.values import values_section
from mauve_rt.trace.report.verdict import Verdict, judge, verdict_html

_EVENT_TYPE = "mauve_msgs/msg/ReconfigurationEvent"
_STATE_TYPE = "mauve_msgs/msg/ArchitectureState"
_ANALYSED, _VALUES_READ, _PACKED = 0.2, 0.7, 0.8


def write_report(
    path: Path,
    trace: Trace,
    *,
    title: str = "Trace report",
    extra: Sequence[Section] = (),
    figures: Sequence[Card] = (),
    more: Sequence[Callable[[Analysis], Section | None]] = (),
    verdict: Callable[[Verdict], Verdict] | None = None,
    events: Iterable[Any] | None = None,
    zero_ns: int | None = None,
    budget: int = BUDGET,
    progress: Progress = silent,
) -> None:
    """Write one self-contained page about a trace.

    Args:
        path: of the page.
        trace: of one executor, or of several merged ones.
        title: the page's.
        extra: sections to stand before those about the trace.
        more: make sections to stand behind those about components.
        figures: cards to stand before those about the trace, which are fewer for it.
        verdict: makes what stands at the top of what the trace tells; that itself when not given.
        events: the executors' ReconfigurationEvent messages by time, when they have been read already.
        zero_ns: what the page's clock counts from, CLOCK_MONOTONIC; the first record when not given.
        budget: executions and releases that the timeline keeps, about; see `detail`.
        progress: told how far it is.

    Raises:
        TraceError: the bag's messages cannot be read.
        OSError: the page cannot be written.
    """
    told = trace.messages(_EVENT_TYPE) if events is None else events
    analysis = analyse(
        trace,
        events=told,
        states=trace.messages(_STATE_TYPE),
        zero_ns=zero_ns,
        progress=part(progress, 0, _ANALYSED),
    )
    trace.values.read(progress=part(progress, _ANALYSED, _VALUES_READ))
    progress(_VALUES_READ, "packing the timeline")
    described, data = timeline_data(analysis, budget=budget)
    makers: tuple[Callable[[Analysis], Section | None], ...] = (
        reconfigurations_section,
        decisions_section,
        shadows_section,
        distributions_section,
        architecture_section,
        components_section,
        *more,
        resources_section,
        losses_section,
    )
    values = values_section(analysis, described["values"])
    sections = [*extra, timeline_section(analysis, described), *([values] if values else [])]
    for index, make in enumerate(makers):
        progress(_PACKED + (1 - _PACKED) * index / len(makers), "drawing")
        made = make(analysis)
        if made is not None:
            sections.append(made)
    told_by_trace = judge(analysis)
    outcome = verdict_html(verdict(told_by_trace) if verdict else told_by_trace, title=title)
    outcome += cards(key_figures(analysis, figures))
    parts = [*(section.render() for section in sections), words_section()]
    elements = data_element("timeline-described", "application/json", json_for_script(described))
    elements += data_element("timeline-columns", "text/plain", data)
    write_page(path, page(title, outcome, parts, sections=sections, data=elements))
    progress(1.0, "done")
