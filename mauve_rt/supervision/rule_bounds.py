"""How long at most from the cause of a rule to the first release of the new part, and what that assumes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from mauve_rt.supervision.condition_table import conditions
from mauve_rt.supervision.effects import touched
from mauve_rt.supervision.engine import CHECK_PERIOD_S
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.when import COMBINATIONS, NOT, When

SENT_S = 0.020  # assumed of a supervisor: it is late by no more, and its request arrives
BUILT_S = 0.200  # assumed of the executor, which builds the new part when it is asked


@dataclass(frozen=True)
class BoundPart:
    """One part of a bound; None: nobody can say how long."""

    what: str
    seconds: float | None
    assumed: bool = False


@dataclass(frozen=True)
class Bound:
    """The parts of a bound, in the order in which they pass."""

    parts: tuple[BoundPart, ...]

    @property
    def total_s(self) -> float | None:
        """All of it; None when a part is not known."""
        seconds = [part.seconds for part in self.parts]
        return None if None in seconds else sum(filter(None, seconds))

    @property
    def known_s(self) -> float:
        """What is known of it."""
        return sum(part.seconds or 0.0 for part in self.parts)


def bound_of(rule: Rule, periods_s: Mapping[str, float]) -> Bound:
    """The bound of a rule's `do`; `periods_s`: of components, as far as they are known."""
    parts = [*_noticing(rule.when, periods_s)]
    if rule.for_s > 0:
        parts.append(BoundPart("for_s of the rule", rule.for_s))
    looks = _looks(rule)
    parts.append(BoundPart(f"{looks} looks of the supervisor", looks * CHECK_PERIOD_S))
    parts.append(BoundPart("the supervisor runs, and its request arrives", SENT_S, assumed=True))
    parts.append(BoundPart("the executor builds, checks and commits", BUILT_S, assumed=True))
    parts += _release(rule, periods_s)
    return Bound(tuple(parts))


def _looks(rule: Rule) -> int:
    """A silence is believed at the second look; what must last is counted from a look and ends at one."""
    return 2 + (rule.for_s > 0) + sum(node.for_s > 0 for node in rule.when.nodes())


def _release(rule: Rule, periods_s: Mapping[str, float]) -> Iterator[BoundPart]:
    names = sorted(touched(rule.do))
    missing = [name for name in names if name not in periods_s]
    if missing:
        yield BoundPart(f"one period of {', '.join(missing)} (not known: give --architecture)", None)
    elif names:
        slowest = max(names, key=lambda name: periods_s[name])
        yield BoundPart(f"one period of {slowest}", periods_s[slowest])


def _noticing(tree: When, periods_s: Mapping[str, float]) -> list[BoundPart]:
    """From the last thing that makes the tree true to the instant at which it is seen to hold."""
    if tree.kind == NOT:
        parts = [] if tree.parts[0].kind in COMBINATIONS else [BoundPart(f"not {_words(tree.parts[0])}", 0.0)]
    elif tree.kind in COMBINATIONS:
        each = [_noticing(part, periods_s) for part in tree.parts]
        parts = max(each, key=_seconds, default=[])
    else:
        parts = [BoundPart(_words(tree), _age(tree, periods_s))]
    if tree.for_s > 0:
        parts = [*parts, BoundPart(f"for_s of {tree.kind}", tree.for_s)]
    return parts


def _seconds(parts: list[BoundPart]) -> float:
    return float("inf") if any(part.seconds is None for part in parts) else Bound(tuple(parts)).known_s


def _age(leaf: When, periods_s: Mapping[str, float]) -> float | None:
    """How old the cause is when the condition holds: 0 of what an event tells."""
    if "periods" in leaf.parameters:
        period_s = periods_s.get(str(leaf.parameters.get("component")))
        return None if period_s is None else float(leaf.parameters["periods"]) * period_s
    return float(leaf.parameters.get("longer_than_s", 0.0))


def _words(leaf: When) -> str:
    known = conditions()[leaf.kind].parameters
    said = [str(leaf.parameters[name]) for name in known if leaf.parameters.get(name) not in ("", None)]
    return " ".join([leaf.kind, *said[:1]])
