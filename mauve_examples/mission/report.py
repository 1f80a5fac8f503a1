"""report.html: one self-contained page about a mission, and its figures as PNGs.

The page is that of `mauve report`, about all robots' traces on one timeline; the mission's own story, map and
coverage stand in front.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mauve_examples.mission.evidence import CoverageHistory, RobotEvidence
from mauve_examples.mission.facts import MissionArea, MissionFacts
from mauve_examples.mission.figure_coverage import draw_coverage
from mauve_examples.mission.figure_map import draw_map
from mauve_examples.mission.figure_supervised import draw_supervised
from mauve_examples.mission.story import cores_in_words, happenings, key_figures, realtime_in_words, verdict
from mauve_examples.mission.supervised import Supervised, compared_in_words
from mauve_examples.mission.swaps import Swap
from mauve_rt.trace import report
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.trace import Trace, merge_traces
from mauve_rt.trace.report.blocks import bullets, picture, prose

REPORT, MAP, COVERAGE = "report.html", "map.png", "coverage.png"
SUPERVISORS = "supervisors.png"


@dataclass(frozen=True)
class ReportData:
    """Everything the report shows."""

    facts: MissionFacts
    area: MissionArea
    coverage: CoverageHistory
    robots: list[RobotEvidence]
    swaps: dict[str, list[Swap]]
    """Per robot."""
    summary: dict[str, Any]
    supervised: Supervised | None = None
    """The same mission with supervisors, simulated, where this one had none."""


def write_report(out_dir: Path, data: ReportData) -> None:
    """Draw the figures into out_dir and write the page.

    Raises:
        OSError: one cannot be written.
    """
    swaps = [(one, data.swaps[one.robot]) for one in data.robots]
    draw_map(out_dir / MAP, data.facts, data.area, data.coverage, swaps)
    draw_coverage(out_dir / COVERAGE, data.facts, data.coverage, data.swaps)
    if data.supervised is not None and data.summary["supervisors_saved"] is not None:
        draw_supervised(out_dir / SUPERVISORS, data.facts, data.coverage, data.supervised)

    def judged(told: report.Verdict) -> report.Verdict:
        return _verdict(data, told)

    report.write_report(
        out_dir / REPORT,
        _trace(data),
        title="Exploration mission",
        extra=list(_sections(out_dir, data)),
        figures=key_figures(data.facts, data.coverage),
        verdict=judged,
        events=_events(data),
        zero_ns=data.facts.started_ns,
    )


def _trace(data: ReportData) -> Trace:
    """Return all robots' traces as one; of a mission without a readable bag an empty one."""
    if not data.robots:
        return Trace({}, (), {}, np.empty((0, 2), np.int64))
    return merge_traces({one.robot: one.trace for one in data.robots})


def _events(data: ReportData) -> list[Message]:
    return [
        Message(f"/{one.robot}/executor/events", 0, time_ns, event)
        for one in data.robots
        for time_ns, event in one.events
    ]


def _verdict(data: ReportData, told: report.Verdict) -> report.Verdict:
    """Return the mission's verdict; whether the timing held, and what else the traces tell, follow."""
    success = bool(data.summary["success"])
    level, timing = realtime_in_words(data.facts)
    warnings = [report.Sentence("attention", warning) for warning in data.summary["warnings"]]
    return report.Verdict(
        "good" if success else "bad",
        verdict(data.facts, data.swaps, success=success),
        [*warnings, report.Sentence(level, timing), *told.sentences],
        also=report.Sentence(told.level, f"{told.lead} {told.sentence}"),
        lead="Mission succeeded" if success else "Mission failed",
    )


def _sections(out_dir: Path, data: ReportData) -> Iterator[report.Section]:
    if data.summary["reasons"]:
        yield report.Section("Why it failed", bullets(data.summary["reasons"], css="bad"), anchor="why")
    if data.summary["supervisors_saved"] is not None:
        words = bullets(compared_in_words(data.summary["supervisors_saved"]))
        saved = words + picture(out_dir / SUPERVISORS, "coverage over time with and without supervisors")
        yield report.Section("What supervisors would have saved", saved, anchor="supervisors")
    yield report.Section("What happened", _story(data), note="Times are mission time.", anchor="story")
    yield report.Section(
        "Where the robots went", picture(out_dir / MAP, "map with trajectories"), anchor="map"
    )
    yield report.Section(
        "What they knew, and when", picture(out_dir / COVERAGE, "coverage over time"), anchor="coverage"
    )


def _story(data: ReportData) -> str:
    lines = "".join(
        f"<li><time>{one.time_s:.1f} s</time><span>{prose(one.text)}</span></li>"
        for one in happenings(data.facts, data.coverage, data.swaps)
    )
    cores = bullets(cores_in_words(data.facts, data.swaps))
    return f'<ol class="story">{lines}</ol><h3>Who ran which core</h3>{cores}'
