"""Values around a reconfiguration: before, during and after it, as curves and in words."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mauve_rt.trace.reading.reconfigurations import Reconfiguration
from mauve_rt.trace.reading.value_tables import Floats
from mauve_rt.trace.reading.values import Samples
from mauve_rt.trace.report import svg
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import bullets
from mauve_rt.trace.report.cycles import Array
from mauve_rt.trace.report.detail import choose_detail
from mauve_rt.trace.report.swap_figure import LEFT, RIGHT, WIDTH, Window, axis, window_around
from mauve_rt.trace.report.units import counted, number_text, time_text
from mauve_rt.trace.report.values import value_entries

MOST_VALUES = 6
_COMPARED = 200
"""Samples before a swap whose typical step is compared to the step over the swap."""
_ROW, _PAD, _TOP = 54.0, 13.0, 10.0
_ENTRIES = 3_000
_DIGITS, _STEP_DIGITS = 6, 3
_CHARACTERS = 22


@dataclass(frozen=True)
class SwapValue:
    """One value around a swap; only samples that are finite."""

    name: str
    samples: Samples
    before: float | None
    """The last value before the park."""
    during: Floats
    after: float | None
    """The first value at or after the end of the blackout."""
    later_ns: int | None
    """How long after the blackout, where that is beyond the figure."""
    rank: float
    """Step over the swap, in typical steps before it; 0 where the value after it is beyond the figure."""

    @property
    def step(self) -> float | None:
        """After minus before."""
        return None if self.before is None or self.after is None else self.after - self.before

    def words(self) -> str:
        """Return e.g. `pose.x: 0.42 before, 0.4 after, step -0.02`, with a minus sign."""
        parts = [_text(self.before, "before")]
        if len(self.during) == 1:
            parts.append(_text(float(self.during[0]), "during"))
        elif len(self.during):
            low, high = (number_text(float(end), digits=_DIGITS) for end in _ends(self.during))
            parts.append(f"{counted(len(self.during), 'value')} from {low} to {high} during")
        later = "" if self.later_ns is None else f" ({time_text(self.later_ns)} later)"
        parts.append(_text(self.after, "after") + later)
        if self.step is not None:
            sign = "+" if self.step > 0 else ""
            parts.append(f"step {sign}{number_text(self.step, digits=_STEP_DIGITS)}")
        return f"{self.name}: {', '.join(parts)}"


def swap_values(analysis: Analysis, one: Reconfiguration) -> list[SwapValue]:
    """Return the values that change most over a swap, relative to their steps before it."""
    values = analysis.trace.values
    window = window_around(analysis, one)
    found = [
        _around(values.name(field), samples, one, window) for field, samples in values.finite_samples.items()
    ]
    known = [value for value in found if value.before is not None or value.after is not None]
    if len(known) > MOST_VALUES:
        known = sorted(known, key=lambda value: -value.rank)[:MOST_VALUES]
    return known


def values_around_swap(analysis: Analysis, one: Reconfiguration) -> tuple[str, str]:
    """Return the figure, on the time axis of grid_figure(), and the words, as HTML; empty without values."""
    found = swap_values(analysis, one)
    if not found:
        return "", ""
    window = window_around(analysis, one)
    height = _TOP + len(found) * _ROW + 26
    band = max(window.x(one.armed_ns) - window.x(one.parked_ns), 2)
    parts = [
        axis(window, one, height - 22),
        svg.rect(window.x(one.parked_ns) - 1, _TOP, band, height - _TOP - 22, css="blackout"),
        *(
            _row(value, name, window, _TOP + index * _ROW)
            for index, (value, name) in enumerate(
                zip(found, _shortened([one.name for one in found]), strict=True)
            )
        ),
    ]
    described = f"values around the reconfiguration of {one.component}"
    figure = svg.svg(WIDTH, height, "".join(parts), css="swap-values", described=described)
    total = len(analysis.trace.values.samples)
    more = f" Of {total:,} values those that change most." if total > len(found) else ""
    title = f'<p class="note">Values before, during and after.{more}</p>'
    return figure, title + bullets((value.words() for value in found), css="values-words")


def _around(name: str, samples: Samples, one: Reconfiguration, window: Window) -> SwapValue:
    times, values = samples
    parked, armed = np.searchsorted(times, (one.parked_ns, max(one.armed_ns, one.parked_ns + 1))).tolist()
    before = float(values[parked - 1]) if parked else None
    after = float(values[armed]) if armed < len(values) else None
    near = armed < len(times) and times[armed] <= window.end_ns
    step = abs(after - before) if before is not None and after is not None and near else 0.0
    with np.errstate(over="ignore"):
        steps = np.abs(np.diff(values[max(parked - _COMPARED, 0) : parked]))
    typical = float(np.median(steps)) if len(steps) else 0.0
    rank = step / typical if typical else np.inf if step else 0.0
    later_ns = int(times[armed]) - one.armed_ns if after is not None and not near else None
    return SwapValue(name, Samples(times, values), before, values[parked:armed], after, later_ns, rank)


def _text(value: float | None, when: str) -> str:
    return f"none {when}" if value is None else f"{number_text(value, digits=_DIGITS)} {when}"


def _ends(values: Floats) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _row(value: SwapValue, name: str, window: Window, top: float) -> str:
    base = top + _ROW - 1
    parts = [
        svg.line(LEFT, base, WIDTH - RIGHT, base, css="row-line"),
        svg.label(LEFT - 10, top + _ROW / 2 + 4, name, css="name", anchor="end", tip=value.words()),
    ]
    entries = _entries_within(value.samples, window)
    if len(entries):
        low, high = float(entries["low"].min()), float(entries["high"].max())
        parts.append(svg.path(_steps(entries, window, top, (low, high)), css="value"))
        ends = ((high, top + _PAD - 2), (low, base - 3)) if high > low else ((low, top + _ROW / 2 - 4),)
        for end, y in ends:
            parts.append(svg.label(LEFT + 3, y, number_text(end), css="tick"))
    return "".join(parts)


def _shortened(names: Sequence[str]) -> list[str]:
    """The names, or the begin and end of each, cut where all stay different; else with numbers."""
    room = _CHARACTERS - 1
    heads = sorted(range(room), key=lambda head: abs(head - room // 2))
    for head in heads:
        found = [_cut(name, head) for name in names]
        if len({*found}) == len({*names}):
            return found
    return [f"{number}: {_cut(name, room // 2)}" for number, name in enumerate(names, start=1)]


def _cut(name: str, head: int) -> str:
    """The first `head` characters and the last ones of a long name."""
    if len(name) <= _CHARACTERS:
        return name
    return f"{name[:head]}\N{HORIZONTAL ELLIPSIS}{name[head + 1 - _CHARACTERS :]}"


def _entries_within(samples: Samples, window: Window) -> Array:
    """Samples in the window and the one that holds at its begin, at most some thousand."""
    times, values = samples
    first = max(int(np.searchsorted(times, window.begin_ns)) - 1, 0)
    last = int(np.searchsorted(times, window.end_ns))
    entries = value_entries(Samples(times[first:last], values[first:last]))
    return choose_detail([entries], np.empty(0, np.int64), budget=_ENTRIES).thinned(entries)


def _steps(entries: Array, window: Window, top: float, span: tuple[float, float]) -> str:
    half_low, half_span = span[0] / 2, span[1] / 2 - span[0] / 2  # the whole difference may be infinite
    room = _ROW - 2 * _PAD

    def y(value: float) -> str:
        share = (value / 2 - half_low) / half_span if half_span else 0.5
        return svg.number(top + _PAD + room * (1 - share))

    begin = max(float(entries["begin_ns"][0]), window.begin_ns)
    commands = f"M{svg.number(window.x(begin))} {y(float(entries['low'][0]))}"
    for entry in entries:
        commands += f"H{svg.number(window.x(float(entry['begin_ns'])))}"
        for value in dict.fromkeys((float(entry["low"]), float(entry["high"]))):
            commands += f"V{y(value)}"
    return f"{commands}H{svg.number(window.x(window.end_ns))}"
