"""An executor in virtual time: topics, ~/state, ~/events, requests and the bag, without node and threads."""

import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_rt._kernel import ComponentDescription, Simulation
from mauve_rt.control.control import Control
from mauve_rt.control.faults import FaultWatch
from mauve_rt.control.part_log import LogBundles
from mauve_rt.control.probations import ProbationWatch
from mauve_rt.control.recorded_values import RecordedValues, choose
from mauve_rt.control.requests import Outcome, Request
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.interfaces.descriptions import (
    architecture_state,
    component_infos,
    reconfiguration_event,
    resource_infos,
    trace_architecture,
)
from mauve_rt.interfaces.log_messages import LOG_TYPE, ROSOUT, log_message, logger_name
from mauve_rt.interfaces.qos import qos_profile, recorded_qos
from mauve_rt.interfaces.recorded_shadows import RecordedShadows
from mauve_rt.interfaces.told_decisions import DECISION_TYPE, Done
from mauve_rt.model import load_architecture
from mauve_rt.model.schema import ResourceModel, TopicModel
from mauve_rt.model.threads import uses_of
from mauve_rt.simulation.messages import serialize
from mauve_rt.simulation.rules import DECISIONS_QOS, SimulatedRules
from mauve_rt.simulation.topics import S, Sample, SimulatedTopics, in_virtual_time, resolved, stamp
from mauve_rt.supervision.rule_actions import rule_actions
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.trace.bag.recorded import SentMessage
from mauve_rt.trace.recording.trace_bag import TraceBag

_STATE_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_EVENT_QOS = QoSProfile(depth=100)
_ROSOUT_QOS = QoSProfile(depth=1000)


def _to_stderr(line: str) -> None:
    sys.stderr.write(f"{line}\n")


class _Outgoing(NamedTuple):
    topic: str
    type_name: str
    qos: QoSProfile


class SimulatedExecutor:
    """One architecture file at work. Whoever drives the simulation calls carry(), refresh() and record()."""

    def __init__(
        self,
        simulation: Simulation,
        topics: SimulatedTopics,
        architecture: Path,
        bag: Path,
        *,
        complain: Callable[[str], None],
        console: Callable[[str], None] = _to_stderr,
        rules: Path | None = None,
    ) -> None:
        """Configure the architecture; it joins the simulation, which is not deployed yet.

        `console`: takes the log lines of components and resources.
        `rules`: a rules file, of which it runs those that are `in: executor`.

        Raises:
            ArchitectureFileError: the file cannot be used.
            TraceError: the bag cannot be created.
        """
        self._rules: SimulatedRules | None = None
        self._simulation = simulation
        self._topics = topics
        self._runtime = SimulatedRuntime(simulation, lambda: load_architecture(architecture))
        self._runtime.configure()
        model = self._runtime.model
        self.namespace = model.namespace
        self.name = resolved("executor", model.namespace)
        self._control = Control(self._runtime)
        self._outgoing: dict[str, _Outgoing] = {}
        self._heard: dict[str, str] = {}  # the resource that takes the messages of each topic
        for resource, described in model.resources.items():
            if described.topic is not None:
                self._bind(resource, described, described.topic)
        self._published_revision = -1
        self._faults = FaultWatch()
        self._probations = ProbationWatch()
        self._waiting: list[SentMessage] = []
        self._received: Counter[str] = Counter()  # by topic
        self._refused: Counter[str] = Counter()
        self._architecture = b""
        self._log = LogBundles()
        self._console = console
        self._bag = TraceBag(self._runtime.host, bag, node_name=self.name, on_error=complain)
        self._values = RecordedValues(self._runtime, choose(self._runtime, model.recorded, self.name))
        self._values.keep_messages(on=True)
        self._shadows = RecordedShadows(self._runtime, self.name, serialize)
        self._rules_file = RulesFile(rules) if rules is not None else None
        if self._rules_file is not None:
            rule_actions(self._rules_file, self._runtime)  # whether they can be used
        for topic in ("state", "events", "decisions"):
            self.record_topic(f"{self.name}/{topic}")

    def _bind(self, resource: str, described: ResourceModel, bound: TopicModel) -> None:
        topic = resolved(bound.name, self.namespace)
        if bound.direction == "publish":
            qos = qos_profile(bound.qos, capacity=described.parameters.get("capacity", 0))
            self._outgoing[resource] = _Outgoing(topic, described.topic_type, qos)
            if (static := described.static_topic) is not None:
                topic = resolved(static.name, self.namespace)
                outgoing = _Outgoing(topic, described.topic_type, qos_profile(static.qos))
                self._outgoing[f"{resource}.static"] = outgoing
            return

        def receive(sample: Sample) -> None:
            self._runtime.host.write_resource(resource, sample.data)
            self._look_at_rules()

        self._heard[topic] = resource

        self._topics.listen(topic, receive)
        self.record_topic(topic)

    def record_topic(self, topic: str) -> None:
        """Record what is published on a topic."""
        self._topics.listen(topic, self._keep)

    def activate(self) -> None:
        """Start, with the others of the simulation."""
        self._runtime.activate()
        if self._rules_file is not None:
            self._rules = SimulatedRules(
                self._simulation,
                self._runtime,
                self._rules_file,
                self._heard,
                name=self.name,
                namespace=self.namespace,
                tell=self._decided,
            )
        self.refresh()

    def components(self) -> list[ComponentDescription]:
        """Every component as it is now."""
        return self._runtime.components()

    def listed(self) -> tuple[str, list[Any], list[Any]]:
        """As ~/list_components: instance, ComponentInfo and ResourceInfo of all, without ROS names."""
        return self._runtime.instance_id, component_infos(self._runtime), resource_infos(self._runtime, {})

    def handle(self, request: Request) -> Outcome:
        """Do what is asked, or nothing at all, now; ~/state and ~/events tell of it."""
        outcome = self._control.handle(request)
        self.refresh()
        self._event(request, outcome)
        return outcome

    def _event(self, request: Request, outcome: Outcome) -> None:
        now = stamp(self._simulation.now_ns())
        event = reconfiguration_event(request, outcome, stamp=now, instance_id=self._runtime.instance_id)
        self._say("events", "mauve_msgs/msg/ReconfigurationEvent", event, _EVENT_QOS)

    def _decided(self, message: Any, done: Done | None) -> None:
        self.refresh()
        self._say("decisions", DECISION_TYPE, message, DECISIONS_QOS)
        if done is not None:
            self._event(done.request, done.outcome)

    def _look_at_rules(self) -> None:
        if self._rules is not None:
            self._rules.look()

    def refresh(self) -> None:
        """Publish the state if it has changed, and that a fallback core took over."""
        observed = self._runtime.observe()
        if observed.revision != self._published_revision:
            rules = self._rules.names if self._rules is not None else ()
            now = stamp(self._simulation.now_ns())
            state = architecture_state(self._runtime, observed, now, rules=rules)
            self._published_revision = state.revision
            self._architecture = serialize(
                trace_architecture(self._runtime, observed, uses_of(self._runtime.model))
            )
            self._say("state", "mauve_msgs/msg/ArchitectureState", state, _STATE_QOS)
        for fault in self._faults.look(observed.components):
            if fault.part.fell_back:
                self._event(*fault.event(observed.revision))
        self._runtime.host.settle_probations()
        for verdict in self._probations.look(self._runtime.probations()):
            self._event(*verdict.event(self._runtime.observe().revision))
            if (request := self._control.way_back(verdict)) is not None:
                self.handle(request)

    def carry(self) -> None:
        """Publish what was written to bound resources; rules see what befell components."""
        self._look_at_rules()
        for resource, data, time_ns in self._runtime.host.wait_published(0):
            if (bound := self._outgoing.get(resource)) is None:
                continue  # static transforms that the file binds to no topic
            sample = Sample(bound.topic, bound.type_name, data, time_ns, bound.qos)
            self._keep(in_virtual_time(sample))
            self._topics.publish(sample)

    def record(self) -> None:
        """Move the trace and the messages since the last call into the bag."""
        self._write_log()
        waiting, self._waiting = self._waiting, []
        waiting += [*self._values.take_messages(), *self._shadows.take_messages()]
        drain = self._runtime.host.drain_trace()
        if self._architecture:
            self._bag.tell_architecture(self._architecture, drain)
        self._received.update(message.topic for message in waiting)
        self._refused += self._bag.write(drain, waiting, whole=True)
        self._bag.tell_ledger(self._received, self._refused)
        self._bag.tell_dropped(self._refused.total() + self._values.dropped_messages())

    def _write_log(self, *, last: bool = False) -> None:
        now_ns = self._simulation.now_ns()
        for line in self._log.take(self._runtime.take_log(), now_ns=now_ns, last=last):
            name = logger_name(self.name, line.part)
            self._console(f"[{line.level.upper()}] [{line.time_ns / S:.6f}] [{name}]: {line.text}")
            message = log_message(line, node=self.name, stamp=stamp(line.time_ns))
            sample = Sample(ROSOUT, LOG_TYPE, serialize(message), line.time_ns, _ROSOUT_QOS)
            self._keep(sample)
            self._topics.publish(sample)

    def flush(self) -> None:
        """Make the bag a finished one of what was recorded; waits for the disk."""
        self._bag.flush()

    def close(self) -> None:
        """Stop the components, send and record what they wrote last, seal the bag."""
        self._rules = None
        self._runtime.deactivate()
        self.carry()
        self.refresh()
        self._write_log(last=True)
        self.record()
        self._values.keep_messages(on=False)
        self._bag.close()

    def _keep(self, sample: Sample) -> None:
        qos = recorded_qos(sample.qos)
        self._waiting.append(SentMessage(sample.topic, sample.type_name, sample.data, sample.time_ns, qos))

    def _say(self, name: str, type_name: str, message: Any, qos: QoSProfile) -> None:
        now_ns = self._simulation.now_ns()
        self._topics.say(f"{self.name}/{name}", type_name, message, time_ns=now_ns, qos=qos)
