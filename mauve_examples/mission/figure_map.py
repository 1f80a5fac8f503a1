"""map.png: the true map faintly, what was explored and by whom first, where the robots went."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mauve_examples.mission.evidence import CoverageHistory, RobotEvidence
from mauve_examples.mission.facts import MissionArea, MissionFacts
from mauve_examples.mission.figure_style import (
    INK,
    MUTED,
    core_changes,
    new_figure,
    robot_colour,
    save,
    short,
    tidy,
    title,
)
from mauve_examples.mission.swaps import Swap

_OUTSIDE, _UNEXPLORED, _WALL, _WALL_UNSEEN = "#f4f6f7", "#d5dce0", "#37474f", "#aab5bb"
_SWAP = "#ffd54f"
_TINT = 0.22
_WIDTH_IN, _LEGEND_IN = 11.0, 2.5
_MARGIN_M = 1.0


def draw_map(
    path: Path,
    facts: MissionFacts,
    area: MissionArea,
    coverage: CoverageHistory,
    robots: list[tuple[RobotEvidence, list[Swap]]],
) -> None:
    """Write the figure."""
    left, right, bottom, top = _window(area)
    scale = (_WIDTH_IN - _LEGEND_IN) / (right - left)
    figure = new_figure(_WIDTH_IN, float(np.clip((top - bottom) * scale + 1.1, 3.5, 11)))
    axes = figure.add_subplot()
    axes.imshow(
        _picture(area, coverage), origin="lower", extent=area.extent_m, interpolation="nearest", zorder=0
    )
    for index, (evidence, swaps) in enumerate(robots):
        _draw_track(axes, facts, evidence, colour=robot_colour(index))
        _draw_swaps(axes, facts, evidence, swaps)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.set_aspect("equal")
    tidy(axes)
    axes.set_xlabel("x, m", color=INK, fontsize=9)
    axes.set_ylabel("y, m", color=INK, fontsize=9)
    total = f"{coverage.union[-1]:.1%}" if len(coverage.union) else "nothing"
    title(
        axes,
        f"Explored: {total} of what the robots can reach",
        "tint: who saw a cell first",
    )
    handles = _legend(robots)
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=8.5,
        frameon=False,
        labelcolor=INK,
        handlelength=2.6,
    )
    save(figure, path)


def _window(area: MissionArea) -> tuple[float, float, float, float]:
    """What of the map to show: the reachable cells and a margin."""
    left, right, bottom, top = area.extent_m
    rows, columns = np.nonzero(area.reachable)
    if not len(rows):
        return left, right, bottom, top
    size = area.resolution_m
    return (
        max(left, area.origin_x_m + columns.min() * size - _MARGIN_M),
        min(right, area.origin_x_m + (columns.max() + 1) * size + _MARGIN_M),
        max(bottom, area.origin_y_m + rows.min() * size - _MARGIN_M),
        min(top, area.origin_y_m + (rows.max() + 1) * size + _MARGIN_M),
    )


def _picture(area: MissionArea, coverage: CoverageHistory) -> npt.NDArray[np.float64]:
    picture = np.empty((*area.cells.shape, 3))
    picture[:] = to_rgb(_OUTSIDE)
    picture[area.cells == 0] = to_rgb(_UNEXPLORED)
    explored = coverage.first >= 0
    for index in range(len(coverage.robots)):
        tint = 1 - _TINT * (1 - np.array(to_rgb(robot_colour(index))))
        picture[(coverage.first == index) & (area.cells == 0)] = tint
    walls = area.cells > 0
    picture[walls & ~explored] = to_rgb(_WALL_UNSEEN)
    picture[walls & explored] = to_rgb(_WALL)
    return picture


def _draw_track(axes: Axes, facts: MissionFacts, evidence: RobotEvidence, *, colour: str) -> None:
    track = evidence.track
    if not len(track):
        return
    times_ns = facts.started_ns + np.round(track[:, 0] * 1e9).astype(np.int64)
    down = np.array([facts.link_was_down(int(time_ns)) for time_ns in times_ns])
    breaks = np.nonzero(np.diff(down.astype(np.int8)))[0] + 1
    for part in np.split(np.arange(len(track)), breaks):
        points = track[part[0] : part[-1] + 2, 1:]
        axes.plot(*points.T, color="white", linewidth=3.6, alpha=0.85, zorder=2)
        axes.plot(*points.T, color=colour, linewidth=1.9, zorder=3)
        if down[part[0]]:
            axes.plot(*points.T, color="white", linewidth=1.0, linestyle=(0, (2.5, 2.5)), zorder=4)
    if len(evidence.goals):
        x, y = evidence.goals[:, 1:].T
        axes.scatter(x, y, marker="+", s=26, color=colour, linewidth=0.9, alpha=0.75, zorder=3)
    x, y, _ = facts.starts[evidence.robot]
    axes.scatter(x, y, marker="o", s=70, color="white", edgecolor=colour, linewidth=2.2, zorder=6)
    axes.scatter(
        track[-1, 1], track[-1, 2], marker="s", s=62, color=colour, edgecolor="white", linewidth=1.4, zorder=6
    )


def _draw_swaps(axes: Axes, facts: MissionFacts, evidence: RobotEvidence, swaps: list[Swap]) -> None:
    if not len(evidence.track):
        return
    for swap in core_changes(swaps):
        time_s = facts.seconds(swap.measured.parked_ns)
        index = int(np.argmin(np.abs(evidence.track[:, 0] - time_s)))
        place = (float(evidence.track[index, 1]), float(evidence.track[index, 2]))
        axes.scatter(
            place[0], place[1], marker="D", s=48, color=_SWAP, edgecolor=INK, linewidth=1.1, zorder=7
        )
        axes.annotate(
            f"{time_s:.0f} s: {short(swap.to_core)}",
            place,
            xytext=(8, 6),
            textcoords="offset points",
            fontsize=7.5,
            color=INK,
            bbox={"boxstyle": "round,pad=0.25", "facecolor": "white", "edgecolor": MUTED, "linewidth": 0.5},
            zorder=8,
        )


def _legend(robots: list[tuple[RobotEvidence, list[Swap]]]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=robot_colour(index), linewidth=2.2, label=evidence.robot)
        for index, (evidence, _) in enumerate(robots)
    ]
    handles += [
        Line2D(
            [], [], color=MUTED, linewidth=2.2, linestyle=(0, (2.2, 1.2)), label="while the link was down"
        ),
        _mark("o", "start", face="white"),
        _mark("s", "end", face=MUTED),
        _mark("D", "exploration's core replaced", face=_SWAP, edge=INK),
    ]
    if any(len(evidence.goals) for evidence, _ in robots):
        handles.append(_mark("+", "goal", face=MUTED))
    handles += [
        Patch(facecolor=_UNEXPLORED, edgecolor="none", label="not explored"),
        Patch(facecolor=_WALL, edgecolor="none", label="wall, seen"),
        Patch(facecolor=_WALL_UNSEEN, edgecolor="none", label="wall, not seen"),
    ]
    return handles


def _mark(marker: str, label: str, *, face: str, edge: str = MUTED) -> Line2D:
    return Line2D(
        [],
        [],
        linestyle="none",
        marker=marker,
        markersize=7,
        markerfacecolor=face,
        markeredgecolor=edge,
        label=label,
    )
