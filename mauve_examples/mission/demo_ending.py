"""The last words of a demo: what came of it, what it cost, where to read more."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mauve_examples.mission.evidence import read_robot, replay_coverage
from mauve_examples.mission.facts import MissionArea, MissionFacts
from mauve_examples.mission.hints import sourcing
from mauve_examples.mission.summary import SUMMARY, build_summary, write_summary
from mauve_examples.mission.supervised import compared_in_words
from mauve_rt.trace import TraceError


def ending(out: Path, summary: dict[str, Any]) -> str:
    """What came of a mission, as text. `summary`: as summary.json."""
    return "\n".join(_lines(out, summary))


def summarise(out: Path, facts: MissionFacts, area: MissionArea) -> dict[str, Any]:
    """Write summary.json from the bags there are, without report and figures; returns the summary."""
    evidence, unreadable = [], []
    for robot in facts.robots:
        try:
            evidence.append(read_robot(out / "bag" / robot, robot, facts))
        except TraceError as error:
            unreadable.append(f"{robot}: {error}")
    summary = build_summary(facts, evidence, replay_coverage(facts, area, evidence))
    summary["reasons"] += unreadable
    summary["success"] = not summary["reasons"]
    write_summary(out / SUMMARY, summary)
    return summary


def _lines(out: Path, summary: dict[str, Any]) -> Iterator[str]:
    swaps = [(robot, swap) for robot, one in summary["robots"].items() for swap in one["reconfigurations"]]
    if swaps:
        yield "\nReconfigurations, as the trace measured them:"
        yield from (f"  {robot}  {_swap(swap)}" for robot, swap in swaps)
    shares = dict(summary["coverage"])
    together = shares.pop("union")
    explored = ", ".join(f"{robot} {share:.0%}" for robot, share in shares.items())
    yield f"\nExplored: {explored}, together {together:.0%}."
    yield from _encounters(summary["collisions"])
    yield from _realtime(summary["realtime"]) if summary["simulation"] is None else [_speed(summary)]
    if summary["success"]:
        yield "SUCCESS."
    else:
        yield "FAILED:"
        yield from (f"  {reason}" for reason in summary.get("reasons", ()))
    if summary["supervisors_saved"] is not None:
        yield "What supervisors would have saved:"
        yield from (f"  {line}" for line in compared_in_words(summary["supervisors_saved"]))
    report = out / "report.html"
    yield f"Report: {report if report.exists() else 'none, the mission was interrupted'}"
    yield f"Figures: {out / 'summary.json'}   traces: {out / 'bag'}"
    yield from _closer_look(out / "bag")


def _closer_look(bags: Path) -> Iterator[str]:
    robots = sorted(folder for folder in bags.iterdir() if folder.is_dir()) if bags.is_dir() else []
    if not robots:
        return
    yield "To look closer:"
    verbs = (f"mauve report {shlex.quote(str(bags))}", f"mauve trace stats {shlex.quote(str(robots[0]))}")
    yield from (f"  {command}" for command in (*sourcing(), *verbs))


def _encounters(found: dict[str, Any]) -> Iterator[str]:
    if found["events"]:
        yield f"Collisions: {found['events']}, for {found['pair_seconds']:.2f} s in all."
    elif found["nearest_m"] is not None:
        yield f"Collisions: none; no two robots' centres were nearer than {found['nearest_m']:.2f} m."


def _swap(swap: dict[str, Any]) -> str:
    known = swap["from"] or swap["to"]  # neither is where only properties or wires were changed
    change = f"{_class(swap['from'])} -> {_class(swap['to'])}" if known else "changed"
    words = [f"{swap['component']}: {change}"]
    if swap["silence_ms"] is not None:
        words.append(f"{swap['silence_ms']:.0f} ms after the last sample")
    if swap.get("took_ms") is not None:
        bound = f" (at most {swap['bound_ms']:.1f} ms)" if swap["bound_ms"] is not None else ""
        words.append(f"at work {swap['took_ms']:.1f} ms after the cause{bound}")
    if swap["prepare_us"]:
        words.append(f"prepared in {swap['prepare_us']:.0f} us")
    if swap["blackout_us"]:
        words.append(f"blackout {swap['blackout_us']:.0f} us")
    if swap["missed_releases"] is not None:
        words.append(f"{swap['missed_releases']} releases missed")
    return ", ".join(words)


def _class(name: str | None) -> str:
    return name.rsplit("/", 1)[-1] if name else "?"


def _speed(summary: dict[str, Any]) -> str:
    run = summary["simulation"]
    speed = (
        f"{run['virtual_s']:.1f} s in {run['wall_s']:.1f} s, {run['speed_up']:.1f} times as fast as real time"
    )
    return f"Simulated time: {speed}."


def _realtime(realtime: dict[str, Any]) -> Iterator[str]:
    if realtime["granted"]:
        yield "Real time: granted."
        return
    yield "Real time was not granted, so the times above are best effort:"
    yield from (f"  {line}" for line in realtime["missing"] or ["the executors did not say why"])
