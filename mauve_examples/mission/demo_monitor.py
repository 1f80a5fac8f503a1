"""What the demo sees and asks of the mission over ROS 2. One thread: that which calls `spin`."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Bool
from std_srvs.srv import SetBool

from mauve_examples.mission.demo_errors import MissionError
from mauve_msgs.msg import (
    ArchitectureState,
    MapUpdate,
    ReconfigurationEvent,
    SupervisorDecision,
)
from mauve_msgs.srv import ListComponents
from mauve_rt.node.shared.announcement import first_participant

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
RECENT = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
QUEUE = 100
ACTIVATION_TIMEOUT_S = 15.0


@dataclass(frozen=True)
class Hooks:
    """Whom to call with what arrives; the first argument is the robot's name."""

    map_update: Callable[[str, Any], None]
    state: Callable[[str, Any], None]
    event: Callable[[str, Any], None]
    decision: Callable[[str, Any], None]
    done: Callable[[str, bool], None]
    link: Callable[[bool], None]


class Cable(Protocol):
    """The link between robots on machines of their own."""

    def heard_by(self, robot: str) -> str:
        """The topic by which a robot hears the other one."""

    def set_link(self, *, up: bool) -> None:
        """Plug it in, or pull it out."""


class MissionMonitor:
    """A node of its own on the default context, which must have been initialised."""

    def __init__(self, robots: Sequence[str], hooks: Hooks, *, cable: Cable | None = None) -> None:
        """Subscribe to everything of every robot, before the robots are there.

        `cable` joins robots on machines of their own; without it there is the radio.
        """
        self._cable = cable
        self._robots = list(robots)
        with first_participant():
            self._node = Node("mission_monitor")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._connected = False
        self._configuring: dict[str, Any] = {}
        for robot in robots:
            self._watch(robot, hooks)
        self._listen(Bool, "/radio/link", lambda message: hooks.link(message.data), LATCHED)
        self._listen(Bool, "/radio/connected", self._on_connected, LATCHED)
        self._link = self._node.create_publisher(Bool, "/radio/link", LATCHED) if cable is not None else None
        client = self._node.create_client
        self._set_link = client(SetBool, "/radio/set_link")
        self._list = {robot: client(ListComponents, f"/{robot}/executor/list_components") for robot in robots}
        self._change_state = {
            robot: client(ChangeState, f"/{robot}/executor/change_state") for robot in robots
        }

    def _watch(self, robot: str, hooks: Hooks) -> None:
        def to(hook: Callable[[str, Any], None]) -> Callable[[Any], None]:
            return lambda message: hook(robot, message)

        self._listen(MapUpdate, f"/{robot}/map_updates", to(hooks.map_update), QUEUE)
        self._listen(ArchitectureState, f"/{robot}/executor/state", to(hooks.state), LATCHED)
        self._listen(ReconfigurationEvent, f"/{robot}/executor/events", to(hooks.event), QUEUE)
        for node in ("executor", "supervisor"):
            self._listen(SupervisorDecision, f"/{robot}/{node}/decisions", to(hooks.decision), RECENT)
        self._listen(Bool, f"/{robot}/done", lambda message: hooks.done(robot, message.data), QUEUE)

    def _listen(self, kind: Any, topic: str, callback: Callable[[Any], None], qos: Any) -> None:
        self._node.create_subscription(kind, topic, callback, qos)

    def _on_connected(self, message: Any) -> None:
        self._connected = message.data

    def spin(self, seconds: float) -> None:
        """Serve what arrives for so long."""
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0.0:
            self._executor.spin_once(timeout_sec=left_s)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self._node.destroy_node()

    # ---- who is there

    def node_counts(self) -> dict[str, int]:
        """How many nodes of each full name there are, this one left out."""
        counts: dict[str, int] = {}
        for name, namespace in self._node.get_node_names_and_namespaces():
            full = f"{namespace.rstrip('/')}/{name}"
            counts[full] = counts.get(full, 0) + 1
        counts.pop(self._node.get_fully_qualified_name(), None)
        return counts

    def missing(self, nodes: Sequence[str]) -> str:
        """What of the mission is not ready yet, in words; configures executors as they appear.

        Raises:
            MissionError: an executor refused its architecture.
        """
        counts = self.node_counts()
        unconfigured = [robot for robot in self._robots if not self._configure(robot)]
        for node in nodes:
            if node not in counts:
                return f"node {node} is not there"
        if unconfigured:
            return f"/{unconfigured[0]}/executor is not configured"
        if not self._connected and self._cable is None:
            return "the radio has not met all of the robots' radio/in and radio/out"
        with_supervisor = {node.split("/")[1] for node in nodes if node.endswith("/supervisor")}
        return next(
            filter(None, (self._unmet(robot, robot in with_supervisor) for robot in self._robots)), ""
        )

    def _unmet(self, robot: str, with_supervisor: bool) -> str:  # noqa: FBT001 - one caller
        for topic in (f"/{robot}/map_updates", f"/{robot}/done"):
            if not self._node.count_publishers(topic):
                return f"nobody publishes {topic}"
        topic = self._cable.heard_by(robot) if self._cable is not None else f"/{robot}/radio/in"
        heard = self._node.get_subscriptions_info_by_topic(topic)
        listeners = {info.node_name for info in heard if info.node_namespace == f"/{robot}"}
        absent = {"executor", *(["supervisor"] if with_supervisor else [])} - listeners
        return f"the {min(absent)} of {robot} does not listen to {topic}" if absent else ""

    def _configure(self, robot: str) -> bool:
        """Ask for it once its service is there; True when it is done."""
        client = self._change_state[robot]
        if robot not in self._configuring and client.service_is_ready():
            request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_CONFIGURE))
            self._configuring[robot] = client.call_async(request)
        future = self._configuring.get(robot)
        if future is None or not future.done():
            return False
        if future.exception() is not None or not future.result().success:
            raise MissionError(f"the executor of {robot} refused its architecture")
        return True

    # ---- asking

    def activate(self) -> None:
        """Start all robots at once and wait until all have.

        Raises:
            MissionError: one refused or did not answer.
        """
        request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_ACTIVATE))
        futures = {robot: client.call_async(request) for robot, client in self._change_state.items()}
        deadline_s = time.monotonic() + ACTIVATION_TIMEOUT_S
        while not all(future.done() for future in futures.values()):
            if time.monotonic() > deadline_s:
                slow = next(robot for robot, future in futures.items() if not future.done())
                raise MissionError(f"the executor of {slow} did not start within {ACTIVATION_TIMEOUT_S:g} s")
            self.spin(0.01)
        for robot, future in futures.items():
            if future.exception() is not None or not future.result().success:
                raise MissionError(f"the executor of {robot} refused to start; see its log")

    def ask_components(self, told: Callable[[str, Any], None]) -> None:
        """Ask every executor for its components; `told` gets each ListComponents answer when it comes."""
        for robot, client in self._list.items():
            if client.service_is_ready():
                client.call_async(ListComponents.Request()).add_done_callback(_teller(robot, told))

    def set_link(self, *, up: bool) -> None:
        """Cut or restore the link; /radio/link tells when it is done."""
        if self._cable is not None and self._link is not None:
            self._cable.set_link(up=up)
            self._link.publish(Bool(data=up))
            return
        self._set_link.call_async(SetBool.Request(data=up))


def _teller(robot: str, told: Callable[[str, Any], None]) -> Callable[[Any], None]:
    def answered(future: Any) -> None:
        if future.exception() is None:
            told(robot, future.result())

    return answered
