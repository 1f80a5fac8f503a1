"""The reconfigurations of a mission: what the trace measured, joined with who asked for it and why."""

from dataclasses import dataclass
from typing import Any

from mauve_examples.mission.evidence import RobotEvidence, Timed
from mauve_examples.mission.facts import MissionFacts
from mauve_rt.trace.reconfigurations import Reconfiguration, reconfigurations

EXPLORATION = "exploration"
_REPLY_WITHIN_NS = 5_000_000_000  # the executor publishes its event after the reply
_ACTED = ("do", "undo")


@dataclass(frozen=True, kw_only=True)
class Swap:
    """One committed reconfiguration of one component."""

    robot: str
    measured: Reconfiguration
    from_core: str | None
    """None where the executor's event is not in the bag, or it was no replacement of a core."""
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
    unused = [(time_ns, event) for time_ns, event in evidence.events if event.success]
    swaps = []
    for one in reconfigurations(evidence.trace):
        if one.committed:
            match = next((pair for pair in unused if _tells_of(pair, one)), None)
            if match is not None:
                unused.remove(match)
            swaps.append(_joined(evidence, one, None if match is None else match[1]))
    return swaps


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


def _tells_of(event: tuple[int, Any], one: Reconfiguration) -> bool:
    time_ns, message = event
    components = [step.component for step in message.report]
    return one.component in components and 0 <= time_ns - one.armed_ns <= _REPLY_WITHIN_NS


def _joined(evidence: RobotEvidence, one: Reconfiguration, event: Any) -> Swap:
    step, cause = None, ""
    if event is not None:
        cause = event.cause
        step = next(step for step in event.report if step.component == one.component)
    replaced = event is not None and bool(event.to_core)
    return Swap(
        robot=evidence.robot,
        measured=one,
        from_core=event.from_core if replaced else None,
        to_core=event.to_core if replaced else None,
        cause=cause,
        silence_ms=_silence_ms(evidence.decisions, cause),
        prepare_us=None if step is None else step.prepare_ns / 1e3,
    )


def _silence_ms(decisions: Timed, cause: str) -> float | None:
    """Of the supervisor's decision to act that the event names as its cause, whenever it was recorded."""
    for _, message in decisions:
        if message.decision in _ACTED and f"{message.rule}: {message.reason}" == cause:
            return None if message.silence_s < 0 else float(message.silence_s) * 1e3
    return None
