"""The supervisor node: reconfigures one executor by the rules of a file, and tells every decision.

It listens to the executor's ~/state and to what its rules look at (serialized, but where a field is looked
at), looks at the rules when something of interest was heard and at the instant at which something may become
true, asks by ~/reconfigure and publishes ~/decisions. One thread.
"""

import threading
import time
import uuid
from collections.abc import Callable, Sequence
from functools import partial
from itertools import count
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from mauve_msgs.msg import ArchitectureState, ReconfigurationStep, SupervisorDecision
from mauve_msgs.srv import ListComponents, ListRules, Reconfigure, WriteSnapshot
from mauve_rt.control.requests import Request
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.interfaces.decisions import (
    architecture_view,
    decision_message,
    inventory,
    outcome_of,
    rule_info,
)
from mauve_rt.interfaces.outside_feeds import Kept, OutsideFeeds
from mauve_rt.node.shared.announcement import first_participant
from mauve_rt.node.shared.background_console import init_logging_apart, last_lines
from mauve_rt.node.shared.late_peers import LatePeers
from mauve_rt.node.shared.loopback import reach, udp_sockets
from mauve_rt.node.shared.network_interfaces import NetworkInterfaces, usable_addresses
from mauve_rt.node.shared.process import BAD_INPUT, complain
from mauve_rt.node.shared.ros_start import RosStart
from mauve_rt.node.shared.setting_parameters import NO_SIMULATED_TIME, declare_settings
from mauve_rt.node.shared.watch import Watch
from mauve_rt.node.supervisor.only_one import OnlyOne
from mauve_rt.node.supervisor.settings import PARAMETERS, settings_of
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.remote_rules import RemoteRules
from mauve_rt.supervision.rules import RulesFile

NODE_NAME = "supervisor"
_SPIN_S = 0.2  # how long a stop may go unnoticed
_LONGEST_S = 3600.0  # between two looks at the rules
KEPT_DECISIONS = 100


class Supervisor:
    """The rules of a file at work on a node. Every method runs on the thread that spins the node."""

    def __init__(self, node: Node, rules_file: RulesFile) -> None:
        """Create subscriptions, client and publisher.

        Raises:
            ArchitectureFileError: a rule names a message type that is not installed.
        """
        self._node = node
        self.watch = watch = Watch(node.get_logger().error)
        self._pending: dict[Any, Any] = {}  # by client (changes, dry runs): the last call
        self._rules = RemoteRules(
            rules_file.rules.rules,
            act=self._act,
            decide=self._decide,
            look=self._look,
            ids=(str(uuid.uuid4()) for _ in count()),
            name=node.resolve_topic_name,
            release_on_loss=rules_file.rules.on_supervisor_loss == "release",
        )
        latched = DurabilityPolicy.TRANSIENT_LOCAL
        self._decisions = node.create_publisher(
            SupervisorDecision, "~/decisions", QoSProfile(depth=KEPT_DECISIONS, durability=latched)
        )
        executor = node.resolve_topic_name(rules_file.rules.executor)  # so `-r executor:=boss` names another
        self._service = node.resolve_service_name(f"{executor}/reconfigure")
        self._change = node.create_client(Reconfigure, f"{executor}/reconfigure")
        self._try = node.create_client(Reconfigure, f"{executor}/reconfigure")
        self._snapshot = node.create_client(WriteSnapshot, f"{executor}/write_snapshot")
        self._snapshot_rules = {rule.name for rule in rules_file.rules.rules if rule.snapshot}
        self._list = node.create_client(ListComponents, f"{executor}/list_components")
        self._timer = node.create_timer(
            _LONGEST_S, watch.guarded("the rules", self._tick), clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        node.create_service(ListRules, "~/list_rules", self._list_rules)
        self._feeds = OutsideFeeds(rules_file, self._rules, listen=self._listen, now_ns=time.monotonic_ns)
        self._listen(f"{executor}/state", ArchitectureState, self._on_state, raw=False, kept="all")

    def _listen(
        self, topic: str, message: Any, heard: Callable[[Any], None], *, raw: bool, kept: Kept = "no"
    ) -> None:
        newest_ns = 0  # by the writers' clocks

        def hear(sample: Any, info: Any) -> None:
            nonlocal newest_ns
            newest_ns = max(newest_ns, info["source_timestamp"])
            heard(sample)
            if kept == "all" or self._rules.is_stirred:
                self._tick()

        def hear_kept(sample: Any, info: Any) -> None:
            if info["source_timestamp"] > newest_ns:  # else it was heard by best effort
                hear(sample, info)

        def subscribe(qos: QoSProfile, hear: Callable[[Any, Any], None], events: Any = None) -> None:
            guarded = self.watch.guarded(topic, hear)

            def callback(sample: Any, info: Any) -> None:  # rclpy counts its parameters
                guarded(sample, info)

            taken: Any = callback  # its stubs know one parameter only
            self._node.create_subscription(message, topic, taken, qos, raw=raw, event_callbacks=events)

        keeping = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        if kept == "all":
            events = SubscriptionEventCallbacks(liveliness=partial(self._on_liveliness, topic))
            subscribe(keeping, hear, events)
            return
        # Best effort hears reliable writers too; only that something came counts.
        subscribe(QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT), hear)
        if kept == "some":  # that it receives nothing from other writers is no news
            subscribe(keeping, hear_kept, SubscriptionEventCallbacks(use_default_callbacks=False))

    def _on_liveliness(self, topic: str, event: Any) -> None:
        """Sooner than silence tells, where the middleware does at all."""
        if event.alive_count == 0:
            self._feeds.lost(topic.removesuffix("/state"))
            self._tick()

    def _tick(self) -> None:
        """Look at the rules now, and again when that has to be."""
        feeds_due_ns = self._feeds.tick()
        due_ns = self._rules.tick(time.monotonic_ns())
        if feeds_due_ns is not None:
            due_ns = min(due_ns, feeds_due_ns)
        left_ns = due_ns - time.monotonic_ns()
        self._timer.timer_period_ns = min(max(left_ns, 0), round(_LONGEST_S * 1e9))
        self._timer.reset()

    def _on_state(self, state: Any) -> None:
        self._rules.on_state(time.monotonic_ns(), architecture_view(state))

    def _list_rules(self, _request: Any, reply: Any) -> Any:
        now_ns = time.monotonic_ns()
        reply.rules = [
            rule_info(name, status, now_ns, where=NODE_NAME, problem=problem)
            for name, status, problem in self._rules.standings()
        ]
        return reply

    def _look(self) -> None:
        if self._list.service_is_ready():  # if not, the engine looks again
            on_list = self.watch.guarded("the executor's list", self._on_list)
            self._call(self._list, ListComponents.Request()).add_done_callback(on_list)

    def _on_list(self, future: Any) -> None:
        if future.exception() is None:
            reply = future.result()
            listed = inventory(reply.instance_id, reply.components, reply.resources)
            self._rules.on_inventory(time.monotonic_ns(), listed)
            self._tick()

    def _act(self, request: Request) -> None:
        client = self._try if request.dry_run else self._change
        if not client.service_is_ready():
            text = f"service {self._service} is not there"
            self._rules.on_outcome(time.monotonic_ns(), request.request_id, None, text)
            return
        message = Reconfigure.Request(
            request_id=request.request_id,
            expected_revision=request.expected_revision,
            requested_by=self._node.get_fully_qualified_name(),
            cause=request.cause,
            steps=[
                ReconfigurationStep(kind=step.kind, target=step.target, name=step.name, value=step.value)
                for step in request.steps
            ],
            dry_run=request.dry_run,
            rule=request.rule,
            release=request.release,
            priority=request.priority,
            release_on_loss=request.release_on_loss,
        )
        on_reply = self.watch.guarded("the executor's reply", self._on_reply)
        self._call(client, message).add_done_callback(lambda future: on_reply(request.request_id, future))

    def _call(self, client: Any, message: Any) -> Any:
        """Ask; a call before it that got no answer is given up."""
        pending = self._pending.get(client)
        if pending is not None and not pending.done():
            client.remove_pending_request(pending)
        future = self._pending[client] = client.call_async(message)
        return future

    def _on_reply(self, request_id: str, future: Any) -> None:
        failure = future.exception()
        outcome = outcome_of(future.result()) if failure is None else None
        self._rules.on_outcome(time.monotonic_ns(), request_id, outcome, str(failure or ""))
        self._tick()

    def _decide(self, decision: Decision) -> None:
        reply = f" ({decision.message})" if decision.message else ""
        text = f"{decision.rule}: {decision.decision}: {decision.reason}{reply}"
        if decision.decision == "refused":
            self._node.get_logger().error(text)
        else:
            self._node.get_logger().info(text)
        self._decisions.publish(decision_message(decision, self._node.get_clock().now().to_msg()))
        if decision.decision == "do" and decision.rule in self._snapshot_rules:
            self._write_snapshot(decision)

    def _write_snapshot(self, decision: Decision) -> None:
        if not self._snapshot.service_is_ready():
            text = f"{decision.rule}: no snapshot: service {self._snapshot.srv_name} is not there"
            self._node.get_logger().error(text)
            return
        cause = f"{decision.rule}: {decision.reason}"
        who = self._node.get_fully_qualified_name()
        request = WriteSnapshot.Request(requested_by=who, cause=cause)
        on_snapshot = self.watch.guarded("the reply about a snapshot", self._on_snapshot)
        future = self._snapshot.call_async(request)
        future.add_done_callback(lambda future: on_snapshot(decision.rule, future))

    def _on_snapshot(self, rule: str, future: Any) -> None:
        reply, failure = future.result(), future.exception()
        if failure is None and reply.success:
            self._node.get_logger().info(f"{rule}: snapshot: {reply.message}")
        else:
            what = reply.message if failure is None else str(failure)
            self._node.get_logger().error(f"{rule}: no complete snapshot: {what}")


def run_node(arguments: Sequence[str], start: RosStart, stop: threading.Event) -> int:
    """Run the node until `stop` is set; returns 0, or 2 for bad input (one line on stderr)."""
    try:
        settings, remarks = settings_of(arguments)
        addresses, sockets = usable_addresses(), udp_sockets()
        init_logging_apart([*arguments, *start.arguments], signal_handler_options=SignalHandlerOptions.NO)
        with first_participant():
            node = Node(NODE_NAME, parameter_overrides=list(NO_SIMULATED_TIME))
        declare_settings(node, PARAMETERS, settings)
        discovery = reach(sockets)
    except Exception as error:  # noqa: BLE001 - rclpy has an exception class of its own for each mistake
        complain(f"supervisor: {error}")
        try_shutdown()
        return BAD_INPUT
    executor = SingleThreadedExecutor()
    interfaces = late_peers = None
    try:
        supervisor = Supervisor(node, RulesFile(settings["rules"]))
        only_one = OnlyOne(node, supervisor.watch, replaces=settings["replace"])
        interfaces = NetworkInterfaces(node, supervisor.watch, before=addresses)
        late_peers = LatePeers(node, supervisor.watch, start.unresolved)
        executor.add_node(node)
        discovery.log(node.get_logger())
        for remark in (*start.remarks, *remarks):
            node.get_logger().warning(remark)
        while not stop.is_set() and only_one.may_go_on():
            try:
                executor.spin_once(timeout_sec=_SPIN_S)
            except BaseException as error:  # noqa: BLE001 - a malformed message must not end the watch
                supervisor.watch.tell("taking a message", error)
    except ArchitectureFileError as error:
        complain(str(error))
        return BAD_INPUT
    except ValueError as error:
        complain(f"supervisor: {error}")
        return BAD_INPUT
    finally:
        if interfaces is not None:
            interfaces.close()
        if late_peers is not None:
            late_peers.close()
        executor.shutdown()
        node.destroy_node()
        last_lines()
        try_shutdown()
    return 0
