"""A rules file as an executor runs it. An executor without rules does not load this module."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from mauve_rt._kernel import Host, RuleActions, RuleFacts, RuleRunner, monotonic_ns
from mauve_rt.control.judging import Judge, NotSchedulableError, protects
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.interfaces.told_decisions import DecisionMessages, own_rule_info
from mauve_rt.supervision.engine_rules import rule_specs
from mauve_rt.supervision.rule_actions import own_rules, rule_actions
from mauve_rt.supervision.rule_hearing import only_outside, own_leaves, unobservable
from mauve_rt.supervision.rules import Rule, RulesFile


@dataclass(frozen=True)
class LoadedRules:
    """The rules of a file that the executor runs itself, checked, and their prepared actions."""

    path: Path
    rules: Sequence[Rule]
    actions: Sequence[RuleActions]

    @classmethod
    def read(
        cls, path: Path, runtime: Runtime, *, topics: Callable[[Sequence[Rule]], Mapping[str, str]] | None
    ) -> Self:
        """Read and check a file; `topics` says which resource is bound to each topic: None checks no input.

        Raises:
            ArchitectureFileError: the executor cannot run it.
        """
        file = RulesFile(path, waits=False)  # requests wait for the one that reads it
        rules = own_rules(file)
        found_unobservable = [*only_outside(file)]
        if topics is not None:
            bound = topics(rules)
            found = (unobservable(file, leaf, runtime.host, bound) for leaf in own_leaves(file))
            found_unobservable += filter(None, found)
        if found_unobservable:
            raise ArchitectureFileError(file.path, found_unobservable)
        return cls(path, rules, rule_actions(file, runtime))

    def unschedulable(self, judge: Judge) -> list[str]:
        """The actions that are not schedulable, in words, where the executor only warns of them.

        Raises:
            NotSchedulableError: at these actions, where the executor requires that they are.
        """
        if not judge.requirement:
            return []
        file = RulesFile(self.path, waits=False)
        found = []
        for index, rule in enumerate(file.rules.rules):
            if rule.where == "executor" and not protects(rule.do):
                objection = judge.of_steps(rule.do, always=False).objection
                if objection:
                    place = ("rules", index, "do")
                    found.append(
                        file.problem(place, f"rule {rule.name}: its action is not proved: {objection}")
                    )
        if found and judge.requirement is True:
            raise NotSchedulableError(self.path, found)
        return [f"{self.path}:{each.line}:{each.column}: {each.text()}" for each in found]

    def runner(self, host: Host, topics: Mapping[str, str], before: RuleRunner | None) -> RuleRunner:
        """What runs them, not started yet; `before`: whose place it takes."""
        return RuleRunner(host, rule_specs(self.rules, with_reserve=True), self.actions, dict(topics), before)

    def messages(
        self, runtime: Runtime, released: Sequence[Rule], *, who: str, name: Callable[[str], str]
    ) -> DecisionMessages:
        """What makes messages of their decisions; `released`: of the runner, too."""
        return DecisionMessages([*self.rules, *released], runtime, who=who, name=name)

    @staticmethod
    def infos(facts: Sequence[RuleFacts]) -> list[Any]:
        """RuleInfo of each."""
        return [own_rule_info(each, monotonic_ns()) for each in facts]
