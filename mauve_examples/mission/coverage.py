"""Coverage: the share of the reachable free cells that the robots' maps know."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_examples.mission.facts import BoolGrid, MissionArea

TILE_CELLS = 16
UNKNOWN = -1


class _Geometry(NamedTuple):
    """A robot's map: where its cells lie. Robots may map on a grid other than the true map's."""

    resolution_m: float
    origin_x_m: float
    origin_y_m: float
    columns: int
    """In tiles."""
    rows: int


class CoverageTracker:
    """Follows mauve_msgs/msg/MapUpdate messages of several robots, live or from a bag. For one thread."""

    def __init__(self, area: MissionArea, robots: Iterable[str]) -> None:
        """Start with nothing explored.

        Args:
            area: the true map and what of it counts.
            robots: their names.
        """
        self._area = area
        self._maps = {robot: _RobotMap(area) for robot in robots}
        self._reachable_cells = max(1, int(np.count_nonzero(area.reachable)))

    def update(self, robot: str, message: Any) -> None:
        """Take in one MapUpdate of a robot (a message of rclpy or of rosbags).

        Raises:
            KeyError: the robot is not one of the tracker's.
        """
        self._maps[robot].update(message)

    def explored(self, robot: str) -> BoolGrid:
        """Cells of the true map's grid that this robot knows; (height, width), not only reachable ones."""
        return self._maps[robot].explored()

    def explored_by_any(self) -> BoolGrid:
        """Cells of the true map's grid that at least one robot knows."""
        known = np.zeros_like(self._area.reachable)
        for one in self._maps.values():
            known |= one.explored()
        return known

    def shares(self) -> dict[str, float]:
        """Explored share of the reachable cells per robot, 0 to 1."""
        return {robot: self._share(one.explored()) for robot, one in self._maps.items()}

    def union(self) -> float:
        """Explored share of all robots together, 0 to 1."""
        return self._share(self.explored_by_any())

    def _share(self, known: BoolGrid) -> float:
        return float(np.count_nonzero(known & self._area.reachable)) / self._reachable_cells


class _RobotMap:
    """What one robot knows, on its own grid, and how that lies on the true map's."""

    def __init__(self, area: MissionArea) -> None:
        self._area = area
        self._geometry: _Geometry | None = None
        self._known: BoolGrid = np.zeros((0, 0), np.bool_)
        self._row_of = self._column_of = np.zeros(0, np.intp)
        self._explored: BoolGrid | None = np.zeros_like(area.reachable)
        self._is_true_grid = False

    def update(self, message: Any) -> None:
        geometry = _Geometry(
            message.resolution, message.origin_x, message.origin_y, message.columns, message.rows
        )
        if geometry != self._geometry:
            self._take_geometry(geometry)
        for tile in message.tiles:
            row, column = tile.row * TILE_CELLS, tile.column * TILE_CELLS
            if row < self._known.shape[0] and column < self._known.shape[1]:
                cells = np.asarray(tile.cells, np.int8).reshape(TILE_CELLS, TILE_CELLS)
                self._known[row : row + TILE_CELLS, column : column + TILE_CELLS] = cells != UNKNOWN
        self._explored = None

    def explored(self) -> BoolGrid:
        if self._explored is None and self._is_true_grid:
            height, width = self._area.cells.shape
            self._explored = self._known[:height, :width].copy()
        elif self._explored is None:
            inside = (self._row_of >= 0)[:, None] & (self._column_of >= 0)[None, :]
            self._explored = self._known[np.ix_(self._row_of, self._column_of)] & inside
        return self._explored

    def _take_geometry(self, geometry: _Geometry) -> None:
        height, width = self._area.cells.shape
        rows, columns = geometry.rows * TILE_CELLS, geometry.columns * TILE_CELLS
        scale = self._area.resolution_m / geometry.resolution_m
        shift_x = (self._area.origin_x_m - geometry.origin_x_m) / geometry.resolution_m
        shift_y = (self._area.origin_y_m - geometry.origin_y_m) / geometry.resolution_m
        self._geometry = geometry
        self._known = np.zeros((max(rows, 1), max(columns, 1)), np.bool_)
        self._row_of = _cell_of(np.arange(height), scale=scale, shift=shift_y, count=rows)
        self._column_of = _cell_of(np.arange(width), scale=scale, shift=shift_x, count=columns)
        self._is_true_grid = bool(
            np.array_equal(self._row_of, np.arange(height))
            and np.array_equal(self._column_of, np.arange(width))
        )


def _cell_of(index: npt.NDArray[np.intp], *, scale: float, shift: float, count: int) -> npt.NDArray[np.intp]:
    """Of each true cell's centre: index of the robot's cell it lies in; -1 outside the robot's map."""
    found = np.floor((index + 0.5) * scale + shift).astype(np.intp)
    return np.where((found >= 0) & (found < count), found, -1)
