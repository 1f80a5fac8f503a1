"""coverage.png: explored share over time, the link's loss, and which core explored when."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter

from mauve_examples.mission.evidence import CoverageHistory
from mauve_examples.mission.facts import MissionFacts
from mauve_examples.mission.figure_style import (
    INK,
    LINK_DOWN,
    LINK_DOWN_INK,
    MUTED,
    UNION,
    core_changes,
    new_figure,
    robot_colour,
    save,
    short,
    tidy,
    title,
)
from mauve_examples.mission.swaps import Swap

_ROW_IN = 0.34
_LABEL_GAP = 0.035


def draw_coverage(
    path: Path, facts: MissionFacts, coverage: CoverageHistory, swaps: dict[str, list[Swap]]
) -> None:
    """Write the figure."""
    rows = len(swaps)
    end_s = float(coverage.time_s[-1]) if len(coverage.time_s) else facts.seconds(facts.ended_ns)
    figure = new_figure(11.0, 4.7 + _ROW_IN * rows)
    axes, strip = figure.subplots(
        2, 1, sharex=True, gridspec_kw={"height_ratios": [3.7, _ROW_IN * rows + 0.1], "hspace": 0.02}
    )
    for one in (axes, strip):
        for begin_ns, end_ns in facts.link_down_ns:
            one.axvspan(
                facts.seconds(begin_ns), facts.seconds(end_ns), color=LINK_DOWN, linewidth=0, zorder=0
            )
    _draw_shares(axes, coverage, end_s)
    for begin_ns, end_ns in facts.link_down_ns:
        middle_s = (facts.seconds(begin_ns) + facts.seconds(end_ns)) / 2
        axes.text(middle_s, 0.985, "radio link down", color=LINK_DOWN_INK, fontsize=9, ha="center", va="top")
    for index, found in enumerate(swaps.values()):
        for swap in core_changes(found):
            time_s = facts.seconds(swap.measured.parked_ns)
            axes.axvline(time_s, color=robot_colour(index), linewidth=1.1, linestyle=(0, (4, 3)), zorder=2)
    axes.set_ylim(0, 1)
    axes.set_xlim(0, end_s)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    tidy(axes, grid="y")
    axes.tick_params(axis="x", labelbottom=False)
    title(
        axes,
        "Explored share of the reachable free cells",
        "dashed lines: the exploration's core is replaced in the running executor",
    )
    _draw_cores(strip, facts, swaps, end_s)
    save(figure, path)


def _draw_shares(axes: Axes, coverage: CoverageHistory, end_s: float) -> None:
    curves = [
        (name, values, robot_colour(i), 1.8) for i, (name, values) in enumerate(coverage.robots.items())
    ]
    if len(curves) > 1:
        curves.append(("together", coverage.union, UNION, 3.0))
    ends = []
    for name, values, colour, width in curves:
        axes.plot(coverage.time_s, values, color=colour, linewidth=width, zorder=4, solid_capstyle="round")
        ends.append((float(values[-1]) if len(values) else 0.0, name, colour))
    lowest = -1.0
    for value, name, colour in sorted(ends):  # labels at the lines' ends, kept apart
        height = max(value, lowest + 2 * _LABEL_GAP)
        lowest = height
        axes.annotate(
            f"{name}  {value:.1%}",
            (end_s, height),
            xytext=(6, 0),
            textcoords="offset points",
            color=colour,
            fontsize=9.5,
            fontweight="bold",
            va="center",
            annotation_clip=False,
        )


def _draw_cores(axes: Axes, facts: MissionFacts, swaps: dict[str, list[Swap]], end_s: float) -> None:
    """One bar per robot: which core its exploration ran when."""
    for index, found in enumerate(swaps.values()):
        colour = robot_colour(index)
        changes = core_changes(found)
        times = [0.0, *(facts.seconds(swap.measured.parked_ns) for swap in changes), end_s]
        names = (
            [changes[0].from_core, *(swap.to_core for swap in changes)]
            if changes
            else ["one core throughout"]
        )
        first = names[0]
        for begin_s, until_s, name in zip(times[:-1], times[1:], names, strict=True):
            alpha = 0.28 if name == first else 0.85
            axes.barh(
                index, until_s - begin_s, left=begin_s, height=0.66, color=colour, alpha=alpha, linewidth=0
            )
            if until_s - begin_s > 0.07 * end_s:
                ink = INK if name == first else "white"
                middle_s = (begin_s + until_s) / 2
                axes.text(middle_s, index, short(name), fontsize=8.5, color=ink, ha="center", va="center")
    axes.set_yticks(np.arange(len(swaps)), list(swaps))
    axes.set_ylim(max(len(swaps), 1) - 0.5, -0.5)
    tidy(axes)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("mission time, s", color=INK, fontsize=9.5)
    axes.xaxis.label.set_color(MUTED)
