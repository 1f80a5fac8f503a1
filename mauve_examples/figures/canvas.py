"""How the timelines look: rows of boxes and arrows over time, as SVG for light and for dark pages."""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from mauve_examples.figures.measures import Interval

INK, MUTED, FAINT, CARD, EDGE = "#1f2a33", "#66737d", "#c3ccd3", "#fdfdfb", "#dde2e6"
DEPLOYER, FIRST, SECOND, REPLACED, CHANGE = "#7f8d99", "#2f7fc1", "#e08a2c", "#3a9d6e", "#c2475b"
_DARK = {
    INK: "#e6edf3",
    MUTED: "#9aa7b3",
    FAINT: "#3d4853",
    CARD: "#12181f",
    EDGE: "#2c3640",
    CHANGE: "#e8697d",
}
_NS_PER_MS = 1e6
_BOX, _ARROW, _ABOVE = 0.42, 0.68, 0.86  # heights in a row
_WIDTH_IN, _ROW_IN, _HEAD_IN, _FOOT_IN = 10.2, 0.92, 0.42, 0.6
_TICKS = 10
_NARROW = 0.03  # of the axis: a label has no room in such a box
_TICK_STEPS_MS = (5, 10, 20, 50, 100)
_RC: dict[Any, Any] = {
    "svg.fonttype": "path",
    "svg.hashsalt": "mauve",
    "mathtext.fontset": "stix",
    "font.size": 10.5,
}


class Canvas:
    """One timeline. Times are ns of CLOCK_MONOTONIC, rows are counted from the top."""

    def __init__(self, title: str, rows: Sequence[tuple[str, str]], window: Interval, zero_ns: int) -> None:
        """`rows`: name and colour of each; `zero_ns`: what the axis counts from."""
        self._title = title
        self._zero_ns = zero_ns
        self._window = window
        self._rows = len(rows)
        height_in = _ROW_IN * len(rows) + _HEAD_IN + _FOOT_IN
        with mpl.rc_context(_RC):
            self.figure = Figure(figsize=(_WIDTH_IN, height_in), facecolor="none")
            below, rows_share = _FOOT_IN / height_in, _ROW_IN * len(rows) / height_in
            self.axes: Axes = self.figure.add_axes((0.098, below, 0.858, rows_share))
            self._frame(rows)

    def _frame(self, rows: Sequence[tuple[str, str]]) -> None:
        card = FancyBboxPatch(
            (0.004, 0.008),
            0.992,
            0.984,
            boxstyle="round,pad=0,rounding_size=0.012",
            transform=self.figure.transFigure,
            facecolor=CARD,
            edgecolor=EDGE,
            linewidth=1.0,
            zorder=-10,
        )
        self.figure.add_artist(card)
        height_in = self.figure.get_figheight()
        place = (0.02, 1 - 0.26 / height_in)
        self.figure.text(*place, self._title, color=INK, fontsize=11.5, fontweight="bold", va="center")
        axes = self.axes
        axes.patch.set_visible(False)
        begin, end = (self.at(time_ns) for time_ns in self._window)
        axes.set_xlim(begin, end)
        axes.set_ylim(0, self._rows)
        for side in ("top", "left", "right", "bottom"):
            axes.spines[side].set_visible(False)
        axes.set_yticks([])
        step = next((step for step in _TICK_STEPS_MS if (end - begin) / step <= _TICKS), _TICK_STEPS_MS[-1])
        axes.set_xticks([tick for tick in range(-1000, 1000, step) if begin <= tick <= end])
        axes.tick_params(axis="x", colors=MUTED, labelsize=8.5, length=3, pad=16)
        axes.annotate(
            "ms",
            (1.0, 0),
            xytext=(8, -19),
            xycoords="axes fraction",
            textcoords="offset points",
            va="top",
            color=MUTED,
            fontsize=8.5,
        )
        for row, (name, colour) in enumerate(rows):
            base = self._base(row)
            axes.annotate(
                "",
                (1.008, base),
                xytext=(0, base),
                xycoords=("axes fraction", "data"),
                textcoords=("axes fraction", "data"),
                arrowprops={
                    "arrowstyle": "-|>,head_width=0.18,head_length=0.4",
                    "color": INK,
                    "linewidth": 1.0,
                },
                zorder=2,
            )
            axes.annotate(
                name,
                (0, base),
                xytext=(-9, 9),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                ha="right",
                va="center",
                color=colour,
                fontsize=15 if "$" in name else 11,
                fontweight="bold",
            )

    def at(self, time_ns: float) -> float:
        """Where a time is on the axis: ms."""
        return (time_ns - self._zero_ns) / _NS_PER_MS

    def box(self, row: int, interval: Interval, colour: str, label: str = "", *, faint: bool = False) -> None:
        """Something was executed; `faint`: it was to be, and waited for the processor."""
        begin, length = self.at(interval[0]), (interval[1] - interval[0]) / _NS_PER_MS
        self.axes.broken_barh(
            [(begin, length)],
            (self._base(row), _BOX * (0.34 if faint else 1)),
            facecolor=colour,
            edgecolor="none" if faint else INK,
            alpha=0.3 if faint else 1.0,
            linewidth=0.9,
            zorder=3 if faint else 4,
            clip_on=True,
        )
        if label and self._is_narrow(interval):
            self.axes.text(
                begin, self._base(row) + _BOX + 0.06, label, ha="left", va="bottom", color=INK, zorder=6
            )
        elif label:
            middle = (begin + length / 2, self._base(row) + _BOX / 2)
            self.axes.text(*middle, label, ha="center", va="center", color="white", zorder=6)

    def releases(self, row: int, instants_ns: Iterable[int]) -> None:
        """Arrows up at nominal instants."""
        for instant_ns in instants_ns:
            if not self._window[0] <= instant_ns <= self._window[1]:
                continue
            self.axes.annotate(
                "",
                (self.at(instant_ns), self._base(row) + _ARROW),
                xytext=(self.at(instant_ns), self._base(row) - 0.012),
                arrowprops={
                    "arrowstyle": "-|>,head_width=0.16,head_length=0.36",
                    "color": INK,
                    "linewidth": 1.3,
                },
                zorder=5,
            )

    def grid(self, instants_ns: Iterable[int], colour: str, rows: tuple[int, int] | None = None) -> None:
        """Dotted lines down through the rows."""
        top, bottom = rows or (0, self._rows - 1)
        for instant_ns in instants_ns:
            self.axes.vlines(
                self.at(instant_ns),
                self._base(bottom),
                self._base(top) + _ABOVE,
                color=colour,
                linewidth=1.1,
                linestyle=(0, (1, 2.2)),
                zorder=1,
            )

    def instant(self, time_ns: int, name: str, *, row: int = 0) -> None:
        """A named instant at the bottom, with a line up to the row where it happened."""
        self.axes.vlines(self.at(time_ns), 0, self._base(row), color=MUTED, linewidth=0.8, zorder=1)
        self.axes.annotate(
            name,
            (self.at(time_ns), 0),
            xytext=(0, -4),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            va="top",
            color=INK,
            fontsize=13,
        )

    def ready(self, row: int, time_ns: int) -> None:
        """A dot: from here on the task's thread waits for its first instant."""
        place = ([self.at(time_ns)], [self._base(row)])
        self.axes.scatter(*place, s=26, facecolor=CARD, edgecolor=INK, linewidth=1.2, zorder=6)

    def span(self, row: int, interval: Interval, text: str) -> None:
        """A dimension line with its length written on it."""
        height = self._base(row) + 0.56
        begin, end = (self.at(time_ns) for time_ns in interval)
        arrow = {"arrowstyle": "<|-|>,head_width=0.12,head_length=0.3", "color": CHANGE, "linewidth": 1.0}
        self.axes.annotate(
            "",
            (end, height),
            xytext=(begin, height),
            arrowprops={**arrow, "shrinkA": 0, "shrinkB": 0},
            zorder=7,
        )
        self.axes.annotate(
            text,
            ((begin + end) / 2, height),
            xytext=(0, 3),
            textcoords="offset points",
            ha="center",
            va="bottom",
            color=CHANGE,
            fontsize=9.5,
            zorder=7,
        )

    def remark(self, row: int, time_ns: int, text: str, colour: str = MUTED) -> None:
        """Words to the right of a time, at the height of the boxes."""
        place = (self.at(time_ns), self._base(row) + _BOX / 2)
        self.axes.annotate(
            text,
            place,
            xytext=(9, 0),
            textcoords="offset points",
            va="center",
            color=colour,
            fontsize=9.5,
            bbox={"facecolor": CARD, "edgecolor": "none", "pad": 1.5},
            zorder=7,
        )

    def change(self, row: int, time_ns: int, text: str) -> None:
        """Words above a time of a row, and a line down to it."""
        base = self._base(row)
        self.axes.vlines(self.at(time_ns), base, base + _BOX, color=CHANGE, linewidth=1.3, zorder=5)
        place = (self.at(time_ns), base + _BOX + 0.05)
        ground = {"facecolor": CARD, "edgecolor": "none", "pad": 0.5}
        self.axes.text(
            *place, text, ha="center", va="bottom", color=CHANGE, fontsize=10, bbox=ground, zorder=7
        )

    def save(self, path: Path) -> None:
        """Write the SVG, with colours for dark pages too."""
        with mpl.rc_context(_RC):
            self.figure.savefig(
                path, format="svg", metadata={"Date": None, "Creator": None, "Title": self._title}
            )
        rules = "".join(
            f'[style*="{what}: {light}"]{{{what}:{dark} !important}}'
            for light, dark in _DARK.items()
            for what in ("fill", "stroke")
        )
        style = f"<style>@media (prefers-color-scheme: dark){{{rules}}}</style>"
        svg = path.read_text(encoding="utf-8")
        path.write_text(re.sub(r"(<svg\b[^>]*>)", rf"\1{style}", svg, count=1), encoding="utf-8")

    def _base(self, row: int) -> float:
        """The height of a row's line."""
        return self._rows - 1 - row + 0.1

    def _is_narrow(self, interval: Interval) -> bool:
        return interval[1] - interval[0] < _NARROW * (self._window[1] - self._window[0])
