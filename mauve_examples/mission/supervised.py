"""What supervisors would have changed: a mission without them beside the same one with them, simulated."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mauve_examples.mission.evidence import CoverageHistory, RobotEvidence
from mauve_examples.mission.facts import MissionFacts

WHOLE = 0.995  # a share of the map above which there may be nothing left to find
_STANDS_MPS = 0.05
_WINDOW_S = 0.5


@dataclass(frozen=True)
class Supervised:
    """The same mission with supervisors: same map, seed and times, in simulated time."""

    facts: MissionFacts
    coverage: CoverageHistory


def compare(
    facts: MissionFacts, coverage: CoverageHistory, evidence: list[RobotEvidence], supervised: Supervised
) -> dict[str, Any]:
    """Return the entry of summary.json. Shares from 0 to 1, times in s of mission time."""
    begin_s, end_s = _link_down_s(facts)
    with_begin_s, with_end_s = _link_down_s(supervised.facts)
    return {
        "without": "measured" if facts.simulation is None else "simulated",
        "with": "simulated",
        "link_down_s": end_s - begin_s,
        "explored_while_down": {
            "without": coverage.union_at(end_s) - coverage.union_at(begin_s),
            "with": supervised.coverage.union_at(with_end_s) - supervised.coverage.union_at(with_begin_s),
        },
        "explored_at_return": {
            "without": coverage.union_at(end_s),
            "with": supervised.coverage.union_at(with_end_s),
        },
        "whole_at_s": {"without": _whole_at_s(coverage), "with": _whole_at_s(supervised.coverage)},
        "stood_still_s": {one.robot: _stood_still_s(one, begin_s, end_s) for one in evidence},
    }


def compared_in_words(found: dict[str, Any]) -> list[str]:
    """Return what supervisors would have saved, sentence by sentence."""
    down_s, gained, at_return = (
        found["link_down_s"],
        found["explored_while_down"],
        found["explored_at_return"],
    )
    stood = ", ".join(f"{robot} for {stood_s:.0f} s" for robot, stood_s in found["stood_still_s"].items())
    without = (
        f"In the {down_s:.0f} s without the link the robots stood still, {stood}, and explored "
        f"{gained['without']:+.0%} ({found['without']})."
    )
    supervised = (
        f"With supervisors, same map and seed, they would have explored {gained['with']:+.0%} meanwhile "
        f"({found['with']}): {at_return['with']:.0%} instead of {at_return['without']:.0%} when it was back."
    )
    lines = [without, supervised]
    ends = {
        which: "never" if at_s is None else f"at {at_s:.0f} s" for which, at_s in found["whole_at_s"].items()
    }
    if found["whole_at_s"]["with"] is not None:
        lines.append(f"All explored: {ends['with']} with supervisors, {ends['without']} without.")
    return lines


def _link_down_s(facts: MissionFacts) -> tuple[float, float]:
    """When the link was first lost, and when it was back for good."""
    return facts.seconds(facts.link_down_ns[0][0]), facts.seconds(facts.link_down_ns[-1][1])


def _whole_at_s(coverage: CoverageHistory) -> float | None:
    whole = np.flatnonzero(coverage.union >= WHOLE)
    return float(coverage.time_s[whole[0]]) if len(whole) else None


def _stood_still_s(one: RobotEvidence, begin_s: float, end_s: float) -> float:
    """For how much of an interval the robot hardly moved."""
    if not len(one.track):
        return 0.0
    time_s = np.arange(begin_s, end_s + _WINDOW_S / 2, _WINDOW_S)
    x, y = (np.interp(time_s, one.track[:, 0], one.track[:, axis]) for axis in (1, 2))
    moved_m = np.hypot(np.diff(x), np.diff(y))
    return float(np.count_nonzero(moved_m < _STANDS_MPS * _WINDOW_S)) * _WINDOW_S
