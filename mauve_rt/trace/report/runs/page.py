"""The page about two compared runs: in the look of the report, and as self-contained."""

from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from mauve_rt.trace.reading.values import Samples
from mauve_rt.trace.report import svg
from mauve_rt.trace.report.blocks import Card, Cell, Section, cards, details, paragraph, table
from mauve_rt.trace.report.histograms import HEIGHT, WIDTH, histogram
from mauve_rt.trace.report.page import page, write_page
from mauve_rt.trace.report.runs.compared import ComparedRuns
from mauve_rt.trace.report.runs.noise import Floats
from mauve_rt.trace.report.runs.tables import (
    VERDICTS,
    View,
    decisions_view,
    reconfigurations_view,
    timing_views,
    values_view,
)
from mauve_rt.trace.report.runs.values import ComparedField
from mauve_rt.trace.report.runs.words import verdict_on
from mauve_rt.trace.report.tables import words_section
from mauve_rt.trace.report.units import number_text, time_text
from mauve_rt.trace.report.verdict import verdict_html

_OPEN_UP_TO = 6
"""Components up to which all tables are unfolded; of more, those with a mark."""
_DRAWN = 24
"""Figures of one section, at most."""
_POINTS = 150
"""Of a curve; each is drawn as the range of its samples."""
_LEFT, _TOP, _BOTTOM = 8.0, 8.0, 18.0
_KEY = '<p class="key"><i class="before"></i> A <i class="after"></i> B</p>'


def write_comparison(path: Path, found: ComparedRuns, *, title: str) -> None:
    """Write the page.

    Raises:
        OSError: it cannot be written.

    """
    sections = [_timing_section(found)]
    for view, anchor in ((decisions_view(found), "decisions"), (reconfigurations_view(found), "changes")):
        if view is not None:
            sections.append(Section(view.heading, _table(view), note=view.note, anchor=anchor))
    values = _values_section(found)
    if values is not None:
        sections.append(values)
    outcome = verdict_html(verdict_on(found), title=title) + cards(_cards(found))
    names = paragraph(f"A: {found.names[0]}. B: {found.names[1]}.")
    write_page(
        path,
        page(
            title, outcome, [names, *(one.render() for one in sections), words_section()], sections=sections
        ),
    )


def _cards(found: ComparedRuns) -> list[Card]:
    differing = len(found.differing)
    spans = [trace.span_ns for trace in found.traces]
    lasted = [time_text(end - begin) for begin, end in spans]
    return [
        Card(f"{differing:,}", "of the tested figures differ", "attention" if differing else ""),
        Card(f"{found.tested:,}", "figures tested"),
        Card(f"{len(found.components):,}", "components in both runs"),
        Card(lasted[0], "recorded in A"),
        Card(lasted[1], "recorded in B"),
    ]


def _timing_section(found: ComparedRuns) -> Section:
    views = timing_views(found)
    html = "".join(
        details(view.heading, _table(view), opened=len(views) <= _OPEN_UP_TO or view.is_marked)
        for view in views
    )
    note = (
        "Of each component that both runs have. A maximum is a single value: it has no interval and no mark."
    )
    return Section("Timing", _distributions(found) + html, note=note, anchor="timing")


def _distributions(found: ComparedRuns) -> str:
    """Histograms of both runs for each measure with a mark."""
    marked = dict.fromkeys((one.subject, one.measure) for one in found.timing if one.differs and one.is_time)
    drawings = []
    for component, measure in list(marked)[:_DRAWN]:
        a, b = (run.series[measure].values for run in found.components[component])
        what = f"{component}: {measure}"
        drawings.append((what, histogram([("A", a), ("B", b)], described=f"{what} in A and in B")))
    return _figures(drawings, len(marked))


def _values_section(found: ComparedRuns) -> Section | None:
    view = values_view(found)
    if view is None:
        return None
    differing = [one for one in found.values.fields if one.differs]
    begins = [trace.span_ns[0] for trace in found.traces]
    drawings = [(f"{one.field.topic} {one.field.name}", _curves(one, begins)) for one in differing[:_DRAWN]]
    return Section(
        "Values", _figures(drawings, len(differing)) + _table(view), note=view.note, anchor="values"
    )


def _figures(drawings: Sequence[tuple[str, str]], count: int) -> str:
    if not drawings:
        return ""
    inside = "".join(
        f"<figure><figcaption>{escape(what)}</figcaption>{drawing}</figure>" for what, drawing in drawings
    )
    more = count - len(drawings)
    rest = f"<p>{more:,} more are not drawn.</p>" if more else ""
    return f'{_KEY}<div class="grid">{inside}</div>{rest}'


def _table(view: View) -> str:
    words = len(view.names) + len(view.words)
    rows = [
        [
            Cell(text, "attention" if row.marked and column in VERDICTS else "", number=index >= words)
            for index, (column, text) in enumerate(zip(view.columns, row.cells, strict=True))
        ]
        for row in view.rows
    ]
    return table(view.columns, rows)


def _curves(one: ComparedField, begins_ns: Sequence[int]) -> str:
    """Both runs' samples over the time since the run's begin."""
    runs = [
        (run, (run.monotonic_ns - begin) / 1e9) for run, begin in zip((one.a, one.b), begins_ns, strict=True)
    ]
    finite = np.concatenate([one.a.finite, one.b.finite])
    if not len(finite):
        return ""
    low, high = float(finite.min()), float(finite.max())
    longest = max(float(times.max()) for _, times in runs if len(times))
    parts = [svg.line(_LEFT, HEIGHT - _BOTTOM, WIDTH - _LEFT, HEIGHT - _BOTTOM, css="axis")]
    for (run, times), css in zip(runs, ("curve before", "curve after"), strict=True):
        parts.append(svg.path(_curve(run, times, (low, high), max(longest, 1e-9)), css=css))
    parts.append(svg.label(_LEFT, HEIGHT - 4, f"0 s; {number_text(low)} to {number_text(high)}", css="tick"))
    parts.append(svg.label(WIDTH - _LEFT, HEIGHT - 4, time_text(longest * 1e9), css="tick", anchor="end"))
    return svg.svg(WIDTH, HEIGHT, "".join(parts), css="curves", described=f"{one.field.name} in A and in B")


def _curve(run: Samples, times_s: Floats, span: tuple[float, float], longest_s: float) -> str:
    """A path through the smallest and the largest value of each piece of the run."""
    known = np.isfinite(run.values)
    values, times_s = run.values[known], times_s[known]
    low, high = span
    height = HEIGHT - _TOP - _BOTTOM
    scale = height / (high - low) if high > low else 0.0
    points = []
    for piece, at in zip(np.array_split(values, _POINTS), np.array_split(times_s, _POINTS), strict=True):
        if not len(piece):
            continue
        ends = sorted((int(piece.argmin()), int(piece.argmax())))
        for index in dict.fromkeys(ends):
            x = _LEFT + float(at[index]) / longest_s * (WIDTH - 2 * _LEFT)
            y = HEIGHT - _BOTTOM - (float(piece[index]) - low) * scale
            points.append(f"{svg.number(x)} {svg.number(y)}")
    return "M" + "L".join(points) if points else "M0 0"
