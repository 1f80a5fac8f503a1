"""What an executor's own rules decided, as messages: the decision, and the event of what it did."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from mauve_rt._kernel import NOT_MEASURED, RuleFacts, ToldDecision
from mauve_rt.control.reports import message_of, reports_of
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.wishes import step_of
from mauve_rt.interfaces.decisions import UNKNOWN_S, decision_message, rule_info
from mauve_rt.model.steps import Step
from mauve_rt.supervision.decisions import decision_of
from mauve_rt.supervision.rule_bounds import Bound, bound_of, reserve_bound_of
from mauve_rt.supervision.rules import Rule

DECISION_TYPE = "mauve_msgs/msg/SupervisorDecision"


class Done(NamedTuple):
    """An action that has ended, as who asks for one by a request is told."""

    request: Request
    outcome: Outcome


class DecisionMessages:
    """Of the rules of one RuleRunner. One thread at a time."""

    TYPE = DECISION_TYPE

    def __init__(
        self, rules: Sequence[Rule], runtime: Runtime, *, who: str, name: Callable[[str], str]
    ) -> None:
        """`who`: the executor's full name; `name`: the full name of a topic."""
        self._rules = rules
        self._runtime = runtime
        self._who = who
        self._name = name
        self._causes: dict[tuple[int, str], str] = {}  # by rule and act: why it was begun last

    def message(self, told: ToldDecision, stamp: Any) -> tuple[Any, Done | None]:
        """SupervisorDecision, and of an action that has ended what came of it."""
        made = told.decision
        rule = self._rules[made.rule]
        done = self._done(rule, told)
        decision = decision_of(
            made,
            self._rules,
            name=self._name,
            failure=told.failure,
            reason=_what_was_done(rule, told),
            revision=done.outcome.revision if done is not None else self._runtime.revision,
            message=done.outcome.message if done is not None else "",
        )
        if made.decision in ("do", "undo"):
            self._causes[made.rule, made.act] = f"{rule.name}: {decision.reason}"
        bound = self._bound(rule, made.act)
        total_s = bound.total_s if bound is not None else None
        bound_s = UNKNOWN_S if total_s is None else total_s
        return decision_message(decision, stamp, took_s=_took_s(told), bound_s=bound_s), done

    def lateness(self, told: ToldDecision, message: Any) -> str:
        """What of an action took longer than its bound, with its parts; empty: nothing."""
        if message.bound_s < 0 or message.took_s <= message.bound_s:
            return ""
        made = told.decision
        bound = self._bound(self._rules[made.rule], made.act)
        parts = ", ".join(f"{part.what} {part.seconds:.3f} s" for part in bound.parts) if bound else ""
        known_s = (made.stamp_ns - made.sample_ns - made.held_ns) / 1e9
        return (
            f"rule {message.rule}: {made.act} took {message.took_s:.3f} s, longer than its bound of "
            f"{message.bound_s:.3f} s ({parts}); its end was known {known_s:.3f} s after the cause"
        )

    def _done(self, rule: Rule, told: ToldDecision) -> Done | None:
        decision = told.decision
        if decision.act == "otherwise" or (told.report is None and not told.failure):
            return None
        steps = _steps_of(rule, told)
        revision = self._runtime.observe().revision
        if told.report is None:
            outcome = Outcome(code=Code.PREPARE_FAILED, message=told.failure, revision=revision)
        else:
            report = reports_of(steps, told.report)
            swaps = [step for step in report if step.to_core]
            only = swaps[0] if len(swaps) == 1 else None
            outcome = Outcome(
                code=Code.OK,
                message=message_of(steps, told.report),
                revision=revision,
                report=report,
                from_core=only.from_core if only is not None else "",
                to_core=only.to_core if only is not None else "",
            )
        cause = self._causes.get((decision.rule, decision.act), rule.name)
        return Done(Request(steps=steps, requested_by=self._who, cause=cause), outcome)

    def _bound(self, rule: Rule, act: str) -> Bound | None:
        periods = {part.name: part.period_ns / 1e9 for part in self._runtime.components()}
        if act == "otherwise":
            return reserve_bound_of(rule, periods)
        return bound_of(rule, periods, beside=self._rules, act=act)


def _steps_of(rule: Rule, told: ToldDecision) -> tuple[Step, ...]:
    """What was done: what the rule says of it, or what came back."""
    known = (*rule.do, *rule.steps("undo"))
    return tuple(step_of(step, known) for step in told.steps)


def _what_was_done(rule: Rule, told: ToldDecision) -> str:
    made = told.decision
    if made.decision != "done" or made.act == "otherwise":
        return ""
    return f"{made.act}: {', '.join(map(str, _steps_of(rule, told)))}"


def own_rule_info(facts: RuleFacts, now_ns: int) -> Any:
    """RuleInfo of a rule of the executor's own."""
    info = rule_info(facts.name, facts.status, now_ns, where="executor", problem=facts.problem)
    info.ready, info.memory_bytes = facts.ready, facts.memory_bytes
    return info


def _took_s(told: ToldDecision) -> float:
    """From the cause to the last of the first releases after it; of a reserve action to its end.

    Without the time for which it owed nothing.
    """
    made, report = told.decision, told.report
    if made.decision != "done":
        return UNKNOWN_S
    if made.act == "otherwise":
        return (made.stamp_ns - made.sample_ns) / 1e9
    steps = report.steps if report is not None else ()
    releases = [step.released_ns for step in steps if step.released_ns != NOT_MEASURED]
    return (max(releases) - made.sample_ns - made.held_ns) / 1e9 if releases else UNKNOWN_S
