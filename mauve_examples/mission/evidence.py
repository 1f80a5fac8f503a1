"""What the bag of a robot tells about a mission."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mauve_examples.mission.coverage import CoverageTracker
from mauve_examples.mission.facts import BoolGrid, MissionArea, MissionFacts
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.trace import Trace

COVERAGE_PERIOD_NS = 250_000_000

Timed = list[tuple[int, Any]]
"""(ns of CLOCK_MONOTONIC, message), by time."""

DECISIONS = ("executor/decisions", "supervisor/decisions")


@dataclass(frozen=True, kw_only=True)
class RobotEvidence:
    """One robot's bag."""

    robot: str
    trace: Trace
    track: npt.NDArray[np.float64]
    """(n, 3): mission time in s, x, y in m."""
    goals: npt.NDArray[np.float64]
    """(n, 3): the same of the goals it took, when the bag has them."""
    map_updates: Timed = field(repr=False)
    events: Timed = field(repr=False)
    decisions: Timed = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class CoverageHistory:
    """Coverage over time; shares from 0 to 1."""

    time_s: npt.NDArray[np.float64]
    """Mission time, (n,)."""
    robots: dict[str, npt.NDArray[np.float64]]
    union: npt.NDArray[np.float64]
    explored: dict[str, BoolGrid]
    """Per robot at the end."""
    first: npt.NDArray[np.intp]
    """Of each cell: index of the robot that knew it first, -1 when none did."""

    def union_at(self, time_s: float) -> float:
        """Coverage of all robots together at a mission time; 0 before the first update."""
        index = int(np.searchsorted(self.time_s, time_s, side="right")) - 1
        return float(self.union[index]) if index >= 0 else 0.0


def read_robot(directory: Path, robot: str, facts: MissionFacts) -> RobotEvidence:
    """Read `directory`, the bag of a robot.

    Raises:
        TraceError: it is no bag, or cannot be read.
    """
    trace = open_trace(directory)
    topics = {
        name: f"/{robot}/{name}" for name in ("pose", "goal", "map_updates", "executor/events", *DECISIONS)
    }
    found: dict[str, Timed] = {topic: [] for topic in topics.values()}
    for message in trace.messages(*topics.values()):
        found[message.topic].append((message.monotonic_ns, message.msg))
    return RobotEvidence(
        robot=robot,
        trace=trace,
        track=_places(found[topics["pose"]], facts),
        goals=_places(found[topics["goal"]], facts),
        map_updates=found[topics["map_updates"]],
        events=found[topics["executor/events"]],
        decisions=sorted((one for name in DECISIONS for one in found[topics[name]]), key=lambda one: one[0]),
    )


def replay_coverage(
    facts: MissionFacts, area: MissionArea, robots: Iterable[RobotEvidence]
) -> CoverageHistory:
    """Replay the map updates of all robots, sampling coverage every 250 ms."""
    evidence = list(robots)
    names = [one.robot for one in evidence]
    tracker = CoverageTracker(area, names)
    first = np.full(area.cells.shape, -1, np.intp)
    rows: list[tuple[float, float, list[float]]] = []
    for until_ns, batch in _sampled(facts, evidence):
        for robot, message in batch:
            tracker.update(robot, message)
        for index, robot in enumerate(names):
            first[(first < 0) & tracker.explored(robot)] = index
        shares = tracker.shares()
        rows.append((facts.seconds(until_ns), tracker.union(), [shares[name] for name in names]))
    per_robot = np.array([row[2] for row in rows]).reshape(len(rows), len(names))
    return CoverageHistory(
        time_s=np.array([row[0] for row in rows]),
        union=np.array([row[1] for row in rows]),
        robots={name: per_robot[:, index] for index, name in enumerate(names)},
        explored={name: tracker.explored(name) for name in names},
        first=first,
    )


def _sampled(
    facts: MissionFacts, evidence: list[RobotEvidence]
) -> Iterator[tuple[int, list[tuple[str, Any]]]]:
    """End of each sampling interval, and the updates that arrived in it."""
    updates = [(time_ns, one.robot, message) for one in evidence for time_ns, message in one.map_updates]
    updates.sort(key=lambda update: update[0])
    at = 0
    last_ns = max([facts.ended_ns, *(time_ns for time_ns, _, _ in updates[-1:])])
    for until_ns in range(facts.started_ns, last_ns + COVERAGE_PERIOD_NS, COVERAGE_PERIOD_NS):
        begin = at
        while at < len(updates) and updates[at][0] <= until_ns:
            at += 1
        yield min(until_ns, last_ns), [(robot, message) for _, robot, message in updates[begin:at]]


def _places(messages: Timed, facts: MissionFacts) -> npt.NDArray[np.float64]:
    rows = [(facts.seconds(time_ns), message.x, message.y) for time_ns, message in messages]
    return np.array(rows, np.float64).reshape(-1, 3)
