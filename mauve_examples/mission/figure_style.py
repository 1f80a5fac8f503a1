"""How the figures of a mission look. They are drawn without pyplot: no global state, no display."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mauve_examples.mission.swaps import EXPLORATION, Swap

INK = "#263238"
MUTED = "#78909c"
GRID = "#e4e9ec"
LINK_DOWN = "#f3d9d3"
LINK_DOWN_INK = "#b3432b"
UNION = "#37474f"
ROBOTS = ("#1f6fb4", "#d9771f", "#2f8f5b", "#8a55b5", "#b8860b", "#c0417a")
DPI = 150


def robot_colour(index: int) -> str:
    """Colour of a robot by its place in the list."""
    return ROBOTS[index % len(ROBOTS)]


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty white figure."""
    return Figure(figsize=(width_in, height_in), dpi=DPI, layout="constrained", facecolor="white")


def tidy(axes: Axes, *, grid: str = "") -> None:
    """Leave only what helps reading; `grid` is the axis with grid lines, x or y."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(MUTED)
    axes.tick_params(colors=INK, labelsize=9, length=3)
    if grid == "x":
        axes.grid(axis="x", color=GRID, linewidth=0.8)
    elif grid == "y":
        axes.grid(axis="y", color=GRID, linewidth=0.8)
    axes.set_axisbelow(True)


def title(axes: Axes, text: str, explained: str = "") -> None:
    """Put a bold title, and below it one line in small print, at the left above the axes."""
    axes.annotate(
        text,
        (0, 1),
        xytext=(0, 24 if explained else 9),
        xycoords="axes fraction",
        textcoords="offset points",
        fontsize=12.5,
        fontweight="bold",
        color=INK,
    )
    if explained:
        axes.annotate(
            explained,
            (0, 1),
            xytext=(0, 9),
            xycoords="axes fraction",
            textcoords="offset points",
            fontsize=9,
            color=MUTED,
        )


def save(figure: Figure, path: Path) -> None:
    """Write a PNG."""
    metadata: dict[str, Any] = {"Software": None}  # equal missions give equal bytes
    figure.savefig(path, format="png", dpi=DPI, metadata=metadata, bbox_inches="tight", pad_inches=0.12)


def short(name: str | None) -> str:
    """Name of a core without its package."""
    return "another core" if name is None else name.rsplit("/", 1)[-1]


def core_changes(swaps: Iterable[Swap]) -> list[Swap]:
    """Return the swaps that replaced the core of the exploration, by time."""
    return [swap for swap in swaps if swap.measured.component == EXPLORATION and swap.to_core is not None]
