"""What a rule decided and why, in words for people. Knows no ROS."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from mauve_rt._kernel import RuleDecision
from mauve_rt.supervision.effects import touched
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.when import COMBINATIONS, NOT, When

Name = Callable[[str], str]  # a topic's full name
_JOINED: Mapping[str, str] = {"all": " and ", "any": " or "}


class Words(NamedTuple):
    """What a condition says of one thing, where it holds and where it does not; `{}`: what is measured."""

    holds: str
    else_: str


# Of each kind of condition; `{name}`: what it was told. One that is not here is told by its name.
_WORDS: Mapping[str, Words] = {
    "silence": Words("nothing on {of} for {measured:.2f} s", "samples on {of}"),
    "link_silence": Words("nothing arrived on {of} for {measured:.2f} s", "messages arrive on {of}"),
    "value": Words("{field} of {of} is {measured:g}", "{field} of {of} is {measured:g}"),
    "boolean": Words("{of} says so", "{of} says otherwise"),
    "overruns": Words("{component} has overrun", "{component} overruns no more"),
    "late": Words("{component} is late in its {what}", "{component} is in time again"),
    "no_release": Words("{component} was not released for {measured:.3g} s", "{component} is released again"),
    "fault": Words("{component} is faulted", "{component} is not faulted"),
    "over_declared": Words(
        "{component} has executed longer than declared", "{component} keeps to what it declares"
    ),
    "peer": Words("executor {executor}: {is}", "executor {executor}: no longer {is}"),
    "diagnostic": Words("diagnostic '{status}' says {level} or worse", "diagnostic '{status}' is better"),
    "since_change": Words("{of} unchanged for {measured:.2f} s", "{of} has changed"),
    "node_silent": Words("Python silent for {measured:.2f} s", "Python works"),
    "action": Words("a goal of {of} is {is}", "no goal of {of} is {is}"),
}


_HOLDS = {"condition_true": True, "condition_false": False, "condition_unknown": None}
_FIXED = {
    "armed": "watching",
    "adopted": "it is active since before: undone when it is time",
}


# The engine's words of why not, where another rule has a name.
_WITH_OTHER: Mapping[str, str] = {
    "outranked by a rule of higher rank": "outranked by rule {name} (priority {priority})",
    "the action of another rule is under way": "the action of rule {name} is under way",
}


def reason_of(decision: RuleDecision, rules: Sequence[Rule], *, name: Name = str, failure: str = "") -> str:
    """Why, in words; `failure`: of an action that failed."""
    if decision.decision in _FIXED:
        return _FIXED[decision.decision]
    rule = rules[decision.rule]
    kind, act = decision.decision, decision.act
    measured = decision.measured
    lasted_s = max(decision.stamp_ns - decision.cause_ns, 0) / 1e9
    what = _reserve_words(rule) if act == "otherwise" else ", ".join(str(step) for step in rule.steps(act))
    match kind:
        case "condition_true" | "condition_false" | "condition_unknown":
            return condition_words(rule.when, holds=_HOLDS[kind], measured=measured, name=name)
        case "do" | "undo":
            said = condition_words(rule.when, holds=kind == "do", measured=measured, name=name)
            return f"{said} for {lasted_s:.2f} s" if kind == "undo" else said
        case "otherwise":
            return f"do is not in effect {rule.otherwise_after_s:g} s after it was due: {what}"
        case "done":
            return f"{act}: {what or 'what was there before'}"
        case _:
            return _not_done(decision, rules, failure)


def _reserve_words(rule: Rule) -> str:
    about = touched(rule.do) | touched(rule.steps("undo"))
    return f"{rule.otherwise} {', '.join(sorted(about))}"


def _not_done(decision: RuleDecision, rules: Sequence[Rule], failure: str) -> str:
    if decision.decision == "failed":
        again = f"; next try in {decision.wait_ns / 1e9:.2f} s if still needed"
        return f"{decision.act} failed: {failure or decision.why}{again}"
    if not decision.why:
        return "what it is about does not run: watching again once it does"
    why = decision.why
    if decision.other is not None and why in _WITH_OTHER:
        other = rules[decision.other]
        why = _WITH_OTHER[why].format(name=other.name, priority=other.priority)
    waits = f" for {decision.wait_ns / 1e9:.2f} s" if decision.wait_ns > 0 else ""
    return f"no {decision.act}: {why}{waits}"


def condition_words(when: When, *, holds: bool | None, measured: float, name: Name = str) -> str:
    """A condition, as it is (None: unknown); of several, which they are."""
    if holds is None:
        return f"not known now: {tree_words(when, name=name)}"
    if when.kind not in COMBINATIONS:
        return _leaf_words(when, holds=holds, measured=measured, name=name)
    said = tree_words(when, name=name)
    return said if holds else f"no longer: {said}"


def tree_words(when: When, *, name: Name = str) -> str:
    """What a tree waits for."""
    if when.kind not in COMBINATIONS:
        what = str(when.parameters.get("field") or when.kind)
        if when.kind == "action":
            what = f"{when.parameters['is']} goal"
        return " ".join(word for word in (what, "of", _target(when, name), _bound(when)) if word)
    parts = [tree_words(part, name=name) for part in when.parts]
    if when.kind == NOT:
        return f"not {parts[0]}"
    if when.kind in _JOINED:
        return f"({_JOINED[when.kind].join(parts)})" if len(parts) > 1 else parts[0]
    return f"{when.count} of ({', '.join(parts)})"


def _leaf_words(when: When, *, holds: bool, measured: float, name: Name) -> str:
    words = _WORDS.get(when.kind)
    if words is None:
        return tree_words(when, name=name)
    told = {**when.parameters, "of": _target(when, name), "measured": measured}
    return (words.holds if holds else words.else_).format(**told)


def _target(when: When, name: Name) -> str:
    told = when.parameters
    if told.get("topic"):
        return name(str(told["topic"]))
    for key in ("resource", "component", "executor", "status"):
        if told.get(key):
            return str(told[key])
    return "the architecture"


def _bound(when: When) -> str:
    told = when.parameters
    signs = (("longer_than_s", "longer than {} s"), ("above", "above {}"), ("below", "below {}"))
    return " or ".join(text.format(f"{told[key]:g}") for key, text in signs if told.get(key) is not None)
