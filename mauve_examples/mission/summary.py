"""summary.json: the outcome of a mission for programs."""

import json
from pathlib import Path
from typing import Any

from mauve_examples.mission.collisions import find_encounters
from mauve_examples.mission.evidence import CoverageHistory, RobotEvidence
from mauve_examples.mission.facts import MissionFacts
from mauve_examples.mission.swaps import Swap, find_swaps, swap_problems
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.statistics import ComponentStatistics, all_statistics

SUMMARY = "summary.json"
_WHOLE = 0.995  # a share of the map above which the robots may find nothing new
_NOT_DEPLOYED: dict[str, Any] = {"policy": "", "priority": 0, "cpus": []}


def build_summary(
    facts: MissionFacts, evidence: list[RobotEvidence], coverage: CoverageHistory
) -> dict[str, Any]:
    """Return the summary. "reasons" says why success is false, "warnings" what makes figures doubtful."""
    swaps = {one.robot: find_swaps(one) for one in evidence}
    encounters = find_encounters(facts, evidence)
    reasons = failure_reasons(facts, evidence, coverage, swaps)
    reasons += [str(collision) for collision in encounters.collisions]
    shares = dict.fromkeys(facts.robots, 0.0)
    shares |= {robot: float(values[-1]) for robot, values in coverage.robots.items() if len(values)}
    union = float(coverage.union[-1]) if len(coverage.union) else 0.0
    robots: dict[str, Any] = {robot: {"reconfigurations": [], "components": {}} for robot in facts.robots}
    robots |= {one.robot: _robot(facts, one, swaps[one.robot]) for one in evidence}
    return {
        "success": not reasons,
        "reasons": reasons,
        "warnings": _warnings(evidence, swaps),
        "coverage": {**shares, "union": union},
        "collisions": encounters.as_json(),
        "robots": robots,
        "realtime": {"granted": facts.realtime["granted"], "missing": list(facts.realtime["missing"])},
        "supervisors_saved": None,
        "simulation": None if facts.simulation is None else dict(facts.simulation),
    }


def write_summary(path: Path, summary: dict[str, Any]) -> None:
    """Write the summary as JSON, whole or not at all."""
    temporary = path.with_suffix(".tmp")
    temporary.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    temporary.replace(path)


def failure_reasons(
    facts: MissionFacts,
    evidence: list[RobotEvidence],
    coverage: CoverageHistory,
    swaps: dict[str, list[Swap]],
) -> list[str]:
    """Say why it failed: a fault, a planned swap that did not happen, no progress without the link."""
    reasons = list(facts.faults)
    for one in evidence:
        for component in one.trace.components:
            faults = one.trace.of(component, Kind.FAULT)
            states = [one.trace.name(int(name)) for name in faults["name"]]
            reasons += [f"{one.robot}: {component} faulted in state {state}" for state in states]
    if facts.expected_swaps and not facts.link_down_ns:
        reasons.append("the link was never lost, so the planned swaps could not happen")
    elif facts.expected_swaps:
        for robot, found in swaps.items():
            reasons += swap_problems(facts, robot, found)
    if _something_left(facts, coverage) and union_growth(facts, coverage) <= 0.0:
        reasons.append("the robots together explored nothing while the link was down")
    return reasons


def _something_left(facts: MissionFacts, coverage: CoverageHistory) -> bool:
    """Whether the map was not yet whole when the link was first lost."""
    return bool(facts.link_down_ns) and coverage.union_at(facts.seconds(facts.link_down_ns[0][0])) < _WHOLE


def union_growth(facts: MissionFacts, coverage: CoverageHistory) -> float:
    """Return by how much the union coverage grew while the link was down, 0 to 1."""
    return sum(
        coverage.union_at(facts.seconds(end)) - coverage.union_at(facts.seconds(begin))
        for begin, end in facts.link_down_ns
    )


def _warnings(evidence: list[RobotEvidence], swaps: dict[str, list[Swap]]) -> list[str]:
    warnings = []
    for one in evidence:
        for component, loss in one.trace.losses.items():
            if loss.lost:
                lost = f"{loss.lost} of {loss.written} trace records were lost"
                warnings.append(f"{one.robot}/{component}: {lost}; its counts are lower bounds")
        for swap in swaps[one.robot]:
            where = f"{one.robot}/{swap.measured.component}"
            if not swap.measured.complete:
                warnings.append(f"{where}: trace records are missing around a swap; its figures are doubtful")
            if swap.prepare_us is None:
                warnings.append(f"{where}: a swap without its event in the bag; its cause is unknown")
    return warnings


def _robot(facts: MissionFacts, one: RobotEvidence, swaps: list[Swap]) -> dict[str, Any]:
    scheduled = facts.components.get(one.robot, {})
    return {
        "reconfigurations": [swap.as_json() for swap in swaps],
        "components": {
            name: {**_figures(found), **(scheduled.get(name) or _NOT_DEPLOYED)}
            for name, found in all_statistics(one.trace).items()
        },
    }


def _figures(found: ComponentStatistics) -> dict[str, int]:
    return {
        "releases": found.releases,
        "overruns": found.overruns,
        "wakeup_p50_ns": found.wakeup.p50_ns,
        "wakeup_p99_ns": found.wakeup.p99_ns,
    }
