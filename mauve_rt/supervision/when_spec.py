"""Trees of conditions as the engine takes them, and what it says of one that it does not take."""

from mauve_rt._kernel import MauveError, RuleEngine, RuleSpec, SignalSpec, WhenSpec
from mauve_rt.supervision.when import When

OF_TOPICS = ("message", "arrival", "field")
"""Kinds of signals that messages of a topic feed."""


def when_spec(when: When) -> WhenSpec:
    """A tree of conditions; what it was not told it is not told here either."""
    return WhenSpec(
        when.kind,
        parameters={name: value for name, value in when.parameters.items() if value is not None},
        parts=[when_spec(part) for part in when.parts],
        count=when.count,
        for_ns=nanoseconds(when.for_s),
        within_ns=nanoseconds(when.within_s),
    )


def nanoseconds(seconds: float) -> int:
    """Rounded; what is more than 0 is 1 at least."""
    return max(round(seconds * 1e9), 1) if seconds > 0 else 0


def heard(leaf: When) -> list[SignalSpec]:
    """What a condition hears; the first signal is what it is about.

    Raises:
        MauveError: what it was told makes no sense together.
    """
    return RuleEngine([RuleSpec("one", when_spec(leaf))]).signals


def refusal(leaf: When) -> MauveError | None:
    """Why the engine does not take a condition whose parameters are each what they may be; mostly nothing."""
    try:
        heard(leaf)
    except MauveError as error:
        return error
    return None
