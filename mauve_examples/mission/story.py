"""A mission in words: the verdict, the figures to remember, what happened when."""

from typing import NamedTuple

from mauve_examples.mission.evidence import CoverageHistory
from mauve_examples.mission.facts import MissionFacts
from mauve_examples.mission.figure_style import core_changes, short
from mauve_examples.mission.summary import union_growth
from mauve_examples.mission.swaps import Swap
from mauve_rt.trace.report import Card
from mauve_rt.trace.report.units import time_text


class Happening(NamedTuple):
    """Something that happened at a mission time."""

    time_s: float
    text: str


def verdict(facts: MissionFacts, swaps: dict[str, list[Swap]], *, success: bool) -> str:
    """Return one sentence about how it went."""
    robots = f"{len(facts.robots)} robots" if len(facts.robots) != 1 else "One robot"
    changed = sum(len(core_changes(found)) for found in swaps.values())
    if success and facts.expected_swaps:
        return (
            f"{robots} lost their radio link, replaced the exploration algorithm in flight, carried on "
            "alone, and went back to working together when the link returned."
        )
    if success:
        return f"{robots} explored as planned; {changed} cores were replaced on the way."
    return "The mission did not go as planned."


def key_figures(facts: MissionFacts, coverage: CoverageHistory) -> list[Card]:
    """Return the mission's figures that tell most; those of its traces stand beside."""
    union = coverage.union[-1] if len(coverage.union) else 0.0
    figures = [Card(f"{union:.1%}", "of the reachable cells explored")]
    if facts.link_down_ns:
        figures.append(Card(f"+{union_growth(facts, coverage):.1%}", "explored while the link was down"))
    if facts.simulation is not None:
        speed = f"{facts.simulation['speed_up']:.0f} \N{MULTIPLICATION SIGN}"
        figures.append(Card(speed, "as fast as real time, simulated"))
    else:
        granted = facts.realtime["granted"]
        figures.append(
            Card("yes" if granted else "no", "real-time rights granted", "" if granted else "attention")
        )
    return figures


def realtime_in_words(facts: MissionFacts) -> tuple[str, str]:
    """Return whether times are of a machine, and of one with real-time rights: level and sentence."""
    if facts.simulation is not None:
        took = f"{facts.simulation['virtual_s']:.1f} s passed in {facts.simulation['wall_s']:.1f} s"
        return "", (
            f"Simulated time: {took}. Execution takes no longer than declared, so that times here are of the "
            "model, not of a machine."
        )
    if facts.realtime["granted"]:
        return "good", "Every real-time right that was asked for was granted."
    missing = "; ".join(facts.realtime["missing"]) or "the executors did not say what is missing"
    return "attention", f"Real time: not all rights were granted ({missing})."


def cores_in_words(facts: MissionFacts, swaps: dict[str, list[Swap]]) -> list[str]:
    """Return for each robot which core its exploration ran until when."""
    lines = []
    for robot, found in swaps.items():
        changes = core_changes(found)
        if not changes:
            lines.append(f"{robot}: one core throughout.")
            continue
        spans = [
            f"{short(swap.from_core)} until {facts.seconds(swap.measured.parked_ns):.1f} s"
            for swap in changes
        ]
        lines.append(f"{robot}: {', '.join(spans)}, {short(changes[-1].to_core)} to the end.")
    return lines


def happenings(
    facts: MissionFacts, coverage: CoverageHistory, swaps: dict[str, list[Swap]]
) -> list[Happening]:
    """Return what happened, by time."""
    robots = ", ".join(facts.robots)
    where = "each in an executor of its own" if facts.simulation is None else "in simulated time"
    found = [Happening(0.0, f"The mission begins: {robots}, {where}.")]
    for begin_ns, end_ns in facts.link_down_ns:
        begin_s, end_s = facts.seconds(begin_ns), facts.seconds(end_ns)
        found.append(
            Happening(
                begin_s, f"The radio link is lost; {coverage.union_at(begin_s):.1%} are explored so far."
            )
        )
        if end_ns < facts.ended_ns:
            found.append(Happening(end_s, f"The link is back; {coverage.union_at(end_s):.1%} are explored."))
    found += [
        Happening(facts.seconds(swap.measured.parked_ns), swap_in_words(swap))
        for one in swaps.values()
        for swap in one
    ]
    end_s = facts.seconds(facts.ended_ns)
    shares = ", ".join(
        f"{robot} knows {values[-1]:.1%}" for robot, values in coverage.robots.items() if len(values)
    )
    found.append(Happening(end_s, f"The mission ends; {shares or 'nothing is known'}."))
    return sorted(found, key=lambda one: one.time_s)


def swap_in_words(swap: Swap) -> str:
    """Return the story of one reconfiguration."""
    one = swap.measured
    what = f"is reconfigured ({one.what})"
    if swap.to_core:
        what = f"replaces {short(swap.from_core)} by {short(swap.to_core)}"
    by = f", decided by {swap.decided_by}" if swap.decided_by else ""
    cause = f" ({swap.cause}{by})" if swap.cause else ""
    return f"{swap.robot} {what} in its component {one.component}{cause}: {', '.join(_costs(swap))}."


def _costs(swap: Swap) -> list[str]:
    one = swap.measured
    costs = [f"parked for {time_text(one.blackout_ns)}"]
    if swap.took_ms is not None:
        bound = f", {time_text(swap.bound_ms * 1e6)} at most" if swap.bound_ms is not None else ""
        costs.append(f"released {time_text(swap.took_ms * 1e6)} after the cause{bound}")
    if swap.prepare_us:  # nothing in simulated time
        costs.insert(0, f"prepared in {time_text(swap.prepare_us * 1e3)} while the old core ran on")
    if one.missed_releases is not None:
        costs.append(f"{one.missed_releases or 'no'} release{'s' * (one.missed_releases > 1)} missed")
    if one.phase_nominal_ns is not None and one.phase_actual_ns is not None:
        off = time_text(one.phase_nominal_ns)
        grid = f"{off} off the grid" if one.phase_nominal_ns else "on the grid"
        late = time_text(one.phase_actual_ns - one.phase_nominal_ns)
        costs.append(f"next release {grid}, woken {late} after it")
    return costs
