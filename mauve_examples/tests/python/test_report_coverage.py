"""Coverage from map updates: any grid, any order of tiles, nothing counted twice."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mauve_examples.mission.coverage import TILE_CELLS, CoverageTracker
from mauve_examples.mission.facts import MissionArea

SIDE = 40
REACHABLE = np.zeros((SIDE, SIDE), np.bool_)
REACHABLE[4:36, 4:36] = True
AREA = MissionArea(
    cells=np.zeros((SIDE, SIDE), np.int8),
    reachable=REACHABLE,
    resolution_m=0.1,
    origin_x_m=-2.0,
    origin_y_m=-1.0,
)


def update(known: Any, *, resolution: float = 0.1, origin: tuple[float, float] = (-2.0, -1.0)) -> Any:
    """A MapUpdate with every tile of a grid; unknown where `known` is False."""
    rows, columns = (-(-size // TILE_CELLS) for size in known.shape)
    padded = np.full((rows * TILE_CELLS, columns * TILE_CELLS), -1, np.int8)
    padded[: known.shape[0], : known.shape[1]] = np.where(known, 0, -1)
    tiles = [
        SimpleNamespace(
            row=row,
            column=column,
            cells=padded[
                row * TILE_CELLS : (row + 1) * TILE_CELLS, column * TILE_CELLS : (column + 1) * TILE_CELLS
            ].reshape(-1),
        )
        for row in range(rows)
        for column in range(columns)
    ]
    return SimpleNamespace(
        resolution=resolution, origin_x=origin[0], origin_y=origin[1], columns=columns, rows=rows, tiles=tiles
    )


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_shares_are_those_of_the_reachable_cells(seed: int, other: int):
    known = [np.random.default_rng(one).random((SIDE, SIDE)) < 0.5 for one in (seed, other)]
    tracker = CoverageTracker(AREA, ["a", "b"])
    for robot, grid in zip("ab", known, strict=True):
        tracker.update(robot, update(grid))
        assert (tracker.explored(robot) == grid).all()
    total = REACHABLE.sum()
    shares = {robot: (grid & REACHABLE).sum() / total for robot, grid in zip("ab", known, strict=True)}
    assert tracker.shares() == pytest.approx(shares)
    assert tracker.union() == pytest.approx(((known[0] | known[1]) & REACHABLE).sum() / total)


def test_nothing_is_explored_before_the_first_update():
    tracker = CoverageTracker(AREA, ["a"])
    assert tracker.shares() == {"a": 0.0}
    assert tracker.union() == 0.0
    assert not tracker.explored("a").any()


def test_a_tile_may_change_again():
    tracker = CoverageTracker(AREA, ["a"])
    everything = np.ones((SIDE, SIDE), np.bool_)
    tracker.update("a", update(everything))
    assert tracker.union() == 1.0
    message = update(~everything)
    message.tiles = message.tiles[4:5]
    tracker.update("a", message)
    expected = everything.copy()
    expected[16:32, 16:32] = False
    assert (tracker.explored("a") == expected).all()


@pytest.mark.parametrize(
    ("resolution", "origin", "size"),
    [(0.05, (-2.0, -1.0), 80), (0.2, (-2.0, -1.0), 20), (0.1, (-3.0, -1.5), 60)],
)
def test_robots_may_map_on_grids_of_their_own(resolution: float, origin: tuple[float, float], size: int):
    tracker = CoverageTracker(AREA, ["a"])
    centres = origin[0] + (np.arange(size) + 0.5) * resolution
    known = np.broadcast_to(centres < 0.0, (size, size))  # the left half of the area
    tracker.update("a", update(known, resolution=resolution, origin=origin))
    assert tracker.explored("a")[:, :20].all()
    assert not tracker.explored("a")[:, 20:].any()


def test_what_lies_outside_the_robots_map_is_unknown():
    tracker = CoverageTracker(AREA, ["a"])
    tracker.update("a", update(np.ones((16, 16), np.bool_), origin=(-1.0, 0.0)))
    expected = np.zeros((SIDE, SIDE), np.bool_)
    expected[10:26, 10:26] = True
    assert (tracker.explored("a") == expected).all()


def test_an_unknown_robot_is_refused():
    with pytest.raises(KeyError):
        CoverageTracker(AREA, ["a"]).update("b", update(np.ones((16, 16), np.bool_)))
