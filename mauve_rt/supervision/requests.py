"""What a supervisor asks of its executor: the steps of its rules, as requests have them."""

from collections.abc import Iterable

from mauve_rt.control.requests import Step
from mauve_rt.model.steps import Step as RuleStep

ANSWER_TIMEOUT_S = 5.0


def asked(steps: Iterable[RuleStep]) -> tuple[Step, ...]:
    """Steps of a rule as those of a request."""
    return tuple(Step(step.kind, step.target, step.name, step.value) for step in steps)
