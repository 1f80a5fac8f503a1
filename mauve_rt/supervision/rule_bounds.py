"""How long at most from the cause of a rule to the first release of the new part, and what that assumes.

In the executor: what the condition itself names as a time passes, or what happened is told at once; the
thread of the rules decides and commits a transaction that was ready. A component that does not overrun
comes to its wait before its next instant, where it goes on as the new part: it is released within one of
its periods from then on. Where the instant comes while the commit is on its way the component goes, and
is released anew one period later: so the time of the commit counts, and one period. Several components
each agree in a wait of their own, so the last one agrees within one period of the slowest. Each component
then takes its new part at its next release, within one period more.

In the supervisor the request travels and the new part is built when it is asked for; both are assumed.

Other rules and their components have no part in that, whatever they do: each rule has threads of its own.
But a rule of no higher rank about one of the same components may be in the middle of its action: that is
called off, and an adopt that does not end is given up after `CALLED_OFF_S`. A rule about one of the same
components, of whatever rank, that has just acted leaves another component behind: the new part is built
again. And two rules that add, remove or wire something commit one after the other.

Not counted is a request of a person about one of the same components, which holds them while it prepares.

A reserve action waits for nothing: it stops its components, and gives up those that still execute.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.supervision.condition_table import parameters_of
from mauve_rt.supervision.effects import touched
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.when import COMBINATIONS, NOT, When
from mauve_rt.supervision.when_spec import heard

WOKEN_S = (
    0.001  # assumed of the executor: its thread of the rules decides, commits, and the component wakes up
)
FOLLOWED_S = 0.020  # assumed of the executor's ordinary thread, which sees that the architecture changed
SENT_S = 0.020  # assumed of a supervisor: it is late by no more, and its request arrives
BUILT_S = 0.200  # assumed of the executor, which builds the new part
CALLED_OFF_S = 0.100  # the kernel's patience with an adopt or take under way
TIMEOUT_S = 1.0  # of the kernel's commits
RESERVE_S: Mapping[str, float] = {"stop": 0.050, "safe_outputs": 0.001}  # the patience of rules/reserve.hpp
TOLD_S = 1.0  # assumed of who sends /diagnostics, or of another executor's state: at least so often


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


def bound_of(
    rule: Rule, periods_s: Mapping[str, float], *, beside: Iterable[Rule] = (), act: str = "do"
) -> Bound:
    """The bound of what a rule does or undoes, from what made its condition true, or false.

    `periods_s`: of components, as far as they are known; 0: it has none. `beside`: the other rules of the
    executor; the rule itself may be among them.
    """
    noticing = _noticing(rule.when, periods_s, negated=act == "undo")
    return Bound((*noticing, *_reaction(rule, periods_s, act=act), *_beside(rule, beside)))


def reserve_bound_of(rule: Rule, periods_s: Mapping[str, float]) -> Bound | None:
    """The bound of a rule's reserve action, from the cause to safe outputs; None: it has none."""
    if rule.otherwise is None:
        return None
    waits = [BoundPart("for_s of the rule", rule.for_s)] if rule.for_s > 0 else []
    return Bound(
        (
            *_noticing(rule.when, periods_s),
            *waits,
            BoundPart("otherwise_after_s", rule.otherwise_after_s),
            BoundPart("the executor decides, and makes outputs safe", WOKEN_S, assumed=True),
            BoundPart(f"{rule.otherwise}: who still executes then is given up", RESERVE_S[rule.otherwise]),
        )
    )


def _beside(rule: Rule, others: Iterable[Rule]) -> Iterator[BoundPart]:
    """What other rules of the executor can add."""
    if rule.where != "executor":
        return
    own = [other for other in others if other.where == "executor" and other.name != rule.name]
    rivals = [each for each in own if _about(rule) & _about(each)]
    lower = [each.name for each in rivals if _rank(each) <= _rank(rule)]
    if lower:
        yield BoundPart(f"until the action of {', '.join(lower)} is called off", CALLED_OFF_S)
    if rivals:
        names = ", ".join(each.name for each in rivals)
        what = f"until the new part is built again, where {names} has just acted"
        yield BoundPart(what, BUILT_S, assumed=True)
    wiring = [each.name for each in own if _wires(each)] if _wires(rule) else []
    if wiring:
        what = f"until {', '.join(wiring)} let go of the architecture's structure"
        yield BoundPart(what, TIMEOUT_S * len(wiring))


def _rank(rule: Rule) -> tuple[bool, int]:
    return rule.safety, rule.priority


def _about(rule: Rule) -> set[str]:
    return touched(rule.do) | touched(rule.steps("undo"))


def _wires(rule: Rule) -> bool:
    return any(STEP_KINDS[step.kind].is_structural for step in (*rule.do, *rule.steps("undo")))


def _reaction(rule: Rule, periods_s: Mapping[str, float], *, act: str = "do") -> Iterator[BoundPart]:
    for_s = rule.for_s if act == "do" or rule.undo is None else rule.undo.for_s
    if for_s > 0:
        yield BoundPart("for_s of the rule", for_s)
    if rule.where == "executor":
        yield BoundPart("the executor decides, commits and wakes up", WOKEN_S, assumed=True)
    else:
        yield BoundPart("the supervisor runs, and its request arrives", SENT_S, assumed=True)
        yield BoundPart("the executor builds, checks and commits", BUILT_S, assumed=True)
    about = touched(rule.do) if act == "do" else _about(rule)
    yield from _release(sorted(about), periods_s)


def _release(names: list[str], periods_s: Mapping[str, float]) -> Iterator[BoundPart]:
    """Until the last of these components is released."""
    missing = ", ".join(name for name in names if name not in periods_s)
    timeless = ", ".join(name for name in names if periods_s.get(name) == 0)
    if missing:
        yield BoundPart(f"one period of {missing} (not known: give --architecture)", None)
    elif timeless:
        yield BoundPart(f"the next event of {timeless}, which has no period", None)
    elif names:
        slowest = max(names, key=lambda name: periods_s[name])
        if len(names) > 1:
            agreed = f"until {', '.join(names)} have agreed, each in its wait: one period of {slowest}"
            yield BoundPart(agreed, periods_s[slowest])
        yield BoundPart(f"one period of {slowest}", periods_s[slowest])


def _noticing(tree: When, periods_s: Mapping[str, float], *, negated: bool = False) -> list[BoundPart]:
    """From the last thing that makes the tree true (or false) to the instant at which it is."""
    if tree.kind in COMBINATIONS:
        inside = negated is not (tree.kind == NOT)
        each = [_noticing(part, periods_s, negated=inside) for part in tree.parts]
        parts = max(each, key=_seconds, default=[])
    else:
        parts = _of_leaf(tree, periods_s, negated=negated)
    if tree.for_s > 0 and not negated:
        parts = [*parts, BoundPart(f"for_s of {tree.kind}", tree.for_s)]
    if tree.within_s > 0 and negated:
        parts = [*parts, BoundPart(f"within_s of {tree.kind}", tree.within_s)]
    return parts


def _seconds(parts: list[BoundPart]) -> float:
    return float("inf") if any(part.seconds is None for part in parts) else Bound(tuple(parts)).known_s


def _of_leaf(leaf: When, periods_s: Mapping[str, float], *, negated: bool) -> list[BoundPart]:
    parts = [
        BoundPart(f"not {_words(leaf)}" if negated else _words(leaf), _age(leaf, periods_s, negated=negated))
    ]
    signals = heard(leaf)
    if any(signal.kind == "change" for signal in signals):
        parts.append(BoundPart("the executor sees what was changed", FOLLOWED_S, assumed=True))
    if any(signal.kind in ("diagnostic", "peer") for signal in signals):
        parts.append(BoundPart("who tells it tells it", TOLD_S, assumed=True))
    return parts


def _age(leaf: When, periods_s: Mapping[str, float], *, negated: bool) -> float | None:
    """How old the cause is when the condition comes to hold, or to hold no more: 0 of what an event tells."""
    told = leaf.parameters
    if "at_least" in told:  # so many within a time: the last of them is the cause, or that they are past
        return float(told["within_s"]) if negated else 0.0
    if negated:
        return 0.0
    if "periods" in told:
        period_s = periods_s.get(str(told.get("component")))
        return None if period_s is None else float(told["periods"]) * period_s
    return float(told.get("longer_than_s") or 0.0)


def _words(leaf: When) -> str:
    said = [
        str(leaf.parameters[name])
        for name in parameters_of(leaf.kind)
        if leaf.parameters.get(name) not in ("", None)
    ]
    return " ".join([leaf.kind, *said[:1]])
