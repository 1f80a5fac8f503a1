"""Decisions of rules in a report: flags on the timeline's thin row `rules`, places to go to, and a table."""

from typing import Any

from mauve_rt.trace.reading.decisions import ExplainedDecision
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Cell, Section, table
from mauve_rt.trace.report.units import time_text

SHOWN = 5_000
"""Flags on the timeline, at most."""
_MANY_ROWS = 400
_LEVELS = {"do": "acts", "undo": "acts", "done": "acts", "undone": "acts"}
_LEVELS |= {"otherwise": "fails", "otherwise done": "fails", "otherwise failed": "fails"}
_LEVELS |= {"do failed": "fails", "undo failed": "fails", "no do": "waits", "no undo": "waits"}


def decision_flags(analysis: Analysis) -> list[dict[str, Any]]:
    """Return what the page's script (static/decisions.js) draws. Times in ns from the begin of the trace."""
    return [_flag(one, analysis.begin_ns) for one in analysis.decisions[:SHOWN]]


def decision_places(analysis: Analysis) -> list[list[int]]:
    """Return the places that the button `Decisions` goes to: row, below the components', time, length 0."""
    row = len(analysis.trace.components)
    return [[row, one.traced.time_ns - analysis.begin_ns, 0] for one in analysis.decisions[:SHOWN]]


def decisions_section(analysis: Analysis) -> Section | None:
    """Return the table of decisions; None when there was none."""
    if not analysis.decisions:
        return None
    columns = ("at", "rule", "decision", "reason", "took", "at most")
    html = table(columns, [_row(one, analysis.zero_ns) for one in analysis.decisions[:_MANY_ROWS]])
    more = len(analysis.decisions) - _MANY_ROWS
    return Section(
        "Decisions",
        html + (f"<p>{more:,} more are not listed.</p>" if more > 0 else ""),
        note="Of the executor's rules. Took: from the cause to the first release after what was done; "
        "at most: as reckoned beforehand.",
        anchor="decisions",
    )


def reason_of(one: ExplainedDecision) -> str:
    """Return the reason in words; where no message tells them, in those of the record."""
    return one.reason or one.traced.why


def _flag(one: ExplainedDecision, begin_ns: int) -> dict[str, Any]:
    return {
        "time": one.traced.time_ns - begin_ns,
        "rule": one.traced.rule,
        "decision": one.traced.decision,
        "reason": reason_of(one),
        "level": _LEVELS.get(one.traced.decision, "sees"),
        "took": _ns(one.took_s),
        "bound": _ns(one.bound_s),
    }


def _row(one: ExplainedDecision, zero_ns: int) -> tuple[object, ...]:
    took_ns, bound_ns = _ns(one.took_s), _ns(one.bound_s)
    is_late = took_ns is not None and bound_ns is not None and took_ns > bound_ns
    failed = _LEVELS.get(one.traced.decision) == "fails"
    return (
        Cell(time_text(one.traced.time_ns - zero_ns), tip=f"{one.traced.time_ns - zero_ns:,} ns"),
        one.traced.rule,
        Cell(one.traced.decision, "bad" if failed else "", number=False),
        reason_of(one),
        Cell(time_text(took_ns), "bad" if is_late else ""),
        Cell(time_text(bound_ns)),
    )


def _ns(seconds: float | None) -> int | None:
    return None if seconds is None else round(seconds * 1e9)
