"""The three values of a condition, in words."""

from typing import Protocol


class Judged(Protocol):
    """RuleStatus of an engine, and RuleInfo.msg."""

    @property
    def known(self) -> bool:
        """Whether it is true or false."""

    @property
    def holds(self) -> bool:
        """Whether it is true."""


def truth_word(condition: Judged) -> str:
    """true, false or unknown."""
    if not condition.known:
        return "unknown"
    return "true" if condition.holds else "false"
