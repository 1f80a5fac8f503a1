"""A decision of somebody's rules, as plain values."""

from collections.abc import Sequence
from dataclasses import dataclass

from mauve_rt._kernel import RuleDecision
from mauve_rt.supervision.decision_words import Name, reason_of
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.when import SILENCES

NO_SILENCE_S = -1.0  # of a condition that knows no silence
_WITHOUT_ACT = ("armed", "condition_true", "condition_false", "condition_unknown")


@dataclass(frozen=True, kw_only=True)
class Decision:
    """Fields as mauve_msgs/msg/SupervisorDecision; `time_ns`: of the clock that the engine is told."""

    time_ns: int
    rule: str
    decision: str
    reason: str
    act: str = ""
    silence_s: float = NO_SILENCE_S
    measured: float = 0.0
    revision: int = 0
    message: str = ""


def decision_of(
    made: RuleDecision,
    rules: Sequence[Rule],
    *,
    name: Name = str,
    failure: str = "",
    reason: str = "",
    revision: int = 0,
    message: str = "",
) -> Decision:
    """One that an engine has made for these rules; `reason`: a better one than its own words."""
    rule = rules[made.rule]
    return Decision(
        time_ns=made.stamp_ns,
        rule=rule.name,
        decision=made.decision,
        reason=reason or reason_of(made, rules, name=name, failure=failure),
        act="" if made.decision in _WITHOUT_ACT else made.act,
        silence_s=made.measured if rule.when.kind in SILENCES else NO_SILENCE_S,
        measured=made.measured,
        revision=revision,
        message=message,
    )
