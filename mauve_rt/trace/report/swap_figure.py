"""A reconfiguration, magnified: its place on the grid, the blackout itself, the phase kept."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.report import svg
from mauve_rt.trace.report.analysis import Analysis, Swap
from mauve_rt.trace.report.cycles import Times
from mauve_rt.trace.report.scales import linear_ticks
from mauve_rt.trace.report.units import tick_texts, time_text

WIDTH = 1080.0
LEFT, RIGHT = 170.0, 20.0
_ROW, _TALL_ROW = 26.0, 58.0
_TOP = 30.0
_MOST_TICKS = 240
_PERIODS_AROUND = 2.6
_OUTLIER = 2.5
"""Times the 90th percentile of phase errors from which one is drawn as beyond."""
_OTHERS = 24
"""Rows of other components."""


@dataclass(frozen=True)
class Window:
    """An interval of time and its place in a drawing."""

    begin_ns: float
    end_ns: float

    def x(self, time_ns: float) -> float:
        """Return where an instant is."""
        share = (time_ns - self.begin_ns) / (self.end_ns - self.begin_ns)
        return LEFT + min(max(share, 0), 1) * (WIDTH - LEFT - RIGHT)

    def ticks(self, zero_ns: float, *, count: int = 8) -> Iterator[tuple[float, float]]:
        """Yield places and values of ticks, counted from zero_ns."""
        for value in linear_ticks(self.begin_ns - zero_ns, self.end_ns - zero_ns, count=count):
            yield self.x(value + zero_ns), value


def grid_figure(analysis: Analysis, one: Reconfiguration) -> str:
    """Draw the releases of all components around a swap, on the grid of the one that was swapped."""
    window = window_around(analysis, one)
    others = [name for name in analysis.trace.components if name != one.component][:_OTHERS]
    height = _TOP + _TALL_ROW + len(others) * _ROW + 26
    parts = [axis(window, one, height - 22), _grid_lines(analysis, one, window)]
    band = max(window.x(one.armed_ns) - window.x(one.parked_ns), 2)
    parts.append(svg.rect(window.x(one.parked_ns) - 1, _TOP - 8, band, height - _TOP - 14, css="blackout"))
    parts.append(_row(analysis, one.component, window, _TOP, _TALL_ROW, css="own"))
    for index, name in enumerate(others):
        parts.append(_row(analysis, name, window, _TOP + _TALL_ROW + index * _ROW, _ROW, css="other"))
    parts.append(_flags(one, window))
    described = f"releases around the reconfiguration of {one.component}"
    return svg.svg(WIDTH, height, "".join(parts), css="swap-grid", described=described)


def blackout_figure(swap: Swap) -> str:
    """Draw the time from parked to armed, magnified."""
    one = swap.measured
    margin_ns = max(one.blackout_ns * 0.25, 200)
    window = Window(one.parked_ns - margin_ns, one.armed_ns + margin_ns)
    top, height = 30.0, 96.0
    parts = [axis(window, one, height - 22)]
    left, right = window.x(one.parked_ns), window.x(one.armed_ns)
    parts.append(svg.rect(left, top, right - left, 30, css="blackout solid", round_=3))
    at_ns = float(max(one.parked_ns, swap.changed_ns - one.adopt_ns - one.take_ns))
    for phase, took_ns in (("adopt", one.adopt_ns), ("take", one.take_ns)):
        begin, end = window.x(at_ns), window.x(at_ns + took_ns)
        tip = f"{phase}: {time_text(took_ns)}"
        parts.append(
            svg.rect(begin, top + 5, max(end - begin, 1.5), 20, css=f"phase {phase}", tip=tip, round_=2)
        )
        at_ns += took_ns
    parts.append(svg.label(left - 6, top + 20, began(one), css="strong", anchor="end"))
    parts.append(svg.label(right + 6, top + 20, "started" if one.after_fault else "armed", css="strong"))
    parts_told = f"adopt {time_text(one.adopt_ns)}, take {time_text(one.take_ns)}"
    told = f"blackout {time_text(one.blackout_ns)}: {parts_told}"
    parts.append(svg.label((left + right) / 2, top - 8, told, css="strong", anchor="middle"))
    return svg.svg(WIDTH, height, "".join(parts), css="swap-blackout", described=told)


def phase_figure(analysis: Analysis, one: Reconfiguration, *, releases: int = 40) -> str:
    """Draw how far the releases before and after were off the grid; empty without a grid."""
    grid = analysis.trace.deployment_at(one.component, one.armed_ns)
    found = analysis.releases[one.component]
    if grid is None or grid.period_ns <= 0 or not len(found):
        return ""
    actual_ns = found["begin_ns"] + found["wakeup_ns"]
    middle = int(np.searchsorted(actual_ns, one.armed_ns))
    chosen = range(max(middle - releases, 0), min(middle + releases, len(found)))
    errors = [grid.phase_ns(int(actual_ns[index])) for index in chosen]
    if not errors:
        return ""
    low, high = (_typical_limit(errors, sign) for sign in (-1, 1))
    top, height = 22.0, 154.0
    bottom = height - 28
    span = max(high - low, 1_000) * 1.1

    def y(error_ns: float) -> float:
        return bottom - (min(max(error_ns, low), high) - low) / span * (bottom - top)

    step = (WIDTH - LEFT - RIGHT) / (2 * releases)
    parts = []
    ticks = linear_ticks(low, low + span, count=4)
    for value, text in zip(ticks, tick_texts(ticks), strict=True):
        parts.append(svg.line(LEFT, y(value), WIDTH - RIGHT, y(value), css="grid-line" if value else "axis"))
        parts.append(svg.label(LEFT - 8, y(value) + 4, text, css="tick", anchor="end"))
    centre = LEFT + releases * step
    parts.append(svg.line(centre, top - 8, centre, bottom, css="blackout-line"))
    for index, error_ns in zip(chosen, errors, strict=True):
        x = centre + (index - middle + 0.5) * step
        which = index - middle + (index >= middle)
        tip = f"release {which:+d}: {time_text(error_ns)} after its instant of the grid"
        parts.append(svg.line(x, y(0), x, y(error_ns), css="stem"))
        css = "after" if index >= middle else "before"
        if low <= error_ns <= high:
            parts.append(svg.circle(x, y(error_ns), 3.2, css=f"dot {css}", tip=tip))
        else:  # further off than the figure reaches
            points = f"M{svg.number(x - 4)} {svg.number(y(error_ns))}h8l-4 {-8 if error_ns > high else 8}z"
            parts.append(svg.path(points, css=f"dot {css}", tip=tip))
    parts.append(svg.label(centre - 10, height - 8, "releases before", css="tick", anchor="end"))
    parts.append(svg.label(centre + 10, height - 8, "releases after", css="tick"))
    parts.append(svg.label(10, top + 4, "off the grid", css="strong"))
    return svg.svg(
        WIDTH, height, "".join(parts), css="swap-phase", described="phase of releases around the swap"
    )


def _typical_limit(errors: list[int], sign: int) -> float:
    """How far a figure reaches on one side of 0: single outliers do not flatten all the rest."""
    sizes = [max(sign * error, 0) for error in errors]
    return sign * min(max(sizes), max(_OUTLIER * float(np.quantile(sizes, 0.9)), 1_000))


def window_around(analysis: Analysis, one: Reconfiguration) -> Window:
    """Return what the figure of the grid shows: some periods around the swap and the next release."""
    period_ns = analysis.period_ns(one.component)
    next_ns = one.nominal_ns if one.nominal_ns is not None else one.pending_ns
    first_ns, last_ns = one.parked_ns, max(one.armed_ns, next_ns)
    if period_ns <= 0:
        begins = analysis.releases[one.component]["begin_ns"]
        typical = float(np.median(np.diff(begins))) if len(begins) > 2 else 0.0  # noqa: PLR2004
        period_ns = int(typical) or max(last_ns - first_ns, 1_000_000)
    around = _PERIODS_AROUND * period_ns
    return Window(first_ns - around, last_ns + around)


def began(one: Reconfiguration) -> str:
    """Return what stopped the component: a fault, or the park."""
    return "fault" if one.after_fault else "parked"


def axis(window: Window, one: Reconfiguration, y: float) -> str:
    """Return the time axis of a figure, at a height of the figure; it counts from the park or the fault."""
    zero_ns, zero = one.parked_ns, began(one)
    parts = [svg.line(LEFT, y, WIDTH - RIGHT, y, css="axis")]
    ticks = list(window.ticks(zero_ns))
    texts = tick_texts([value for _, value in ticks])
    for (x, value), told in zip(ticks, texts, strict=True):
        text = zero if value == 0 else ("+" if value > 0 else "") + told
        parts += [
            svg.line(x, y, x, y + 4, css="axis"),
            svg.label(x, y + 17, text, css="tick", anchor="middle"),
        ]
    return "".join(parts)


def _grid_lines(analysis: Analysis, one: Reconfiguration, window: Window) -> str:
    grid = analysis.trace.deployment_at(one.component, one.armed_ns)
    if grid is None or grid.period_ns <= 0:
        return ""
    origin_ns = grid.epoch_ns + grid.offset_ns
    first = int(np.ceil((window.begin_ns - origin_ns) / grid.period_ns))
    last = int(np.floor((window.end_ns - origin_ns) / grid.period_ns))
    if last - first > _MOST_TICKS:
        return ""
    places = (window.x(origin_ns + k * grid.period_ns) for k in range(first, last + 1))
    return "".join(svg.line(x, _TOP - 8, x, _TOP + _TALL_ROW, css="grid-line") for x in places)


def _row(analysis: Analysis, component: str, window: Window, top: float, height: float, *, css: str) -> str:
    base = top + height - 6
    room = height - (20 if css == "own" else 10)
    parts = [svg.line(LEFT, base, WIDTH - RIGHT, base, css="row-line")]
    name = svg.shortened(component, LEFT - 24)
    parts.append(svg.label(LEFT - 10, base - room / 2 + 5, name, css="name", anchor="end", tip=component))
    for index, slices in enumerate(analysis.slices[component].values()):
        begins, ends = slices["begin_ns"], slices["begin_ns"] + slices["extent_ns"]
        first, last = np.searchsorted(ends, window.begin_ns), np.searchsorted(begins, window.end_ns)
        boxes = _apart_by_pixels(begins[first:last], ends[first:last], window)
        commands = "".join(
            f"M{svg.number(x)} {svg.number(base)}v{svg.number(-room)}h{svg.number(width)}v{svg.number(room)}z"
            for x, width in boxes
        )
        parts.append(svg.path(commands, css=f"slice s{index % 8}"))
    releases = analysis.releases[component]["begin_ns"]
    first, last = np.searchsorted(releases, (window.begin_ns, window.end_ns))
    inside = releases[first:last]
    rise = room + (8 if css == "own" else 3)
    ticks = _apart_by_pixels(inside, inside, window)
    commands = "".join(f"M{svg.number(x)} {svg.number(base)}v{svg.number(-rise)}" for x, _ in ticks)
    parts.append(svg.path(commands, css=f"release {css}"))
    return "".join(parts)


def _apart_by_pixels(begin_ns: Times, end_ns: Times, window: Window) -> list[tuple[float, float]]:
    """Places and widths of intervals; of those that begin within half a pixel only one."""
    if not len(begin_ns):
        return []
    per_ns = (WIDTH - LEFT - RIGHT) / (window.end_ns - window.begin_ns)
    x = LEFT + np.clip((begin_ns - window.begin_ns) * per_ns, 0, None)
    end = np.minimum(LEFT + (end_ns - window.begin_ns) * per_ns, WIDTH - RIGHT)
    _, first = np.unique(np.round(2 * x), return_index=True)
    return list(zip(x[first].tolist(), np.maximum(end - x, 1)[first].tolist(), strict=True))


def _flags(one: Reconfiguration, window: Window) -> str:
    x = window.x(one.parked_ns)
    parts = [svg.label(x + 6, 14, f"{began(one)}, blackout {time_text(one.blackout_ns)}", css="strong")]
    if one.nominal_ns is not None:
        end = window.x(one.nominal_ns)
        missed = "" if one.missed_releases is None else f", {one.missed_releases or 'none'} missed"
        room = end - x > 330  # noqa: PLR2004
        if room:
            parts.append(svg.label(end, 14, f"next release{missed}", css="strong", anchor="middle"))
        parts.append(svg.path(f"M{svg.number(end - 4)} 18h8l-4 6z", css="arrow"))
    return "".join(parts)
