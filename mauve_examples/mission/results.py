"""The one entry point of a mission's results: summary.json, report.html and its figures."""

from pathlib import Path
from typing import Any

from mauve_examples.mission.evidence import RobotEvidence, read_robot, replay_coverage
from mauve_examples.mission.facts import (
    ComponentFacts,
    MissionArea,
    MissionFacts,
    RealtimeFacts,
    load_area,
)
from mauve_examples.mission.report import ReportData, write_report
from mauve_examples.mission.summary import SUMMARY, build_summary, write_summary
from mauve_examples.mission.supervised import Supervised, compare
from mauve_examples.mission.swaps import find_swaps
from mauve_rt.trace import TraceError

__all__ = ["ComponentFacts", "MissionFacts", "RealtimeFacts", "write_results"]

BAGS = "bag"


def write_results(
    out_dir: Path,
    mission: MissionFacts,
    *,
    area: MissionArea | None = None,
    supervised: Supervised | None = None,
) -> dict[str, Any]:
    """Read out_dir/bag/<robot>/ of every robot, write the results beside, return the summary.

    A bag that is missing or cannot be read is a reason for failure in the summary, not an error.

    Args:
        out_dir: the mission's folder.
        mission: what the driver knows.
        area: the map, when it has been loaded already.
        supervised: the same mission with supervisors, to compare one that had none.

    Raises:
        OSError: the results cannot be written.
    """
    evidence: list[RobotEvidence] = []
    unreadable: list[str] = []
    for robot in mission.robots:
        try:
            evidence.append(read_robot(out_dir / BAGS / robot, robot, mission))
        except TraceError as error:
            unreadable.append(f"{robot}: {error}")
    area = area or load_area(mission)
    coverage = replay_coverage(mission, area, evidence)
    summary = build_summary(mission, evidence, coverage)
    summary["reasons"] += unreadable
    summary["success"] = not summary["reasons"]
    if supervised is not None and mission.link_down_ns:
        summary["supervisors_saved"] = compare(mission, coverage, evidence, supervised)
    write_summary(out_dir / SUMMARY, summary)
    swaps = {one.robot: find_swaps(one) for one in evidence}
    data = ReportData(mission, area, coverage, evidence, swaps, summary, supervised)
    write_report(out_dir, data)
    return summary
