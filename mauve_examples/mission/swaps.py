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
    decided_by: str = ""
    """The node whose rule it was; empty when it was no rule's."""
    took_ms: float | None = None
    """From the instant at which the rule's condition became true to the first release after."""
    bound_ms: float | None = None
    """How long that takes at most."""

    def as_json(self) -> dict[str, Any]:
        """Return the entry of summary.json."""
        one = self.measured
        return {
            "component": one.component,
            "from": self.from_core,
            "to": self.to_core,
            "cause": self.cause,
            "silence_ms": self.silence_ms,
            "decided_by": self.decided_by or None,
            "took_ms": self.took_ms,
            "bound_ms": self.bound_ms,
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
    decision, done = _decided(evidence.decisions, cause, one.parked_ns)
    return Swap(
        robot=evidence.robot,
        measured=one,
        from_core=(request.from_core or None) if request is not None else None,
        to_core=(request.to_core or None) if request is not None else None,
        cause=cause,
        # The silence of an undo is over: its last sample has just come.
        silence_ms=None if getattr(decision, "decision", "") == "undo" else _ms(decision, "silence_s"),
        decided_by=request.requested_by if request is not None and decision is not None else "",
        took_ms=_ms(done, "took_s"),
        bound_ms=_ms(done, "bound_s"),
        prepare_us=None if request is None else (request.prepare_ns or 0) / 1e3,
    )


def _decided(decisions: Timed, cause: str, parked_ns: int) -> tuple[Any, Any]:
    """The decision to act that the event names as its cause, and the one that says it is done, if any.

    Of several with this cause the one nearest to the reconfiguration: each may be told some 100 ms late.
    """
    acted = [one for one in decisions if _is_named(one[1], cause)]
    if not acted:
        return None, None
    time_ns, message = min(acted, key=lambda one: abs(one[0] - parked_ns))
    after = (
        each
        for at_ns, each in decisions
        if at_ns >= time_ns and (each.rule, each.decision) == (message.rule, "done")
    )
    return message, next(after, None)


def _is_named(decision: Any, cause: str) -> bool:
    return decision.decision in _ACTED and f"{decision.rule}: {decision.reason}" == cause


def _ms(decision: Any, name: str) -> float | None:
    """A time of a decision; None where it is not known, as in bags of before."""
    seconds = getattr(decision, name, -1.0)
    return None if seconds < 0 else float(seconds) * 1e3
