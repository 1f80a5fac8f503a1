"""Whether robots ran into each other, by where each of them was."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from mauve_examples.mission.evidence import RobotEvidence
from mauve_examples.mission.facts import MissionFacts

SAMPLE_S = 0.01  # the robots' period


@dataclass(frozen=True, kw_only=True)
class Collision:
    """Two robots whose bodies overlapped for a while. Times in s of mission time."""

    robots: tuple[str, str]
    at_s: float
    duration_s: float
    nearest_m: float
    """Least distance of their centres."""

    def __str__(self) -> str:
        """What happened, in words."""
        first, second = self.robots
        how_near = f"their centres came as near as {self.nearest_m:.2f} m"
        return f"{first} and {second} collided at {self.at_s:.1f} s for {self.duration_s:.2f} s: {how_near}"


@dataclass(frozen=True, kw_only=True)
class Encounters:
    """How near the robots of a mission came to each other."""

    collisions: tuple[Collision, ...]
    """By time."""
    nearest_m: float | None
    """Least distance there ever was between two centres; None: they were never seen at one time."""

    def as_json(self) -> dict[str, Any]:
        """Return the entry of summary.json."""
        return {
            "events": len(self.collisions),
            "pair_seconds": round(sum(one.duration_s for one in self.collisions), 3),
            "nearest_m": None if self.nearest_m is None else round(self.nearest_m, 3),
        }


def find_encounters(facts: MissionFacts, evidence: Sequence[RobotEvidence]) -> Encounters:
    """Compare the robots' recorded ways, pair by pair; nearer than two radii they collide."""
    collisions: list[Collision] = []
    nearest_m: float | None = None
    for one, other in combinations(evidence, 2):
        time_s, apart_m = _apart(one.track, other.track)
        if not len(time_s):
            continue
        least_m = float(apart_m.min())
        nearest_m = least_m if nearest_m is None else min(nearest_m, least_m)
        touching = np.concatenate([[False], apart_m < 2 * facts.radius_m, [False]])
        edges = np.flatnonzero(np.diff(touching.astype(np.int8)))
        for begin, end in edges.reshape(-1, 2):
            collisions.append(
                Collision(
                    robots=(one.robot, other.robot),
                    at_s=float(time_s[begin]),
                    duration_s=float(end - begin) * SAMPLE_S,
                    nearest_m=float(apart_m[begin:end].min()),
                )
            )
    by_time = tuple(sorted(collisions, key=lambda collision: collision.at_s))
    return Encounters(collisions=by_time, nearest_m=nearest_m)


def _apart(
    one: npt.NDArray[np.float64], other: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return instants at which both are known, and the distance of their centres then."""
    if not len(one) or not len(other):
        return np.zeros(0), np.zeros(0)
    begin_s, end_s = max(one[0, 0], other[0, 0]), min(one[-1, 0], other[-1, 0])
    time_s = np.arange(begin_s, end_s + SAMPLE_S / 2, SAMPLE_S)
    x, y = (
        np.interp(time_s, one[:, 0], one[:, axis]) - np.interp(time_s, other[:, 0], other[:, axis])
        for axis in (1, 2)
    )
    return time_s, np.hypot(x, y)
