"""A supervisor in virtual time: the rules of a file at work on an executor of the same simulation."""

from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_rt._kernel import Simulation
from mauve_rt.control.requests import Request
from mauve_rt.interfaces.decisions import architecture_view, decision_message, inventory
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.topics import Sample, SimulatedTopics, resolved, stamp
from mauve_rt.supervision.condition_tree import TreeCondition
from mauve_rt.supervision.conditions import TopicCondition, topic_condition
from mauve_rt.supervision.engine import Decision, RuleEngine
from mauve_rt.supervision.message_fields import field_value
from mauve_rt.supervision.rule_types import heard_type
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when import When

_DECISIONS_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class SimulatedSupervisor:
    """In the namespace of its executor. Whoever drives the simulation calls tick() at 20 Hz or more."""

    def __init__(
        self, simulation: Simulation, topics: SimulatedTopics, executor: SimulatedExecutor, rules: Path
    ) -> None:
        """Listen to the topics of the rules; the executor must not have been activated yet.

        Raises:
            ArchitectureFileError: the rules cannot be used.
        """
        self._simulation = simulation
        self._topics = topics
        self._executor = executor
        self.name = resolved("supervisor", executor.namespace)
        self.decisions = f"{self.name}/decisions"
        file = RulesFile(rules)
        pairs = [
            (rule, TreeCondition(rule.when, lambda leaf: self._condition(file, leaf)))
            for rule in file.rules.rules
        ]
        ids = (f"{self.name}/{number}" for number in count(1))
        self._engine = RuleEngine(pairs, act=self._act, decide=self._decide, look=self._look, ids=ids)
        self._ended = False
        topics.listen(f"{executor.name}/state", self._on_state)

    def tick(self) -> None:
        """Check the rules."""
        self._engine.tick(self._now_s())

    def close(self) -> None:
        """Look no longer: that the executor stops is no business of the rules."""
        self._ended = True

    def _on_state(self, sample: Sample) -> None:
        if not self._ended:
            self._engine.on_state(self._now_s(), architecture_view(sample.message()))

    def _now_s(self) -> float:
        return self._simulation.now_ns() / 1e9

    def _condition(self, file: RulesFile, leaf: When) -> TopicCondition:
        heard_type(file, leaf)
        topic = resolved(leaf.parameters["topic"], self._executor.namespace)
        condition = topic_condition(leaf, topic)
        self._topics.listen(topic, self._hearer(condition, leaf.parameters.get("field", "")))
        return condition

    def _hearer(self, condition: TopicCondition, path: str) -> Callable[[Sample], None]:
        if path:
            return lambda sample: condition.hear(self._now_s(), field_value(sample.message(), path))
        return lambda _sample: condition.hear(self._now_s())

    def _look(self) -> None:
        self._engine.on_inventory(self._now_s(), inventory(*self._executor.listed()))

    def _act(self, request: Request) -> None:
        outcome = self._executor.handle(replace(request, requested_by=self.name))
        self._engine.on_outcome(self._now_s(), request.request_id, outcome)

    def _decide(self, decision: Decision) -> None:
        now_ns = self._simulation.now_ns()
        message = decision_message(decision, stamp(now_ns))
        type_name = "mauve_msgs/msg/SupervisorDecision"
        self._topics.say(self.decisions, type_name, message, time_ns=now_ns, qos=_DECISIONS_QOS)
