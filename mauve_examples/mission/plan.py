"""A small map of what each robot knows, for a terminal."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from rich.style import Style
from rich.text import Text

from mauve_examples.mission.facts import BoolGrid

MOST_COLUMNS, MOST_ROWS = 72, 28
"""In pixels: a character has two, one above the other."""
UNKNOWN, WALL, SHARED = "grey19", "grey70", "green4"
_COLOURS = ("dodger_blue2", "orange3", "magenta3", "yellow4", "cyan3", "red3", "purple", "deep_pink4")
_WALL_FROM = 3  # a pixel is one, where a third of what is known of it is


def colour(robot: int) -> str:
    """Of a robot by its place; of more than eight robots some share one."""
    return _COLOURS[robot % len(_COLOURS)]


@dataclass(frozen=True)
class Plan:
    """The true map, and which of its cells each robot knows. Grids: (height, width), the lowest y first."""

    cells: npt.NDArray[np.int8]
    """-1 unknown, 0 free, 1 to 100 how occupied: a wall to the robots"""
    known: Mapping[str, BoolGrid]

    def drawn(self) -> Text:
        """What only one robot knows is in its colour, what several know in a colour of its own."""
        pixels = self._pixels()
        if len(pixels) % 2:
            pixels = np.vstack([pixels, np.full((1, pixels.shape[1]), UNKNOWN)])
        text = Text()
        for upper, lower in zip(pixels[::2], pixels[1::2], strict=True):
            for above, below in zip(upper, lower, strict=True):
                text.append("\N{UPPER HALF BLOCK}", Style(color=str(above), bgcolor=str(below)))
            text.append("\n")
        return text

    def _pixels(self) -> npt.NDArray[np.str_]:
        """The names of their colours; row 0 is the top."""
        mapped = _extent(self.cells >= 0)
        cells = self.cells[mapped]
        height, width = cells.shape
        size = max(1, -(-width // MOST_COLUMNS), -(-height // MOST_ROWS))
        known = np.array([_counts(each[mapped], size) for each in self.known.values()])
        anyhow = np.any([each[mapped] for each in self.known.values()], axis=0)
        walls = _counts(anyhow & (cells > 0), size)
        found = np.full(walls.shape, UNKNOWN, "<U20")
        for index, count in enumerate(known):
            found[count > 0] = colour(index)
        found[np.count_nonzero(known, axis=0) > 1] = SHARED
        found[(walls > 0) & (_WALL_FROM * walls >= _counts(anyhow, size))] = WALL
        return found[::-1]


def _extent(grid: BoolGrid) -> tuple[slice, slice]:
    """The smallest part of a grid that has all that is set."""
    rows, columns = (np.flatnonzero(grid.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return slice(None), slice(None)
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def _counts(grid: BoolGrid, size: int) -> npt.NDArray[np.intp]:
    """How many cells are set, of each square of so many cells a side."""
    height, width = grid.shape
    padded = np.pad(grid, ((0, -height % size), (0, -width % size)))
    squares = padded.reshape(-(-height // size), size, -(-width // size), size)
    return np.asarray(np.count_nonzero(squares, axis=(1, 3)), np.intp)
