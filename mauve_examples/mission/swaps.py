"""The reconfigurations of a mission: what the trace measured, joined with who asked for it and why."""

from dataclasses import dataclass
from typing import Any

from mauve_examples.mission.evidence import RobotEvidence, Timed
from mauve_examples.mission.facts import MissionFacts
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.reconfigurations import Reconfiguration, reconfigurations
from mauve_rt.trace.report.requests import RequestTold, join_requests

EXPLORATION = "exploration"
_ACTED = ("do", "undo")


@dataclass(frozen=True, kw_only=True)
class Swap:
    """One committed reconfiguration of one component."""

    robot: str
    measured: Reconfiguration
    from_core: str | None
    """None where the executor's event is not in the bag, or this component kept its core."""
    to_core: str | None
    cause: str
    silence_ms: float | None
    """Silence on which the supervisor decided; None when nobody decided on silence."""
    prepare_us: float | None

    def as_json(self) -> dict[str, Any]:
        """Return the entry of summary.json."""
        one = self.measured
        return {
            "component": one.component,
            "from": self.from_core,
            "to": self.to_core,
            "cause": self.cause,
            "silence_ms": self.silence_ms,
            "prepare_us": self.prepare_us,
            "blackout_us": one.blackout_ns / 1e3,
            "missed_releases": one.missed_releases,
            "phase_nominal_ns": one.phase_nominal_ns,
            "phase_actual_ns": one.phase_actual_ns,
        }


def find_swaps(evidence: RobotEvidence) -> list[Swap]:
    """Return the committed reconfigurations of a robot by time.

    A connection or a property changed under a hold is one too; its cores are None.
    """
    measured = [one for one in reconfigurations(evidence.trace) if one.committed]
    events = [Message("", 0, time_ns, event) for time_ns, event in evidence.events]
    return [
        _joined(evidence, one, request)
        for one, request in zip(measured, join_requests(measured, events), strict=True)
    ]


def swap_problems(facts: MissionFacts, robot: str, swaps: list[Swap]) -> list[str]:
    """Say why the planned swaps of a robot did not happen both ways; empty when they did."""
    loss_ns, back_ns = facts.link_down_ns[0][0], facts.link_down_ns[-1][1]
    exploring = [swap for swap in swaps if swap.measured.component == EXPLORATION and swap.to_core]
    away = next((swap for swap in exploring if loss_ns <= swap.measured.parked_ns < back_ns), None)
    if away is None:
        return [f"{robot}: {EXPLORATION} was not replaced while the link was down"]
    returns = [swap for swap in exploring if swap.measured.parked_ns >= back_ns]
    if not any(swap.to_core == away.from_core for swap in returns):
        return [f"{robot}: {EXPLORATION} was not swapped back to {away.from_core} after the link's return"]
    return []


def _joined(evidence: RobotEvidence, one: Reconfiguration, request: RequestTold | None) -> Swap:
    cause = "" if request is None else request.cause
    return Swap(
        robot=evidence.robot,
        measured=one,
        from_core=(request.from_core or None) if request is not None else None,
        to_core=(request.to_core or None) if request is not None else None,
        cause=cause,
        silence_ms=_silence_ms(evidence.decisions, cause),
        prepare_us=None if request is None else (request.prepare_ns or 0) / 1e3,
    )


def _silence_ms(decisions: Timed, cause: str) -> float | None:
    """Of the supervisor's decision to act that the event names as its cause, whenever it was recorded."""
    for _, message in decisions:
        if message.decision in _ACTED and f"{message.rule}: {message.reason}" == cause:
            return None if message.silence_s < 0 else float(message.silence_s) * 1e3
    return None
