"""The mission's maps: reading them, placing robots, and what these can reach. Lengths in m, angles in rad."""

from collections.abc import Sequence
from typing import final

import numpy as np
import numpy.typing as npt

class MapError(ValueError):
    """A map that cannot be used. str() is one line: what, where, expected, found, remedy."""

@final
class GridMap:
    """A map as the ROS map server reads it, turned upright."""

    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def resolution_m(self) -> float: ...
    @property
    def origin_x_m(self) -> float: ...
    @property
    def origin_y_m(self) -> float: ...
    @property
    def cells(self) -> npt.NDArray[np.int8]:
        """A read-only view, (height, width), row 0 has the lowest y: -1 unknown, 0 free, to 100 occupied."""

def load_map(path: str) -> GridMap:
    """Read the YAML file of a map and the image it names.

    Raises:
        MapError: a file is missing, truncated or of another format, or says what is not supported.
    """

def start_poses(grid: GridMap, n: int, seed: int) -> list[tuple[float, float, float]]:
    """(x, y, yaw) of n robots near one another in the largest region a robot can move in.

    Equal maps and seeds give equal poses on every machine.

    Raises:
        MapError: there is no room for so many.
    """

def reachable_mask(
    grid: GridMap, starts: Sequence[tuple[float, float, float]], radius_m: float
) -> npt.NDArray[np.bool_]:
    """(height, width): where the centre of a disc of the radius can get to from one of the starts."""
