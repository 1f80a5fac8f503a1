"""Histograms as inline SVG: one filled, or two overlaid; the page's script tells counts on hover."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.reading.statistics import Distribution, distribution
from mauve_rt.trace.report import svg
from mauve_rt.trace.report.blocks import attribute
from mauve_rt.trace.report.scales import asks_for_log, linear_ticks, log_ticks
from mauve_rt.trace.report.timeline import json_for_script
from mauve_rt.trace.report.units import tick_texts, time_text

Values = npt.NDArray[np.int64]

WIDTH, HEIGHT = 320.0, 104.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 8.0, 8.0, 16.0, 18.0
_BINS = 44
_LABEL_ROOM = 46.0
_MARK_ROOM = 30.0


@dataclass(frozen=True)
class Bins:
    """Intervals of a histogram in ns."""

    edges: npt.NDArray[np.float64]
    logarithmic: bool

    def counts(self, values: Values) -> Values:
        """How many values are in each interval."""
        if not len(values):
            return np.zeros(len(self.edges) - 1, np.int64)
        inside = np.clip(values, self.edges[0], self.edges[-1])
        return np.histogram(inside, self.edges)[0].astype(np.int64)

    def place(self, value: float) -> float:
        """Where a value is, from 0 to 1."""
        low, high = self.edges[0], self.edges[-1]
        value = min(max(value, low), high)
        if self.logarithmic:
            return float(np.log(value / low) / np.log(high / low))
        return float((value - low) / (high - low))

    def ticks(self) -> list[float]:
        """Values to write below the axis."""
        low, high = float(self.edges[0]), float(self.edges[-1])
        return log_ticks(low, high) if self.logarithmic else linear_ticks(low, high, count=4)


def bins_of(values: Values) -> Bins:
    """Return intervals that hold all values: logarithmic where their span asks for it."""
    low, high = int(values.min()), int(values.max())
    positive = values[values > 0]
    lowest = int(positive.min()) if len(positive) else 0
    if low >= 0 and asks_for_log(lowest, high):
        return Bins(np.geomspace(lowest * 0.98, high * 1.02, _BINS + 1), logarithmic=True)
    margin = max(0.5, (high - low) * 0.02, 0.04 * abs(high) if high == low else 0)
    return Bins(np.linspace(low - margin, high + margin, _BINS + 1), logarithmic=False)


def histogram(
    series: Sequence[tuple[str, Values]], *, described: str, told: Distribution | None = None
) -> str:
    """Return a histogram of one or two series (name, values in ns); empty when there is no value.

    `told` are the percentiles to mark; of the only series when not given.
    """
    filled = [values for _, values in series if len(values)]
    if not filled:
        return ""
    bins = bins_of(np.concatenate(filled))
    counts = [bins.counts(values) for _, values in series]
    highest = max(int(one.max()) for one in counts)
    parts = [_axis(bins)]
    for index, one in enumerate(counts):
        css = "bars" if len(series) == 1 else ("bars after" if index else "bars before")
        parts.append(svg.path(_outline(one, highest), css=css))
    if len(series) == 1:
        parts.append(_marks(bins, told or distribution(series[0][1])))
    parts.append(svg.rect(0, 0, 0, HEIGHT - _BOTTOM - _TOP, css="cursor"))
    data = {
        "edges": [round(float(edge), 1) for edge in bins.edges],
        "names": [name for name, _ in series],
        "counts": [one.tolist() for one in counts],
        "area": [_LEFT, _TOP, WIDTH - _LEFT - _RIGHT, HEIGHT - _TOP - _BOTTOM],
    }
    drawing = svg.svg(WIDTH, HEIGHT, "".join(parts), css="histogram", described=described)
    return drawing.replace("<svg ", f'<svg data-histogram="{attribute(json_for_script(data))}" ', 1)


def _outline(counts: Values, highest: int) -> str:
    """Return the bars as one path; heights are logarithms of the counts, so that a single outlier shows."""
    area_width, area_height = WIDTH - _LEFT - _RIGHT, HEIGHT - _TOP - _BOTTOM
    step = area_width / len(counts)
    heights = np.log1p(counts) / np.log1p(max(highest, 1)) * area_height
    base = HEIGHT - _BOTTOM
    return "".join(
        f"M{svg.number(_LEFT + index * step + 0.3)} {svg.number(base)}v{svg.number(-max(float(height), 1.5))}"
        f"h{svg.number(step - 0.6)}V{svg.number(base)}z"
        for index, height in enumerate(heights)
        if height > 0
    )


def _axis(bins: Bins) -> str:
    base = HEIGHT - _BOTTOM
    parts = [svg.line(_LEFT, base, WIDTH - _RIGHT, base, css="axis")]
    free = 0.0
    ticks = bins.ticks()
    texts = [time_text(value) for value in ticks] if bins.logarithmic else tick_texts(ticks)
    for value, text in zip(ticks, texts, strict=True):
        x = _LEFT + bins.place(value) * (WIDTH - _LEFT - _RIGHT)
        parts.append(svg.line(x, base, x, base + 3, css="axis"))
        anchor = "start" if x < _LABEL_ROOM / 2 else "end" if x > WIDTH - _LABEL_ROOM / 2 else "middle"
        begin = x - {"start": 0.0, "middle": _LABEL_ROOM / 2, "end": _LABEL_ROOM}[anchor]
        if begin >= free:
            parts.append(svg.label(x, HEIGHT - 4, text, css="tick", anchor=anchor))
            free = begin + _LABEL_ROOM
    return "".join(parts)


def _marks(bins: Bins, told: Distribution) -> str:
    parts, free = [], -_MARK_ROOM
    marks = (("p50", told.p50_ns), ("p99", told.p99_ns), ("p99.9", told.p999_ns), ("max", told.max_ns))
    places = [(name, _LEFT + bins.place(value) * (WIDTH - _LEFT - _RIGHT)) for name, value in marks]
    for index, (name, x) in enumerate(places):
        parts.append(svg.line(x, _TOP - 3, x, HEIGHT - _BOTTOM, css=f"mark {name.replace('.', '')}"))
        last = places[-1][1]
        crowded = index < len(places) - 1 and last - x < 1.6 * _MARK_ROOM
        if x - free >= _MARK_ROOM and not crowded:
            anchor = "end" if x > WIDTH - _MARK_ROOM else "middle" if x > _MARK_ROOM / 2 else "start"
            parts.append(svg.label(x, _TOP - 6, name, css="tick", anchor=anchor))
            free = x
    return "".join(parts)
