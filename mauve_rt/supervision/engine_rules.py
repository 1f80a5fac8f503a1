"""The rules of a file as the engine takes them."""

from collections.abc import Iterable

from mauve_rt._kernel import RuleSpec
from mauve_rt.supervision.effects import touched
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.when_spec import nanoseconds, when_spec


def rule_specs(rules: Iterable[Rule]) -> list[RuleSpec]:
    """In the order of the rules."""
    return [_rule_spec(rule) for rule in rules]


def _rule_spec(rule: Rule) -> RuleSpec:
    undo = rule.undo
    return RuleSpec(
        rule.name,
        when_spec(rule.when),
        for_ns=nanoseconds(rule.for_s),
        undoes=undo is not None,
        undo_for_ns=nanoseconds(undo.for_s) if undo is not None else 0,
        cooldown_ns=nanoseconds(rule.cooldown_s),
        priority=rule.priority,
        about=sorted(touched(rule.do) | touched(undo.do if undo is not None else ())),
    )
