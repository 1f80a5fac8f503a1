"""What is wanted of each element, as docs/concepts/overlays.md says: what the kernel is held to.

Elements are names, values are texts. A condition is true, false, or None: unknown.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

PARKED = "parked"
MOST_BEFORE = 8


@dataclass(frozen=True)
class ModelRule:
    """A rule: what it assigns while it is active."""

    name: str
    priority: int
    do: tuple[tuple[str, str], ...]
    safety: bool = False
    latch: bool = False
    whole: bool = False

    @property
    def assigns(self) -> dict[str, str]:
        """By element."""
        return dict(self.do)


@dataclass
class OverlaysModel:
    """All that decides what is wanted."""

    base: dict[str, str]
    rules: dict[str, ModelRule] = field(default_factory=dict)
    conditions: dict[str, bool | None] = field(default_factory=dict)
    active: set[str] = field(default_factory=set)
    over: dict[str, tuple[str, str]] = field(
        default_factory=dict
    )  # value, and the safety rule that it is above
    stopped: set[str] = field(default_factory=set)
    before: dict[str, list[str]] = field(default_factory=dict)
    rejected: set[tuple[str, str]] = field(default_factory=set)

    # ---- what is wanted

    def _ranked(self) -> list[ModelRule]:
        order = list(self.rules)
        active = [self.rules[name] for name in order if name in self.active]
        return sorted(active, key=lambda rule: (not rule.safety, -rule.priority, order.index(rule.name)))

    def _contributing(self) -> list[ModelRule]:
        found: list[ModelRule] = []
        for rule in self._ranked():
            taken = {name for higher in found for name in higher.assigns} | set(self.over)
            taken |= {name for name, value in rule.do if (name, value) in self.rejected}
            if not (rule.whole and taken & set(rule.assigns)):
                found.append(rule)
        return found

    def _candidates(self, element: str) -> Iterator[tuple[str, str]]:
        """Values and who wants them, the best first."""
        if element in self.stopped:
            yield "stopped", "stop"
            return
        over = self.over.get(element)
        for rule in self._contributing():
            if element not in rule.assigns:
                continue
            if over and (not rule.safety or over[1] == rule.name):
                yield over[0], "over"
                over = None
            yield rule.assigns[element], rule.name
        if over:
            yield over[0], "over"
        yield self.base[element], "base"
        for value in reversed(self.before.get(element, [])[-MOST_BEFORE:]):
            yield value, "base"

    def wanted(self, element: str) -> tuple[str, str]:
        """The value, and who wants it: stop, over, a rule, base, none."""
        for value, who in self._candidates(element):
            if who == "stop" or (element, value) not in self.rejected:
                return value, who
        return PARKED, "none"

    # ---- what happens

    def condition(self, name: str, *, holds: bool | None) -> None:
        """A rule's condition, after its dwell."""
        self.conditions[name] = holds
        if holds is True:
            self.active.add(name)
        elif holds is False and not self.rules[name].latch:
            self._end(name)

    def _end(self, name: str) -> None:
        self.active.discard(name)
        covered = {element for rule in self._ranked() for element in rule.assigns}
        self.over = {element: over for element, over in self.over.items() if element in covered}

    def load(self, rules: Iterable[ModelRule]) -> None:
        """Other rules in the place of these; those of the same name stay active."""
        self.rules = {rule.name: rule for rule in rules}
        self.conditions = {name: self.conditions.get(name) for name in self.rules}
        for name in self.active - set(self.rules):
            self._end(name)
        covered = {element for rule in self._ranked() for element in rule.assigns}
        self.over = {element: over for element, over in self.over.items() if element in covered}

    def request(self, element: str, value: str, *, over: str | None = None) -> bool:
        """A person's; `over`: above rules, and above the safety rule of that name. Whether it was taken."""
        holder = self.wanted(element)[1]
        is_free = holder in ("base", "over", "none", "stop")
        if not is_free and over is None:
            return False
        self.rejected.discard((element, value))
        if over is not None and not is_free:
            self.over[element] = (value, over)
        else:
            self.before.setdefault(element, []).append(self.base[element])
            self.base[element] = value
        return True

    def reject(self, element: str) -> None:
        """A probation or a fault: what is wanted now is not put in again."""
        value, who = self.wanted(element)
        if who not in ("none", "stop"):
            self.rejected.add((element, value))

    def reset(self, name: str) -> bool:
        """End a latched rule whose cause is gone."""
        if name not in self.active or self.conditions.get(name) is not False:
            return False
        self._end(name)
        return True
