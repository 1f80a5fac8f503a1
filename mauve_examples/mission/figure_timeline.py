"""timeline.png: what every component of a robot did around a swap, and the swap itself, magnified."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from mauve_examples.mission.evidence import RobotEvidence
from mauve_examples.mission.facts import MissionFacts
from mauve_examples.mission.figure_style import (
    GRID,
    INK,
    LINK_DOWN_INK,
    MICROSECOND,
    MUTED,
    STATES,
    microseconds,
    new_figure,
    save,
    short,
    tidy,
    title,
)
from mauve_examples.mission.swaps import Swap
from mauve_rt.trace.reconfigurations import Reconfiguration
from mauve_rt.trace.records import Kind, ReconfigurationPhase, Records
from mauve_rt.trace.statistics import Spans, state_spans
from mauve_rt.trace.trace import Trace

_WIDE_NS = (600_000_000, 900_000_000)
_NEAR_NS = (22_000_000, 38_000_000)
_LONGEST_STATE_NS = 2_000_000_000
_ROW_IN, _PANEL_IN = 0.46, 1.0
_HALF_BOX = 0.25
_BLACKOUT = "#ffd54f"
_PHASES = {ReconfigurationPhase.ADOPT: "#5bb08a", ReconfigurationPhase.TAKE: "#4c8fc7"}
_KEY = "boxes: states being executed; ticks: releases; crosses: overruns"


class _Window(NamedTuple):
    """What of the time is shown, and how its axis counts."""

    begin_ns: int
    end_ns: int
    zero_ns: int
    unit_ns: float
    unit: str

    def at(self, time_ns: float) -> float:
        return (time_ns - self.zero_ns) / self.unit_ns


def draw_timeline(path: Path, facts: MissionFacts, evidence: RobotEvidence, swap: Swap | None) -> None:
    """Write the figure: around the swap, or in the middle of the mission when there was none."""
    trace = evidence.trace
    every = list(trace.components)
    middle_ns = (facts.started_ns + facts.ended_ns) // 2
    centre_ns = middle_ns if swap is None else swap.measured.parked_ns
    wide, near = (
        _Window(centre_ns - before, centre_ns + after, centre_ns, 1e6, "ms")
        for before, after in (_WIDE_NS, _NEAR_NS)
    )
    glass = None if swap is None else _under_glass(swap.measured)
    at_work = [] if glass is None or swap is None else _at_work(trace, glass, swap.measured.component)
    heights = [len(rows) * _ROW_IN + _PANEL_IN for rows in (every, every, at_work) if rows]
    figure = new_figure(11.0, sum(heights))
    panels = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    _draw_rows(panels[0], trace, every, wide)
    _name_states(panels[0], trace, every)
    _draw_rows(panels[1], trace, every, near)
    time_s = facts.seconds(centre_ns)
    if swap is None or glass is None:
        title(panels[0], f"{evidence.robot}: executions {time_s:.0f} s into the mission", _KEY)
        title(panels[1], "The same, closer")
    else:
        change = f"{short(swap.from_core)} becomes {short(swap.to_core)}"
        title(panels[0], f"{evidence.robot}, {time_s:.2f} s: {change} in the running executor", _KEY)
        title(panels[1], f"The same, closer: who runs when {swap.measured.component} is parked")
        for panel in panels[:2]:
            panel.axvline(0, color=LINK_DOWN_INK, linewidth=1.2, zorder=5)
        _draw_swap(panels[2], trace, at_work, (glass, swap.measured))
    save(figure, path)


def _around(centre_ns: int, before_ns: int, after_ns: int) -> _Window:
    return _Window(centre_ns - before_ns, centre_ns + after_ns, centre_ns, 1e6, "ms")


def _under_glass(one: Reconfiguration) -> _Window:
    around_ns = max(one.blackout_ns // 2, 300)
    return _Window(one.parked_ns - around_ns, one.armed_ns + around_ns, one.parked_ns, 1e3, MICROSECOND)


def _at_work(trace: Trace, window: _Window, always: str) -> list[str]:
    """Components that execute something in the window, and one that is shown in any case."""
    return [name for name in trace.components if name == always or len(_executed(trace, name, window))]


def _within(records: Records, begin_ns: int, end_ns: int) -> Records:
    return records[(records["time_ns"] >= begin_ns) & (records["time_ns"] <= end_ns)]


def _states(trace: Trace, component: str) -> list[int]:
    """Names of a component's states, in the order in which they first ran: that of their colours."""
    names, first = np.unique(trace.of(component, Kind.STATE_BEGIN)["name"], return_index=True)
    return [int(name) for name in names[np.argsort(first)]]


def _executed(trace: Trace, component: str, window: _Window) -> Spans:
    """Return the executions of states that reach into the window."""
    margin_ns = _LONGEST_STATE_NS
    records = _within(trace.of(component), window.begin_ns - margin_ns, window.end_ns + margin_ns)
    spans = state_spans(records)
    inside: Spans = spans[(spans["end_ns"] >= window.begin_ns) & (spans["begin_ns"] <= window.end_ns)]
    return inside


def _draw_rows(axes: Axes, trace: Trace, components: list[str], window: _Window) -> None:
    for row, component in enumerate(components):
        records = _within(trace.of(component), window.begin_ns, window.end_ns)
        releases = records["b"][records["kind"] == Kind.RELEASE]
        axes.vlines(window.at(releases), row - 0.44, row - _HALF_BOX, color=INK, linewidth=0.8, zorder=4)
        late = records["time_ns"][records["kind"] == Kind.OVERRUN]
        axes.scatter(window.at(late), late * 0 + row - 0.38, marker="x", s=26, color=LINK_DOWN_INK, zorder=6)
        states = _states(trace, component)
        for span in _executed(trace, component, window):
            colour = STATES[states.index(span["name"]) % len(STATES)]
            axes.broken_barh(
                [(window.at(span["begin_ns"]), (span["end_ns"] - span["begin_ns"]) / window.unit_ns)],
                (row - _HALF_BOX, 2 * _HALF_BOX),
                facecolor=colour,
                edgecolor=colour,
                linewidth=0.6,
                zorder=3,
            )
        axes.axhline(row + _HALF_BOX, color=GRID, linewidth=0.8, zorder=1)
    axes.set_yticks(range(len(components)), components)
    axes.set_ylim(len(components) - 0.55, -0.6)
    axes.set_xlim(window.at(window.begin_ns), window.at(window.end_ns))
    tidy(axes, grid="x")
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(window.unit, color=MUTED, fontsize=9)


def _name_states(axes: Axes, trace: Trace, components: list[str]) -> None:
    """Write the names of each component's states, in their colours, to the right of its row."""
    for row, component in enumerate(components):
        states = _states(trace, component)
        for line, state in enumerate(states):
            axes.annotate(
                trace.name(state),
                (1, row),
                xytext=(6, 8.5 * ((len(states) - 1) / 2 - line)),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                color=STATES[line % len(STATES)],
                fontsize=8,
                fontweight="bold",
                va="center",
            )


def _draw_swap(
    axes: Axes, trace: Trace, components: list[str], shown: tuple[_Window, Reconfiguration]
) -> None:
    """Draw the parked-armed interval, with what the others did meanwhile."""
    window, one = shown
    _draw_rows(axes, trace, components, window)
    row = components.index(one.component)
    blackout_us = one.blackout_ns / 1e3
    axes.broken_barh([(0, blackout_us)], (row - 0.34, 0.68), facecolor=_BLACKOUT, edgecolor=INK, zorder=2)
    told = f"parked to armed {microseconds(one.blackout_ns)}"
    handles = [Patch(facecolor=_BLACKOUT, edgecolor=INK, label=told)]
    begin_us = 0.0
    for phase, took_ns in zip(_PHASES, (one.adopt_ns, one.take_ns), strict=True):
        axes.broken_barh([(begin_us, took_ns / 1e3)], (row - 0.2, 0.4), facecolor=_PHASES[phase], zorder=4)
        told = f"{phase.name.lower()} {microseconds(took_ns)}"
        handles.append(Patch(facecolor=_PHASES[phase], label=told))
        begin_us += took_ns / 1e3
    due_ms = (one.pending_ns - one.parked_ns) / 1e6
    missed = "it has no grid" if one.missed_releases is None else f"{one.missed_releases} missed"
    if one.missed_releases == 0:
        missed = "none was missed"
    title(
        axes,
        f"The swap itself: {one.component} is parked for {microseconds(one.blackout_ns)}",
        f"its next release was due {due_ms:.1f} ms after the park; {missed}",
    )
    axes.legend(
        handles=handles,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.02),
        fontsize=8.5,
        frameon=False,
        ncols=3,
        borderaxespad=0.0,
    )
