"""The rules of a file as the engine takes them."""

from collections.abc import Iterable

from mauve_rt._kernel import RuleSpec
from mauve_rt.supervision.effects import touched
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.when_spec import nanoseconds, when_spec


def rule_specs(rules: Iterable[Rule], *, with_reserve: bool = False) -> list[RuleSpec]:
    """In the order of the rules; `with_reserve`: who runs them can carry out `otherwise`."""
    return [_rule_spec(rule, with_reserve=with_reserve) for rule in rules]


def _rule_spec(rule: Rule, *, with_reserve: bool) -> RuleSpec:
    undo = rule.undo
    has_reserve = with_reserve and rule.otherwise is not None
    return RuleSpec(
        rule.name,
        when_spec(rule.when),
        for_ns=nanoseconds(rule.for_s),
        undoes=undo is not None,
        undo_for_ns=nanoseconds(undo.for_s) if undo is not None else 0,
        cooldown_ns=nanoseconds(rule.cooldown_s),
        priority=rule.priority,
        about=sorted(touched(rule.do) | touched(undo.do if undo is not None else ())),
        otherwise_after_ns=nanoseconds(rule.otherwise_after_s) if has_reserve else None,
        safety=rule.safety,
        latch=rule.latch,
    )
