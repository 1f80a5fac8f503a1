"""The conditions of a supervisor's rules, without ROS and with injected time. Seconds of any steady clock."""

from dataclasses import dataclass
from typing import Protocol

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

    def hear(self, now_s: float) -> None:
        """A sample arrived."""
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
