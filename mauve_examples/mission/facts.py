"""What the demo knows about a mission that its bags do not tell."""

from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt

Pose = tuple[float, float, float]
"""x, y in m, yaw in rad"""
BoolGrid = npt.NDArray[np.bool_]


class ComponentFacts(TypedDict):
    """How a component's thread was scheduled, as read back from it (ListComponents)."""

    policy: str
    priority: int
    cpus: list[int]


class RealtimeFacts(TypedDict):
    """What the executors were granted (RealtimeStatus)."""

    granted: bool
    missing: list[str]


class SimulationFacts(TypedDict):
    """How fast a mission in simulated time ran, and how long."""

    virtual_s: float
    wall_s: float
    speed_up: float


@dataclass(frozen=True, kw_only=True)
class MissionFacts:
    """One mission, as its driver saw it. Times in ns of CLOCK_MONOTONIC, or of simulated time."""

    map_path: Path
    """The map server's YAML file."""
    radius_m: float
    starts: dict[str, Pose]
    """Per robot, in the order in which robots are shown."""
    started_ns: int
    ended_ns: int
    link_down_ns: list[tuple[int, int]] = field(default_factory=list)
    """When the link really was down; an interval open at the end ends with the mission."""
    link_loss_s: float | None = None
    """Planned, in seconds of mission time."""
    link_back_s: float | None = None
    supervisor: bool = True
    expected_swaps: bool = True
    """Each robot should have swapped its exploration at the loss and swapped back after the link's return."""
    components: dict[str, dict[str, ComponentFacts]] = field(default_factory=dict)
    """Per robot and component."""
    realtime: RealtimeFacts = field(default_factory=lambda: RealtimeFacts(granted=False, missing=[]))
    faults: list[str] = field(default_factory=list)
    """What went wrong, one line each; empty when nothing did."""
    simulation: SimulationFacts | None = None
    """None: it ran in real time."""

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots."""
        return tuple(self.starts)

    def seconds(self, monotonic_ns: int) -> float:
        """Mission time."""
        return (monotonic_ns - self.started_ns) * 1e-9

    def link_was_down(self, monotonic_ns: int) -> bool:
        """Whether the link was down at a time."""
        return any(begin <= monotonic_ns < end for begin, end in self.link_down_ns)


@dataclass(frozen=True, kw_only=True)
class MissionArea:
    """The true map, and what of it can be explored. Grids are (height, width), row 0 has the lowest y."""

    cells: npt.NDArray[np.int8]
    """-1 unknown, 0 free, 100 occupied"""
    reachable: BoolGrid
    """Free cells that a robot can stand on: what coverage is measured against."""
    resolution_m: float
    origin_x_m: float
    origin_y_m: float

    @property
    def extent_m(self) -> tuple[float, float, float, float]:
        """Left, right, bottom, top."""
        height, width = self.cells.shape
        right = self.origin_x_m + width * self.resolution_m
        return (self.origin_x_m, right, self.origin_y_m, self.origin_y_m + height * self.resolution_m)


def load_area(facts: MissionFacts) -> MissionArea:
    """Read the map again, with the mission's own reader."""
    native: Any = import_module("mauve_examples._mission")  # only here: drawing needs none of it
    grid = native.load_map(str(facts.map_path))
    reachable = native.reachable_mask(grid, list(facts.starts.values()), facts.radius_m)
    height, width = np.shape(grid.cells)
    return MissionArea(
        cells=np.asarray(grid.cells, np.int8),
        reachable=np.asarray(reachable, np.bool_).reshape(height, width),
        resolution_m=grid.resolution_m,
        origin_x_m=grid.origin_x_m,
        origin_y_m=grid.origin_y_m,
    )
