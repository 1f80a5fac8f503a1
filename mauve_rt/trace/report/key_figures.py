"""The figures of a trace to remember, as cards."""

from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Card
from mauve_rt.trace.report.units import time_text


def key_figures(analysis: Analysis) -> list[Card]:
    """Return the cards below the verdict."""
    found = list(analysis.statistics.values())
    releases = sum(one.releases for one in found)
    overruns = sum(one.overruns for one in found)
    figures = [
        Card(time_text(analysis.duration_ns), "recorded"),
        _counted(len(found), "component"),
        _counted(releases, "release"),
        _counted(overruns, "overrun", "attention" if overruns else "good" if releases else ""),
    ]
    released = [one for one in found if one.wakeup.count]
    if released:
        figures.append(
            Card(time_text(max(one.wakeup.p99_ns for one in released)), "worst p99 wake-up latency")
        )
        figures.append(Card(time_text(max(one.wakeup.max_ns for one in released)), "worst wake-up latency"))
    if analysis.swaps:
        measured = [swap.measured for swap in analysis.swaps]
        missed = [one.missed_releases for one in measured if one.missed_releases is not None]
        figures.append(_counted(len(measured), "reconfiguration"))
        figures.append(Card(time_text(max(one.blackout_ns for one in measured)), "longest blackout"))
        if missed:
            level = "attention" if sum(missed) else "good"
            figures.append(Card(f"{sum(missed):,}", "releases missed by them", level))
    if analysis.faults:
        figures.append(_counted(len(analysis.faults), "fault", "bad"))
    lost = analysis.trace.lost
    figures.append(Card(f"{lost:,}", "records lost", "attention" if lost else ""))
    return figures


def _counted(count: int, what: str, level: str = "") -> Card:
    return Card(f"{count:,}", what if count == 1 else what + "s", level)
