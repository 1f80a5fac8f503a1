"""Whether a mission says that its robots ran into each other."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from mauve_examples.mission import summary
from mauve_examples.mission.collisions import find_encounters
from mauve_examples.mission.evidence import RobotEvidence
from mauve_examples.mission.facts import MissionFacts

FACTS = MissionFacts(map_path=Path("office.yaml"), radius_m=0.2, starts={}, started_ns=0, ended_ns=0)
NOTHING: Any = None


def driving(robot: str, rows: list[tuple[float, float, float]]) -> RobotEvidence:
    """A robot that was at these places: time in s, x, y in m."""
    track = np.array(rows, np.float64).reshape(-1, 3)
    return RobotEvidence(
        robot=robot,
        trace=NOTHING,
        track=track,
        goals=np.zeros((0, 3)),
        map_updates=[],
        events=[],
        decisions=[],
    )


def test_two_robots_that_drive_through_each_other_collide_once():
    one = driving("robot_1", [(0.0, 0.0, 0.0), (10.0, 10.0, 0.0)])
    other = driving("robot_2", [(0.0, 10.0, 0.1), (10.0, 0.0, 0.1)])
    found = find_encounters(FACTS, [one, other])
    (collision,) = found.collisions
    assert collision.robots == ("robot_1", "robot_2")
    apart_m = np.sqrt(0.4**2 - 0.1**2)  # along their way, when they touch
    assert collision.at_s == pytest.approx(5.0 - apart_m / 2, abs=0.011)
    assert collision.duration_s == pytest.approx(apart_m, abs=0.011)
    assert collision.nearest_m == pytest.approx(0.1, abs=0.001)
    assert found.as_json()["events"] == 1
    assert cast("float", found.as_json()["pair_seconds"]) == pytest.approx(apart_m, abs=0.011)
    assert "robot_1 and robot_2 collided at 4.8 s" in str(collision)


def test_every_pair_and_every_meeting_counts():
    there_and_back = [(0.0, 0.0, 0.0), (5.0, 5.0, 0.0), (10.0, 0.0, 0.0)]
    stands = [(0.0, 3.0, 0.0), (10.0, 3.0, 0.0)]
    beside = [(0.0, 3.0, 0.3), (10.0, 3.0, 0.3)]
    robots = [driving("a", there_and_back), driving("b", stands), driving("c", beside)]
    found = find_encounters(FACTS, robots)
    pairs = [one.robots for one in found.collisions]
    assert sorted(pairs) == [("a", "b"), ("a", "b"), ("a", "c"), ("a", "c"), ("b", "c")]
    assert [one.at_s for one in found.collisions] == sorted(one.at_s for one in found.collisions)


def test_robots_that_keep_apart_do_not():
    one = driving("robot_1", [(0.0, 0.0, 0.0), (10.0, 10.0, 0.0)])
    other = driving("robot_2", [(0.0, 10.0, 0.41), (10.0, 0.0, 0.41)])
    found = find_encounters(FACTS, [one, other])
    assert found.as_json() == {"events": 0, "pair_seconds": 0, "nearest_m": 0.41}


def test_one_robot_or_one_that_was_never_seen_meets_nobody():
    one = driving("robot_1", [(0.0, 0.0, 0.0), (10.0, 10.0, 0.0)])
    assert find_encounters(FACTS, [one]).nearest_m is None
    assert find_encounters(FACTS, [one, driving("robot_2", [])]).nearest_m is None


def test_a_collision_fails_the_mission(monkeypatch: pytest.MonkeyPatch):
    for name, found in (("find_swaps", []), ("failure_reasons", []), ("_robot", {}), ("_warnings", [])):
        monkeypatch.setattr(summary, name, lambda *_rest, found=found: found)
    one = driving("robot_1", [(0.0, 0.0, 0.0), (10.0, 10.0, 0.0)])
    other = driving("robot_2", [(0.0, 10.0, 0.1), (10.0, 0.0, 0.1)])
    history: Any = SimpleNamespace(robots={}, union=[])
    facts = replace(FACTS, realtime={"granted": True, "missing": []})
    told = summary.build_summary(facts, [one, other], history)
    assert not told["success"]
    assert "robot_1 and robot_2 collided" in told["reasons"][0]
    assert told["collisions"]["events"] == 1
