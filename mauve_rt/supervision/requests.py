"""What a supervisor asks of its executor, and the answer."""

from collections.abc import Sequence
from dataclasses import dataclass

from mauve_rt.model.steps import Step

ANSWER_TIMEOUT_S = 5.0


@dataclass(frozen=True)
class Request:
    """A transaction for the executor. `number` names it in `on_outcome`."""

    number: int
    steps: Sequence[Step]
    expected_revision: int
    cause: str
    dry_run: bool = False
    max_missed: int = 0


@dataclass(frozen=True)
class Outcome:
    """The executor's reply, or why there is none."""

    success: bool
    message: str
    revision: int = 0
    wrong_revision: bool = False
    inactive: bool = False  # refused because the executor is not active
    answered: bool = True  # False: the request did not reach the executor
