"""The conditions of a supervisor's rules, without ROS and with injected time. Seconds of any steady clock."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, isnan, nan
from typing import Any, Protocol

from mauve_rt.supervision.when import When

NO_SILENCE_S = -1.0  # SupervisorDecision.silence_s of a condition that knows no silence


@dataclass(frozen=True)
class Look:
    """What a condition says at one instant."""

    holds: bool
    reason: str
    silence_s: float = NO_SILENCE_S


class Condition(Protocol):
    """What the `when` of a rule asks. Called from one thread."""

    def arm(self, now_s: float) -> None:
        """Start watching: what happened before does not count."""

    def assume(self) -> None:
        """Take it to hold until something proves otherwise: it did when somebody acted on it."""

    def look(self, now_s: float) -> Look:
        """Whether the condition holds now. Called at every check of an armed rule."""


class TopicCondition(Condition, Protocol):
    """A condition that a topic decides."""

    def hear(self, now_s: float, value: float = nan) -> None:
        """A sample arrived; `value` is that of the condition's field, if it has one."""


def topic_condition(leaf: When, topic: str) -> TopicCondition:
    """The condition of a leaf; `topic` is the name to tell."""
    if leaf.kind == "value":
        return ValueCondition(topic, leaf.parameters)
    return SilenceCondition(topic, longer_than_s=leaf.parameters["longer_than_s"])


class SilenceCondition:
    """Holds while the last sample of a topic is older than a limit; before a first one, since arming.

    Silence is believed at the second look only. A process that did not get the processor for long finds its
    timer due and its samples waiting in the queue alike: between two looks the queue has been emptied.
    """

    def __init__(self, topic: str, *, longer_than_s: float) -> None:
        self._topic = topic
        self._longer_than_s = longer_than_s
        self._since_s = 0.0
        self._heard = False
        self._suspected = False
        self._assumed = False

    def arm(self, now_s: float) -> None:
        """Count silence from now on."""
        self._since_s = now_s
        self._heard = False
        self._suspected = False
        self._assumed = False

    def assume(self) -> None:
        """Believe in a silence that began before, unless a sample came since arming."""
        self._assumed = not self._heard

    def hear(self, now_s: float, value: float = nan) -> None:
        """As TopicCondition."""
        del value
        self._since_s = now_s
        self._heard = True
        self._assumed = False

    def look(self, now_s: float) -> Look:
        """Whether the silence lasts longer than the limit."""
        silence_s = now_s - self._since_s
        silent = silence_s > self._longer_than_s
        believed = self._assumed or (silent and self._suspected)
        self._suspected = silent
        if not believed:
            return Look(holds=False, reason=f"samples on {self._topic}", silence_s=silence_s)
        never = "" if self._heard else ", from arming on"
        reason = f"nothing on {self._topic} for {silence_s:.2f} s{never}"
        return Look(holds=True, reason=reason, silence_s=silence_s)


class ValueCondition:
    """Holds while the last value of a field is beyond a bound, until it is within by the hysteresis.

    NaN is beyond. Of what was not heard since arming it says nothing.
    """

    def __init__(self, topic: str, told: Mapping[str, Any]) -> None:
        self._what = f"{told['field']} of {topic}"
        self._low = -inf if told["below"] is None else told["below"]
        self._high = inf if told["above"] is None else told["above"]
        self._hysteresis = told["hysteresis"]
        self._value: float | None = None
        self._beyond = False

    def arm(self, now_s: float) -> None:
        """Forget what was heard before."""
        del now_s
        self._value = None
        self._beyond = False

    def assume(self) -> None:
        """Believe that it is beyond, unless a value came since arming."""
        self._beyond = self._beyond or self._value is None

    def hear(self, now_s: float, value: float = nan) -> None:
        """As TopicCondition."""
        del now_s
        margin = self._hysteresis if self._beyond else 0.0
        self._beyond = isnan(value) or not self._low + margin <= value <= self._high - margin
        self._value = value

    def look(self, now_s: float) -> Look:
        """Whether the last value is beyond a bound."""
        del now_s
        said = "not heard since arming" if self._value is None else f"is {self._value:g}"
        return Look(holds=self._beyond, reason=f"{self._what} {said}")
