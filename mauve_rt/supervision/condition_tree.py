"""The `when` of a rule at work: conditions, combined, that must hold or have held so long. Knows no ROS."""

from collections.abc import Callable, Sequence

from mauve_rt.supervision.conditions import NO_SILENCE_S, Condition, Look
from mauve_rt.supervision.when import ALL, ANY, COMBINATIONS, NOT, When


class TreeCondition:
    """A node of the tree. Seconds of any steady clock; called from one thread."""

    def __init__(self, when: When, leaf: Callable[[When], Condition]) -> None:
        """`leaf` makes each condition, from left to right."""
        self._when = when
        self._leaf = None if when.kind in COMBINATIONS else leaf(when)
        self._parts = [TreeCondition(part, leaf) for part in when.parts]
        self._since_s: float | None = None  # it holds without a break from then on
        self._held_s: float | None = None  # when it was last seen to have held for_s
        self._assumed = False

    def arm(self, now_s: float) -> None:
        """As Condition."""
        self._since_s = self._held_s = None
        self._assumed = False
        for each in self._children():
            each.arm(now_s)

    def assume(self) -> None:
        """As Condition. What must not hold cannot be assumed: it is looked at."""
        self._assumed = True
        if self._when.kind != NOT:
            for each in self._children():
                each.assume()

    def look(self, now_s: float) -> Look:
        """As Condition. Every part is looked at, however much the others decide."""
        looks = [each.look(now_s) for each in self._children()]
        held = self._held_long_enough(now_s, holds=self._holds(looks))
        holds = held
        if held:
            self._held_s = now_s
        elif self._held_s is not None:
            holds = now_s - self._held_s <= self._when.within_s > 0
        return Look(holds=holds, reason=self._reason(looks), silence_s=_silence_s(looks))

    def _children(self) -> Sequence[Condition]:
        return [self._leaf] if self._leaf is not None else self._parts

    def _holds(self, looks: Sequence[Look]) -> bool:
        held = sum(look.holds for look in looks)
        if self._when.kind == NOT:
            return held == 0
        if self._when.kind == ANY:
            return held > 0
        if self._when.kind == ALL:
            return held == len(looks)
        return held >= (self._when.count or 1)

    def _held_long_enough(self, now_s: float, *, holds: bool) -> bool:
        if not holds:
            self._since_s = None
            self._assumed = False
            return False
        if self._since_s is None:
            self._since_s = now_s
        return self._assumed or now_s - self._since_s >= self._when.for_s

    def _reason(self, looks: Sequence[Look]) -> str:
        """What decides: the parts that hold, or all where none does."""
        decisive = [look.reason for look in looks if look.holds] or [look.reason for look in looks]
        return " and ".join(dict.fromkeys(decisive))


def _silence_s(looks: Sequence[Look]) -> float:
    return max((look.silence_s for look in looks), default=NO_SILENCE_S)
