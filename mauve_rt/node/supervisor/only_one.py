"""One supervisor of a name runs: of two, the one that was started first, or the one that replaces it."""

import os
import socket
import uuid
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_msgs.msg import SupervisorPresence
from mauve_rt.node.shared.watch import Watch

_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class OnlyOne:
    """Publishes that this supervisor runs, and hears the others of its name.

    On the thread that spins the node.

    One that is killed or stands still says nothing: then the new one goes on with its rules. It decides by
    ~/presence, not by the graph, which shows a killed one for a while.
    """

    def __init__(self, node: Node, watch: Watch, *, replaces: bool) -> None:
        """`replaces`: one that was started before ends."""
        self._name = node.get_fully_qualified_name()
        self._own = SupervisorPresence(
            started=node.get_clock().now().to_msg(),
            instance_id=str(uuid.uuid4()),
            host=socket.gethostname(),
            pid=os.getpid(),
            replaces=replaces,
        )
        self._node = node
        self._older = ""  # the supervisor that this one must not run beside
        self._is_replaced = False
        publisher = node.create_publisher(
            SupervisorPresence,
            "~/presence",
            _QOS,
            event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
        )
        node.create_subscription(
            SupervisorPresence,
            "~/presence",
            watch.guarded("another supervisor's presence", self._hear),
            QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )
        publisher.publish(self._own)

    def may_go_on(self) -> bool:
        """Whether this supervisor has not been replaced.

        Raises:
            ValueError: another one of the name runs already.
        """
        if self._older:
            raise ValueError(
                f"{self._name} runs already, {self._older}; to take its place, start with -p replace:=true; "
                "to run beside it, give this one another name (-r __node:=NAME)"
            )
        return not self._is_replaced

    def _hear(self, other: Any) -> None:
        if other.instance_id == self._own.instance_id or _rank(self._own) > _rank(other):
            return
        where = f"process {other.pid} on {other.host}"
        if other.replaces:
            self._is_replaced = True
            self._node.get_logger().info(f"{self._name} is replaced by {where}")
        else:
            self._older = where


def _rank(presence: Any) -> tuple[bool, int, str]:
    """Of two, the higher one goes on: the last one that replaces, else the first."""
    started_ns = presence.started.sec * 1_000_000_000 + presence.started.nanosec
    return presence.replaces, started_ns if presence.replaces else -started_ns, presence.instance_id
