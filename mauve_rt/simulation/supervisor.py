"""A supervisor in virtual time: the rules of a file at work on an executor of the same simulation."""

from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_rt._kernel import Simulation
from mauve_rt.control.requests import Request
from mauve_rt.interfaces.decisions import architecture_view, decision_message, inventory
from mauve_rt.interfaces.outside_feeds import Kept, OutsideFeeds
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.topics import Sample, SimulatedTopics, resolved, stamp
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.remote_rules import RemoteRules
from mauve_rt.supervision.rules import RulesFile

_DECISIONS_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_NEVER_NS = 2**62


class SimulatedSupervisor:
    """In the namespace of its executor. It looks at its rules at the instants at which a node would."""

    def __init__(
        self, simulation: Simulation, topics: SimulatedTopics, executor: SimulatedExecutor, rules: Path
    ) -> None:
        """Listen to what the rules look at; the executor must not have been activated yet.

        Raises:
            ArchitectureFileError: the rules cannot be used.
        """
        self._simulation = simulation
        self._topics = topics
        self._executor = executor
        self.name = resolved("supervisor", executor.namespace)
        self.decisions = f"{self.name}/decisions"
        file = RulesFile(rules)
        self._rules = RemoteRules(
            file.rules.rules,
            act=self._act,
            decide=self._decide,
            look=self._look,
            ids=(f"{self.name}/{number}" for number in count(1)),
            name=self._full_name,
        )
        self._due_ns = _NEVER_NS
        self._ended = False
        self._feeds = OutsideFeeds(file, self._rules, listen=self._listen, now_ns=simulation.now_ns)
        topics.listen(f"{executor.name}/state", self._on_state)

    def close(self) -> None:
        """Look no longer: that the executor stops is no business of the rules."""
        self._ended = True

    def _full_name(self, topic: str) -> str:
        return resolved(topic, self._executor.namespace)

    def _listen(
        self, topic: str, message: Any, heard: Callable[[Any], None], *, raw: bool, kept: Kept = "no"
    ) -> None:
        del message, kept  # whoever listens does so from the start on

        def hear(sample: Sample) -> None:
            heard(sample.data if raw else sample.message())
            if self._rules.is_stirred:
                self._tick()

        self._topics.listen(self._full_name(topic), hear)

    def _on_state(self, sample: Sample) -> None:
        if not self._ended:
            self._rules.on_state(self._simulation.now_ns(), architecture_view(sample.message()))
            self._tick()

    def _tick(self) -> None:
        """Look at the rules now, and again when that has to be."""
        if self._ended:
            return
        feeds_due_ns = self._feeds.tick()
        due_ns = self._rules.tick(self._simulation.now_ns())
        if feeds_due_ns is not None:
            due_ns = min(due_ns, feeds_due_ns)
        if due_ns < _NEVER_NS and due_ns != self._due_ns:
            self._simulation.at(due_ns, self._tick_when_due)
        self._due_ns = due_ns

    def _tick_when_due(self) -> None:
        if self._simulation.now_ns() >= self._due_ns:
            self._tick()

    def _look(self) -> None:
        self._rules.on_inventory(self._simulation.now_ns(), inventory(*self._executor.listed()))

    def _act(self, request: Request) -> None:
        outcome = self._executor.handle(replace(request, requested_by=self.name))
        self._rules.on_outcome(self._simulation.now_ns(), request.request_id, outcome)

    def _decide(self, decision: Decision) -> None:
        now_ns = self._simulation.now_ns()
        message = decision_message(decision, stamp(now_ns))
        type_name = "mauve_msgs/msg/SupervisorDecision"
        self._topics.say(self.decisions, type_name, message, time_ns=now_ns, qos=_DECISIONS_QOS)
