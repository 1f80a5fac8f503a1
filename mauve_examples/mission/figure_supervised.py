"""supervisors.png: what a mission explored without supervisors, and what it would have with them."""

from pathlib import Path

from matplotlib.ticker import PercentFormatter

from mauve_examples.mission.evidence import CoverageHistory
from mauve_examples.mission.facts import MissionFacts
from mauve_examples.mission.figure_style import (
    LINK_DOWN,
    LINK_DOWN_INK,
    MUTED,
    ROBOTS,
    UNION,
    new_figure,
    save,
    tidy,
    title,
)
from mauve_examples.mission.supervised import Supervised


def draw_supervised(
    path: Path, facts: MissionFacts, coverage: CoverageHistory, supervised: Supervised
) -> None:
    """Write the figure."""
    figure = new_figure(11.0, 4.4)
    axes = figure.add_subplot()
    for begin_ns, end_ns in facts.link_down_ns:
        begin_s, end_s = facts.seconds(begin_ns), facts.seconds(end_ns)
        axes.axvspan(begin_s, end_s, color=LINK_DOWN, linewidth=0, zorder=0)
        axes.text(
            (begin_s + end_s) / 2,
            0.985,
            "radio link down",
            color=LINK_DOWN_INK,
            fontsize=9,
            ha="center",
            va="top",
        )
    how = "measured" if facts.simulation is None else "simulated"
    curves = (
        (supervised.coverage, "with supervisors (simulated)", ROBOTS[2]),
        (coverage, f"without supervisors ({how})", UNION),
    )
    for history, name, colour in curves:
        axes.plot(history.time_s, history.union, color=colour, linewidth=2.6, label=name, zorder=4)
    with_s = supervised.coverage.time_s
    between = [supervised.coverage.union_at(float(at_s)) for at_s in coverage.time_s if at_s <= with_s[-1]]
    shown = len(between)
    axes.fill_between(
        coverage.time_s[:shown], coverage.union[:shown], between, color=ROBOTS[2], alpha=0.15, linewidth=0
    )
    axes.set_ylim(0, 1)
    axes.set_xlim(0, max(float(coverage.time_s[-1]), float(with_s[-1])))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    tidy(axes, grid="y")
    axes.set_xlabel("mission time, s", fontsize=9.5)
    axes.xaxis.label.set_color(MUTED)
    axes.legend(loc="lower right", frameon=False, fontsize=9.5)
    title(
        axes,
        "What supervisors would have saved",
        "explored share of the reachable free cells, all robots together",
    )
    save(figure, path)
