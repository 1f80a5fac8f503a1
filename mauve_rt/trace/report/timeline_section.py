"""The timeline's place in the page: controls, names of the rows, canvases. The script does the rest."""

from html import escape
from typing import Any

from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section, attribute
from mauve_rt.trace.report.units import counted, time_text

_JUMPS = (
    ("swap", "Reconfigurations"),
    ("decision", "Decisions"),
    ("miss", "Deadlines missed"),
    ("overrun", "Overruns"),
    ("violation", "Above their bound"),
    ("fault", "Faults"),
    ("warning", "Warnings in the log"),
    ("wakeup", "Worst wake-ups"),
    ("response", "Worst responses"),
)
_KEYS = (
    ("release", "release, nominal"),
    ("latency", "wake-up latency"),
    ("overrun", "overrun"),
    ("fault", "fault"),
    ("stop", "stop"),
    ("start", "start"),
    ("mark", "mark"),
    ("swap", "parked to armed"),
)
_STATES_NAMED = 4
_CHARACTER_PX, _PERIOD_PX, _NAMES_PX = 9, 84, (200, 340)


def timeline_section(analysis: Analysis, described: dict[str, Any]) -> Section:
    """Return the section that static/timeline.js brings to life."""
    if not any(len(records) for records in analysis.trace.records.values()):
        return Section("Timeline", '<p class="nothing">The trace holds no record.</p>', anchor="timeline")
    jumps = "".join(_jump(kind, name, len(described["jumps"][kind])) for kind, name in _JUMPS)
    names = "".join(_row_name(analysis, index) for index in range(len(analysis.trace.components)))
    rules = '<div class="rules-name"><b>rules</b></div>' if described["decisions"] else ""
    shown = [*_KEYS, *([("decision", "decision of a rule")] if rules else [])]
    shown += [("violation", "job above its bound")] if described["jumps"]["violation"] else []
    kinds = {one["kind"] for row in described["rows"] for one in row["markers"]}
    shown += [("log", "log line")] if "log" in kinds else []
    shown += [("warning", "warning or error in the log")] if "warning" in kinds else []
    shown += [("kept", "kept in full")] if described["bucket"] else []
    keys = "".join(f'<span><i class="key-{kind}"></i>{name}</span>' for kind, name in shown)
    html = (
        f'<div class="toolbar">{jumps}<span class="zoom">'
        '<button type="button" data-zoom="in" title="zoom in (+)">+</button>'
        '<button type="button" data-zoom="out" title="zoom out (-)">\N{MINUS SIGN}</button>'
        '<button type="button" data-zoom="all" title="show everything (0)">All</button></span></div>'
        f'<div id="timeline-view" class="timeline" style="--names: {names_px(analysis)}px" tabindex="0" '
        'role="application" '
        'aria-label="timeline: arrow keys move, plus and minus zoom, 0 shows everything">'
        '<div class="overview"><canvas></canvas></div>'
        f'<div class="lanes"><div class="names"><div class="axis-room"></div>{names}{rules}</div>'
        '<div class="plot"><canvas></canvas></div></div></div>'
        f'<p class="where" aria-live="polite"></p><p class="keys">{keys}</p>'
    )
    return Section("Timeline", html, note=_note(described), anchor="timeline", wide=True)


def names_px(analysis: Analysis) -> int:
    """Width of the column of names: that of the longest one and its period, within limits."""
    longest = max(map(len, analysis.trace.components), default=0)
    return min(max(_CHARACTER_PX * longest + _PERIOD_PX, _NAMES_PX[0]), _NAMES_PX[1])


def _jump(kind: str, name: str, count: int) -> str:
    if not count:
        return ""
    buttons = [
        f'<button type="button" aria-label="{word} of {name}">{sign}</button>'
        for word, sign in (("previous", "&lsaquo;"), ("next", "&rsaquo;"))
    ]
    middle = f"<b>{name} <small>{count:,}</small></b>"
    return f'<span class="jump" data-jump="{kind}">{middle.join(buttons)}</span>'


def _note(described: dict[str, Any]) -> str:
    note = (
        "Wheel zooms at the pointer, dragging moves, double click shows everything; on the keyboard arrows, "
        "+ and \N{MINUS SIGN}. Where executions are narrower than a pixel, the height of a bar is the cube "
        "root of the share of time that they took."
    )
    if described["bucket"]:
        kept = sum(end - begin for begin, end in described["kept"])
        note += (
            f" The trace has more than fits: {time_text(kept)} in "
            f"{counted(len(described['kept']), 'interval')} around reconfigurations, overruns, faults and "
            "the worst latencies are kept in full; elsewhere what begins within "
            f"{time_text(described['bucket'])} is merged, and hovering tells so."
        )
    return note


def _row_name(analysis: Analysis, index: int) -> str:
    component = analysis.trace.components[index]
    states = list(analysis.slices[component])
    dots = "".join(
        f'<span><i class="s{place % 8}"></i>{escape(state)}</span>'
        for place, state in enumerate(states[:_STATES_NAMED])
    )
    if len(states) > _STATES_NAMED:
        dots += f"<span>+{len(states) - _STATES_NAMED}</span>"
    period_ns = analysis.period_ns(component)
    period = time_text(period_ns) if period_ns else "sporadic" if analysis.sporadic(component) else ""
    tip = "\n".join(
        [component, *(["period " + period] if period_ns else []), *(f"state {one}" for one in states)]
    )
    return (
        f'<div class="row-name" data-tip="{attribute(tip)}"><b>{escape(component)}</b>'
        f"<small>{escape(period)}</small><div>{dots}</div></div>"
    )
