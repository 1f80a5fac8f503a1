"""Before and after: each reconfiguration by what it changed, and by what it cost."""

from collections.abc import Iterator
from html import escape

import numpy as np

from mauve_rt.trace.reading.statistics import distribution
from mauve_rt.trace.report.analysis import Analysis, Swap
from mauve_rt.trace.report.blocks import Cell, Section, prose, table
from mauve_rt.trace.report.cycles import UNKNOWN
from mauve_rt.trace.report.histograms import Values, histogram
from mauve_rt.trace.report.neighbours import neighbours_in_words
from mauve_rt.trace.report.swap_figure import blackout_figure, grid_figure, phase_figure
from mauve_rt.trace.report.swap_values import values_around_swap
from mauve_rt.trace.report.tables import reconfigurations_table
from mauve_rt.trace.report.timeline import swap_title
from mauve_rt.trace.report.units import counted, time_text

RELEASES = 200
"""How many releases before and after are compared, at most."""
_SHOWN = 24
"""Reconfigurations that get a comparison of their own."""


def reconfigurations_section(analysis: Analysis) -> Section | None:
    """Return the section on reconfigurations; None when there was none."""
    if not analysis.swaps:
        return None
    shown = _chosen(analysis.swaps)
    options = "".join(
        f'<option value="{index}">{escape(_option(analysis, swap))}</option>'
        for index, swap in enumerate(shown)
    )
    panels = "".join(_panel(analysis, swap, index) for index, swap in enumerate(shown))
    left = len(analysis.swaps) - len(shown)
    note = (
        f"Of {len(analysis.swaps):,} the {len(shown)} with the longest blackouts are compared. "
        if left
        else ""
    )
    chooser = f'<label class="chooser">Look at <select data-chooser="swap">{options}</select></label>'
    return Section(
        "Reconfigurations",
        reconfigurations_table(analysis) + chooser + panels,
        note=note + "Measured by records that the components' own threads wrote.",
        anchor="reconfigurations",
    )


def _chosen(swaps: list[Swap]) -> list[Swap]:
    longest = sorted(swaps, key=lambda swap: -swap.measured.blackout_ns)[:_SHOWN]
    return sorted(longest, key=lambda swap: swap.measured.parked_ns)


def _option(analysis: Analysis, swap: Swap) -> str:
    one, request, _ = swap
    what = swap_title(one.what, request.to_core if request else "")
    return f"{time_text(one.parked_ns - analysis.zero_ns)}  {one.component}: {what}"


def _panel(analysis: Analysis, swap: Swap, index: int) -> str:
    one = swap.measured
    phase = phase_figure(analysis, one)
    blackout = blackout_figure(swap) if one.blackout_ns else ""
    values, values_in_words = values_around_swap(analysis, one)
    wide = f'<div class="scroll">{grid_figure(analysis, one)}{values}{blackout}{phase}</div>'
    return (
        f'<div class="swap" data-chosen="swap" data-value="{index}"{" hidden" if index else ""}>'
        f"<p>{prose(_in_words(analysis, swap))}</p>{wide}{values_in_words}"
        f"{neighbours_in_words(analysis, one)}{_before_and_after(analysis, swap)}</div>"
    )


def _in_words(analysis: Analysis, swap: Swap) -> str:
    one, request, _ = swap
    due_ns = one.pending_ns - one.parked_ns
    lasted = time_text(one.blackout_ns)
    text = f"{one.component} was parked for {lasted}"
    if one.after_fault:
        text = f"{one.component} had a fault, and its fallback core took over after {lasted}"
    if due_ns > 0:
        text += f", {time_text(due_ns)} before its next release was due"
    if request is not None and request.cause:
        text += f" ({request.cause})"
    if one.missed_releases is not None:
        text += f"; {counted(one.missed_releases, 'release')} missed"
    if one.phase_nominal_ns is not None:
        off = "on" if one.phase_nominal_ns == 0 else f"{time_text(one.phase_nominal_ns)} off"
        text += f". The next release was due {off} the grid"
        text += f", and came {time_text(one.phase_actual_ns)} after its instant"
    elif analysis.sporadic(one.component):
        text += ". It is triggered by events: it has no grid to miss"
    doubt = "" if one.complete else " Records are missing in between: these figures are doubtful."
    return f"{text}.{doubt}"


def _before_and_after(analysis: Analysis, swap: Swap) -> str:
    rows, figures = [], []
    for what, before, after in _measures(analysis, swap):
        rows.append((what, *_three(before), *_three(after), _change(before, after)))
        if not any(values.any() for values in (before, after)):
            continue  # simulated time: nothing is measured
        drawing = histogram([("before", before), ("after", after)], described=f"{what} before and after")
        if drawing:
            figures.append(f"<figure><figcaption>{escape(what)}</figcaption>{drawing}</figure>")
    if not rows:
        return ""
    columns = ("measure", *_named("before"), *_named("after"), "p50 changed by")
    key = '<p class="key"><i class="before"></i> before <i class="after"></i> after</p>'
    return (
        f"<h3>Up to {RELEASES} releases before and after</h3>"
        f'{key}<div class="grid">{"".join(figures)}</div>{table(columns, rows)}'
    )


def _named(side: str) -> tuple[str, ...]:
    return (f"{side}: n", "p50", "p99", "max")


def _measures(analysis: Analysis, swap: Swap) -> Iterator[tuple[str, Values, Values]]:
    """Yield each measure with its values before and after, not reaching over the neighbouring swaps."""
    one = swap.measured
    others = [other.measured for other in analysis.swaps if other.measured.component == one.component]
    earliest = max((other.armed_ns for other in others if other.armed_ns < one.parked_ns), default=None)
    latest = min((other.parked_ns for other in others if other.parked_ns > one.armed_ns), default=None)
    releases = analysis.releases[one.component]
    begin_ns = releases["begin_ns"] + releases["wakeup_ns"]
    middle = int(np.searchsorted(begin_ns, one.parked_ns))
    first = max(middle - RELEASES, 0 if earliest is None else int(np.searchsorted(begin_ns, earliest)))
    last = min(middle + RELEASES, len(releases) if latest is None else int(np.searchsorted(begin_ns, latest)))
    for what, measure in (("wake-up latency", "wakeup_ns"), ("response time", "response_ns")):
        values = np.asarray(releases[measure], np.int64)
        before, after = values[first:middle], values[middle:last]
        yield what, before[before != UNKNOWN], after[after != UNKNOWN]
    if first == last:
        return
    edges = [
        int(begin_ns[first]),
        one.parked_ns,
        int(begin_ns[last]) if last < len(begin_ns) else analysis.end_ns + 1,
    ]
    for state, slices in analysis.slices[one.component].items():
        at = np.searchsorted(slices["begin_ns"], edges)
        before, after = (slices["extent_ns"][at[side] : at[side + 1]] for side in (0, 1))
        if len(before) or len(after):
            yield f"execution of {state}", np.asarray(before, np.int64), np.asarray(after, np.int64)


def _three(values: Values) -> tuple[object, ...]:
    found = distribution(values)
    times = (found.p50_ns, found.p99_ns, found.max_ns)
    return (found.count, *(Cell(time_text(value if found.count else None)) for value in times))


def _change(before: Values, after: Values) -> Cell:
    if not len(before) or not len(after):
        return Cell("\N{EN DASH}")
    change_ns = distribution(after).p50_ns - distribution(before).p50_ns
    return Cell(("+" if change_ns > 0 else "") + time_text(change_ns))
