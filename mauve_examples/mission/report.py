"""report.html: one self-contained page about a mission, and the figures on it as PNGs."""

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from mauve_examples.mission.evidence import CoverageHistory, RobotEvidence
from mauve_examples.mission.facts import MissionArea, MissionFacts
from mauve_examples.mission.figure_coverage import draw_coverage
from mauve_examples.mission.figure_map import draw_map
from mauve_examples.mission.figure_style import MICROSECOND, core_changes, short
from mauve_examples.mission.figure_timeline import draw_timeline
from mauve_examples.mission.report_page import bullets, page, picture, section, table
from mauve_examples.mission.story import cores_in_words, happenings, key_figures, overrun_figure, verdict
from mauve_examples.mission.swaps import Swap
from mauve_rt.trace.statistics import all_statistics

REPORT, MAP, COVERAGE, TIMELINE = "report.html", "map.png", "coverage.png", "timeline.png"


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


def write_report(out_dir: Path, data: ReportData) -> None:
    """Draw the figures into out_dir and write the page.

    Raises:
        OSError: one cannot be written.
    """
    swaps = [(one, data.swaps[one.robot]) for one in data.robots]
    draw_map(out_dir / MAP, data.facts, data.area, data.coverage, swaps)
    draw_coverage(out_dir / COVERAGE, data.facts, data.coverage, data.swaps)
    if data.robots:
        evidence, swap = _shown_swap(data)
        draw_timeline(out_dir / TIMELINE, data.facts, evidence, swap)
    html = page("Exploration mission", _parts(out_dir, data))
    temporary = out_dir / f".{REPORT}.new"
    temporary.write_text(html, encoding="utf-8")
    temporary.replace(out_dir / REPORT)


def _shown_swap(data: ReportData) -> tuple[RobotEvidence, Swap | None]:
    """Return the first replacement of an exploration core; without one the first robot."""
    changes = [swap for found in data.swaps.values() for swap in core_changes(found)]
    if not changes:
        return data.robots[0], None
    first = min(changes, key=lambda swap: swap.measured.parked_ns)
    return next(one for one in data.robots if one.robot == first.robot), first


def _parts(out_dir: Path, data: ReportData) -> Iterator[str]:
    success = bool(data.summary["success"])
    yield (
        f'<header class="{"" if success else "failed"}">'
        f'<p class="state">{"Mission succeeded" if success else "Mission failed"}</p>'
        f"<h1>{escape(verdict(data.facts, data.swaps, success=success))}</h1></header>"
    )
    figures = key_figures(data.facts, data.coverage, data.swaps) + overrun_figure(data.summary)
    cards = "".join(
        f"<div><b>{escape(one.value)}</b><span>{escape(one.meaning)}</span></div>" for one in figures
    )
    yield f'<div class="figures">{cards}</div>'
    if data.summary["reasons"]:
        yield section("Why it failed", "", bullets(data.summary["reasons"], css="bad"))
    if data.summary["warnings"]:
        yield section("Read with care", "", bullets(data.summary["warnings"]))
    yield section("What happened", "Times are mission time.", _story(data))
    yield section("Where the robots went", "", picture(out_dir / MAP, "map with trajectories"))
    yield section("What they knew, and when", "", picture(out_dir / COVERAGE, "coverage over time"))
    if data.robots:
        yield section(
            "The components around the first swap",
            "From the records that the components' own threads wrote.",
            picture(out_dir / TIMELINE, "timeline of the components"),
        )
    yield section(
        "Reconfigurations",
        "Blackout: from parked to armed, by the component's own thread. Phase: the next release as it should "
        "be, against the grid that the deployment recorded; woken: the same of the actual release.",
        _swap_table(data),
    )
    yield section(
        "Components",
        "Wake-up latency: first instruction after a wait minus its nominal instant. Policy, priority and "
        "CPUs were read back from the threads.",
        *(_component_table(data, one) for one in data.robots),
    )
    yield _realtime(data)


def _story(data: ReportData) -> str:
    lines = "".join(
        f"<li><time>{one.time_s:.1f} s</time><span>{escape(one.text)}</span></li>"
        for one in happenings(data.facts, data.coverage, data.swaps)
    )
    cores = bullets(cores_in_words(data.facts, data.swaps))
    return f'<ol class="story">{lines}</ol><h3>Who ran which core</h3>{cores}'


def _swap_table(data: ReportData) -> str:
    columns = ("robot", "at, s", "component", "core", "cause", "silence, ms")
    measures = (
        f"prepared, {MICROSECOND}",
        f"blackout, {MICROSECOND}",
        "missed",
        "phase, ns",
        f"woken, {MICROSECOND}",
    )
    rows = [
        (
            robot,
            data.facts.seconds(swap.measured.parked_ns),
            swap.measured.component,
            f"{short(swap.from_core)} \N{RIGHTWARDS ARROW} {short(swap.to_core)}",
            swap.cause,
            swap.silence_ms,
            swap.prepare_us,
            swap.measured.blackout_ns / 1e3,
            swap.measured.missed_releases,
            swap.measured.phase_nominal_ns,
            None if swap.measured.phase_actual_ns is None else swap.measured.phase_actual_ns / 1e3,
        )
        for robot, found in data.swaps.items()
        for swap in found
    ]
    return table((*columns, *measures), rows) if rows else "<p>None.</p>"


def _component_table(data: ReportData, evidence: RobotEvidence) -> str:
    columns = ("component", "scheduling", "CPUs", "releases", "overruns", "skipped")
    latency = tuple(f"wake-up {what}, {MICROSECOND}" for what in ("p50", "p99", "max"))
    summary = data.summary["robots"][evidence.robot]["components"]
    rows = [
        (
            name,
            f"{summary[name]['policy']} {summary[name]['priority']}",
            " ".join(map(str, summary[name]["cpus"])),
            found.releases,
            found.overruns,
            found.skipped,
            found.wakeup.p50_ns / 1e3,
            found.wakeup.p99_ns / 1e3,
            found.wakeup.max_ns / 1e3,
            f"{found.response.max_ns / 1e6:.2f}",
        )
        for name, found in all_statistics(evidence.trace).items()
    ]
    return f"<h3>{escape(evidence.robot)}</h3>" + table((*columns, *latency, "response max, ms"), rows)


def _realtime(data: ReportData) -> str:
    realtime, simulation = data.facts.realtime, data.facts.simulation
    if simulation is not None:
        speed = f"{simulation['speed_up']:.1f} times as fast as real time"
        took = f"{simulation['virtual_s']:.1f} s passed in {simulation['wall_s']:.1f} s, {speed}."
        return section(
            "Simulated time",
            "Execution takes no longer than declared, so that times here are of the model, not of a machine.",
            f"<p>{escape(took)}</p>",
        )
    if realtime["granted"]:
        return section("Real time", "", "<p>Every real-time right that was asked for was granted.</p>")
    missing = bullets(realtime["missing"] or ["the executors did not say what"])
    return section("Real time: not all rights were granted", "", missing)
