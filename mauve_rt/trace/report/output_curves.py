"""The outputs of a bumpless change around the swap, drawn: old core, candidate, new core, and the bound."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from mauve_rt.trace.reading.shadows import OutputCurve, OutputStep, Shadow
from mauve_rt.trace.report import svg
from mauve_rt.trace.report.scales import linear_ticks
from mauve_rt.trace.report.units import number_text

_MOST_FIGURES = 24
_WIDTH, _HEIGHT = 340.0, 200.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 54.0, 12.0, 18.0, 22.0
_LABEL_ROOM = 62.0
_NS_PER_MS = 1e6
_DIGITS = range(4, 17)
_BAND_IN_SPANS = 2  # a band that is larger than so many curves is cut

_KEYS = {
    "before": "core before",
    "candidate": "candidate in the shadow",
    "after": "candidate as the core",
    "band": "at most the greatest difference from the last output of the core before",
}
_Points = Sequence[tuple[int, float]]


@dataclass(frozen=True)
class _Plane:
    """What the axes span."""

    begin_ns: int
    end_ns: int
    low: float
    high: float

    def x(self, instant_ns: int) -> float:
        share = (instant_ns - self.begin_ns) / max(self.end_ns - self.begin_ns, 1)
        return _LEFT + share * (_WIDTH - _LEFT - _RIGHT)

    def y(self, number: float) -> float:
        half = self.low / 2  # the whole span may be infinite
        share = (min(max(number, self.low), self.high) / 2 - half) / (self.high / 2 - half)
        return _HEIGHT - _BOTTOM - share * (_HEIGHT - _TOP - _BOTTOM)


def output_curves(shadows: Sequence[Shadow]) -> str:
    """Return a figure for each output of a bumpless change, as HTML; empty when there is none."""
    figures = [
        _figure(one, step, curve)
        for one in shadows
        for step, curve in zip(one.steps, one.curves, strict=False)
        if any(map(math.isfinite, (*curve.live, *curve.candidate)))
    ]
    if not figures:
        return ""
    keys = "".join(f'<span><i class="{css}"></i>{words}</span> ' for css, words in _KEYS.items())
    more = len(figures) - _MOST_FIGURES
    rest = f"<p>{more:,} more are not drawn.</p>" if more > 0 else ""
    drawn = "".join(figures[:_MOST_FIGURES])
    return f'<p class="key steps">{keys}</p><div class="grid steps">{drawn}</div>{rest}'


def _figure(one: Shadow, step: OutputStep, curve: OutputCurve) -> str:
    if curve.instant_ns is None:
        told = f"not swapped, least difference {number_text(step.least)}"
    else:
        told = f"step {_signed(step.step)}, difference {_signed(step.difference)}"
    told += f" (at most {number_text(step.greatest)})"
    name = f"{one.component} {curve.output}"
    core = escape(one.core.rpartition("/")[2])
    caption = f"<figcaption>{escape(name)} <small>{core}</small></figcaption>"
    drawing = _drawing(step, curve, f"{name}: {told}")
    return f"<figure>{caption}{drawing}<small>{escape(told)}</small></figure>"


def _drawing(step: OutputStep, curve: OutputCurve, described: str) -> str:
    before, candidate, after = (_finite(curve.points(name)) for name in ("live", "candidate", "new_core"))
    zero_ns = curve.instant_ns or curve.instants_ns[-1]
    plane = _plane([*before, *candidate, *after], zero_ns, before[-1:], step.greatest)
    parts = [_band(plane, before[-1:], step.greatest), *_axes(plane, zero_ns)]
    if curve.instant_ns is not None:
        parts.append(_upright(plane, zero_ns, "T"))
    elif plane.begin_ns <= step.least_instant_ns <= plane.end_ns:
        parts.append(_upright(plane, step.least_instant_ns, "least"))
    for css, points in (("before", before), ("candidate", candidate), ("after", after)):
        if points:
            parts.append(svg.path(_line(plane, points), css=f"curve {css}"))
    if before and after:  # the step is between these two
        parts.append(_dot(plane, before[-1], css="before", name="last of the core before"))
        parts.append(_dot(plane, after[0], css="after", name="first of the new core"))
    return svg.svg(_WIDTH, _HEIGHT, "".join(parts), described=described)


def _plane(points: _Points, zero_ns: int, last: _Points, greatest: float) -> _Plane:
    """As large as the curves, and as the band where it is not much larger than they are."""
    numbers = [number for _, number in points]
    span = max(numbers) / 2 - min(numbers) / 2
    if span == 0 or greatest / 2 <= _BAND_IN_SPANS * span:
        numbers += [number + sign * greatest for _, number in last for sign in (-1, 1)]
    low, high = min(numbers), max(numbers)
    margin = max((high / 2 - low / 2) / 10, abs(high) * 1e-9, 1e-300)
    instants = [at for at, _ in points]
    return _Plane(min(instants), max(*instants, zero_ns), low - margin, high + margin)


def _finite(points: _Points) -> _Points:
    return [point for point in points if math.isfinite(point[1])]


def _line(plane: _Plane, points: _Points) -> str:
    return "M" + "L".join(f"{svg.number(plane.x(at))} {svg.number(plane.y(number))}" for at, number in points)


def _band(plane: _Plane, last: _Points, greatest: float) -> str:
    ends = [(plane.y(number + greatest), plane.y(number - greatest)) for _, number in last]
    width = _WIDTH - _LEFT - _RIGHT
    return "".join(svg.rect(_LEFT, top, width, max(bottom - top, 1), css="band") for top, bottom in ends)


def _dot(plane: _Plane, point: tuple[int, float], *, css: str, name: str) -> str:
    at, number = point
    tip = f"{name}: {number_text(number)}"
    return svg.circle(plane.x(at), plane.y(number), 2.6, css=f"dot {css}", tip=tip)


def _axes(plane: _Plane, zero_ns: int) -> list[str]:
    """Times in ms from `zero_ns` on; numbers in the unit of the output."""
    base = _HEIGHT - _BOTTOM
    parts = [svg.line(_LEFT, base, _WIDTH - _RIGHT, base, css="axis")]
    free = 0.0
    ends_ms = ((at - zero_ns) / _NS_PER_MS for at in (plane.begin_ns, plane.end_ns))
    for tick_ms in linear_ticks(*ends_ms, count=4):
        x = plane.x(zero_ns + round(tick_ms * _NS_PER_MS))
        parts.append(svg.line(x, base, x, base + 3, css="axis"))
        middle = min(x, _WIDTH - _LABEL_ROOM / 2)
        if middle - _LABEL_ROOM / 2 >= free:
            text = f"{number_text(tick_ms)}\N{NARROW NO-BREAK SPACE}ms"
            parts.append(svg.label(middle, _HEIGHT - 6, text, css="tick", anchor="middle"))
            free = middle + _LABEL_ROOM / 2
    ticks = linear_ticks(plane.low, plane.high, count=4)
    for tick, text in zip(ticks, _tick_texts(ticks), strict=True):
        parts.append(svg.line(_LEFT, plane.y(tick), _WIDTH - _RIGHT, plane.y(tick), css="row-line"))
        parts.append(svg.label(_LEFT - 6, plane.y(tick) + 4, text, css="tick", anchor="end"))
    return parts


def _upright(plane: _Plane, instant_ns: int, name: str) -> str:
    x = plane.x(instant_ns)
    mark = svg.line(x, _TOP - 3, x, _HEIGHT - _BOTTOM, css="instant")
    anchor = "end" if x > _WIDTH - _LABEL_ROOM / 2 else "middle"
    return mark + svg.label(x, _TOP - 6, name, css="strong", anchor=anchor)


def _tick_texts(ticks: Sequence[float]) -> list[str]:
    """As short as tells them apart."""
    all_texts = ([number_text(tick, digits=digits) for tick in ticks] for digits in _DIGITS)
    return next((texts for texts in all_texts if len({*texts}) == len(texts)), [""] * len(ticks))


def _signed(number: float) -> str:
    return ("+" if number > 0 else "") + number_text(number)
