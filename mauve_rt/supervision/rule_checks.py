"""What is wrong with rules of good form: what can never be, contradicts itself or goes on for ever."""

from collections.abc import Iterator
from itertools import combinations

from mauve_rt.errors import Problem
from mauve_rt.supervision.condition_table import roles
from mauve_rt.supervision.effects import disagreement, touched
from mauve_rt.supervision.rule_logic import can_meet, clash_in
from mauve_rt.supervision.rules import Rule, RulesFile
from mauve_rt.supervision.when import COMBINATIONS, NOT, When
from mauve_rt.supervision.when_spec import heard


def logic_findings(file: RulesFile) -> list[Problem]:
    """What the rules say that cannot be meant, in the order of the file."""
    found = [*_impossible(file), *_endless(file), *_rivals(file), *_own_triggers(file), *_oscillations(file)]
    return sorted(found, key=lambda problem: (problem.line, problem.column))


def _impossible(file: RulesFile) -> Iterator[Problem]:
    for index, rule in enumerate(file.rules.rules):
        clash = clash_in(rule.when)
        if clash is not None:
            what = f"rule '{rule.name}' can never hold: {clash}"
            yield file.problem(("rules", index, "when"), what)
        yield from _unarmed(file, rule, rule.when)
        for node in rule.when.nodes():
            yield from _useless_times(file, rule, node)


def _endless(file: RulesFile) -> Iterator[Problem]:
    """Values that are beyond one of two bounds whatever they are, or for ever once they were."""
    for rule in file.rules.rules:
        for leaf in rule.when.leaves():
            above, below = leaf.parameters.get("above"), leaf.parameters.get("below")
            if above is None or below is None:
                continue
            place, between = (*leaf.place, leaf.kind), above - below
            if between < 0:
                what = f"rule '{rule.name}': every number is above {above:g} or below {below:g}"
                yield file.problem((*place, "above"), what, remedy="let above be the greater one")
            elif between < 2 * leaf.parameters["hysteresis"]:
                what = f"rule '{rule.name}': no number is so far within both bounds: it holds for ever"
                remedy = f"let hysteresis be no more than {between / 2:g}"
                yield file.problem((*place, "hysteresis"), what, remedy=remedy)


def _useless_times(file: RulesFile, rule: Rule, node: When) -> Iterator[Problem]:
    """A part within a shorter `within_s` cannot look further back than that."""
    for part in node.parts:
        if 0 < node.within_s < part.for_s:
            what = f"rule '{rule.name}': for_s {part.for_s:g} within {node.within_s:g} s looks back further"
            remedy = "let within_s be no shorter than for_s"
            yield file.problem((*part.place, "for_s"), what, remedy=remedy)


def _unarmed(file: RulesFile, rule: Rule, tree: When, *, negated: bool = False) -> Iterator[Problem]:
    """A rule is armed only while what it replaces or sets something of runs: not while that is FAULTED."""
    for part in tree.parts:
        yield from _unarmed(file, rule, part, negated=negated is not (tree.kind == NOT))
    if tree.kind in COMBINATIONS or negated:
        return
    signal, *_ = heard(tree)  # what it is about is the first
    if signal.kind == "state" and signal.target in rule.targets():
        what = (
            f"rule '{rule.name}' can never act: it waits until {signal.target} is FAULTED, "
            f"and for what it does {signal.target} has to run"
        )
        remedy = f"give {signal.target} a fallback core, or let the supervisor configure and start it"
        yield file.problem((*tree.place, tree.kind), what, remedy=remedy)


def _rivals(file: RulesFile) -> Iterator[Problem]:
    for (_, one), (index, other) in combinations(enumerate(file.rules.rules), 2):
        apart = disagreement(one.do, other.do)
        if apart is None or one.priority != other.priority or not can_meet(one.when, other.when):
            continue
        what = (
            f"rules '{one.name}' and '{other.name}' can hold at once and want different things "
            f"at equal priority ({one.priority}): the {apart.aspect} to be "
            f"'{apart.first.name or apart.first.kind}' and '{apart.second.name or apart.second.kind}'"
        )
        yield file.problem(("rules", index, "do"), what, remedy="give one of them a higher priority")


def _own_triggers(file: RulesFile) -> Iterator[Problem]:
    for rule in file.rules.rules:
        if rule.undo is None:
            continue
        for leaf in rule.when.leaves():
            is_change = any(signal.kind == "change" for signal in heard(leaf))
            if not is_change or not _heard(leaf) <= (touched(rule.do) | touched(rule.undo.do)):
                continue
            about = ", ".join(_heard(leaf)) or "any component"
            what = f"rule '{rule.name}' triggers itself: what it does and undoes is a change of {about}"
            remedy = "ask for the change of a component that the rule does not touch"
            yield file.problem((*leaf.place, leaf.kind), what, remedy=remedy)


def _oscillations(file: RulesFile) -> Iterator[Problem]:
    for index, rule in enumerate(file.rules.rules):
        if rule.undo is None or rule.cooldown_s > 0:
            continue
        own = {name for leaf in rule.when.leaves() for name in _heard(leaf)} & touched(rule.do)
        if own:
            names = ", ".join(sorted(own))
            what = (
                f"rule '{rule.name}' changes the input of its own condition ({names}), and has no cooldown_s"
            )
            remedy = "give it a cooldown_s, or it does and undoes for ever"
            yield file.problem(("rules", index, "when"), what, remedy=remedy)
        elif rule.undo.for_s == 0 and rule.for_s == 0:
            what = f"rule '{rule.name}' does and undoes as often as its condition changes"
            remedy = "give undo a for_s, or the rule a cooldown_s"
            yield file.problem(("rules", index, "undo"), what, remedy=remedy)


def _heard(leaf: When) -> set[str]:
    """Components that a condition is about."""
    named = (leaf.parameters.get(name) for name, role in roles(leaf.kind).items() if role == "component")
    return {str(name) for name in named if name}
