"""The rules that an executor runs itself, in virtual time."""

from collections.abc import Callable, Mapping
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_rt._kernel import RuleRunner, Simulation
from mauve_rt.control.runtime import Runtime
from mauve_rt.interfaces.told_decisions import DecisionMessages, Done
from mauve_rt.simulation.topics import resolved, stamp
from mauve_rt.supervision.engine_rules import rule_specs
from mauve_rt.supervision.rule_actions import own_rules, rule_actions
from mauve_rt.supervision.rules import RulesFile

DECISIONS_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_NEVER_NS = 2**62


class SimulatedRules:
    """At work from the start on; they act at the instants at which they would on threads."""

    def __init__(
        self,
        simulation: Simulation,
        runtime: Runtime,
        file: RulesFile,
        heard: Mapping[str, str],
        *,
        name: str,
        namespace: str,
        tell: Callable[[Any, Done | None], None],
    ) -> None:
        """`heard`: the resource of each topic; `name`: of the executor; `tell` takes SupervisorDecision.

        Raises:
            MauveError: they cannot be used.
        """
        rules = own_rules(file)
        self.names = [rule.name for rule in rules]
        self._simulation = simulation
        self._tell = tell
        said = {str(leaf.parameters.get("topic") or "") for rule in rules for leaf in rule.when.leaves()}
        full = {topic: resolved(topic, namespace) for topic in said if topic}
        topics = {topic: heard[found] for topic, found in full.items() if found in heard}
        self._messages = DecisionMessages(
            rules, runtime, who=name, name=lambda topic: resolved(topic, namespace)
        )
        specs = rule_specs(rules, with_reserve=True)
        self._runner = RuleRunner(runtime.host, specs, rule_actions(file, runtime), topics)
        self._runner.start()
        self._due_ns = 0
        self.look()

    def look(self) -> None:
        """Something was heard: do what is due, and come back when something else is."""
        next_ns = self._runner.advance()
        for told in self._runner.wait_told(0):
            self._tell(*self._messages.message(told, stamp(told.decision.stamp_ns)))
        now_ns = self._simulation.now_ns()
        if next_ns < self._due_ns or self._due_ns <= now_ns:
            self._due_ns = next_ns
            if next_ns < _NEVER_NS:
                self._simulation.at(next_ns, self._look_when_due)

    def _look_when_due(self) -> None:
        if self._simulation.now_ns() >= self._due_ns:
            self.look()
