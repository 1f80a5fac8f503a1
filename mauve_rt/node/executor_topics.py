"""Resources bound to ROS topics, by way of rclpy: what is written is published, what arrives is written."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from mauve_rt._kernel import Deployer
from mauve_rt.model import ArchitectureModel, message_class
from mauve_rt.model.schema import ResourceModel
from mauve_rt.node.executor_recording import Recording
from mauve_rt.node.qos import qos_profile

_WAIT_NS = 200_000_000  # how long a publishing thread that should end may go on waiting


@dataclass(frozen=True)
class _Outgoing:
    publisher: Any
    topic: str
    type_name: str
    qos: QoSProfile


class TopicBridge:
    """Publishers and subscriptions of one architecture, and the thread that publishes.

    | member       | written by                        | read by               |
    | ------------ | --------------------------------- | --------------------- |
    | `_outgoing`  | open(), close(): no thread runs   | the publishing thread |
    | `_deployer`  | start(), stop()                   | subscriptions         |
    | `refused`    | subscriptions, one at a time      | diagnostics           |
    """

    def __init__(self, node: LifecycleNode, recording: Recording) -> None:
        self._node = node
        self._recording = recording
        self._outgoing: dict[str, _Outgoing] = {}
        self._subscriptions: list[Any] = []
        self._deployer: Deployer | None = None
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self.refused = 0  # messages that a resource did not take: a full ring_buffer, or malformed

    def open(self, model: ArchitectureModel, group: CallbackGroup) -> None:
        """Create the publishers and, in `group`, the subscriptions; nothing flows before start()."""
        for name, resource in model.resources.items():
            if resource.topic is not None:
                self._open_one(name, resource, group)

    def _open_one(self, name: str, resource: ResourceModel, group: CallbackGroup) -> None:
        assert resource.topic is not None  # noqa: S101 - open() asks
        found = message_class(resource.topic_type)
        qos = qos_profile(resource.topic.qos, capacity=resource.capacity or 0)
        topic = self._node.resolve_topic_name(resource.topic.name)
        if resource.topic.direction == "publish":
            publisher = self._node.create_publisher(found, topic, qos)
            self._outgoing[name] = _Outgoing(publisher, topic, resource.topic_type, qos)
        else:
            receive = self._receiver(name, topic, resource.topic_type, qos)
            subscription = self._node.create_subscription(
                found, topic, receive, qos, raw=True, callback_group=group
            )
            self._subscriptions.append(subscription)

    def start(self, deployer: Deployer) -> None:
        """Let messages flow, both ways."""
        self._deployer = deployer
        self._ending.clear()
        if self._outgoing:
            self._thread = threading.Thread(
                target=self._publish, args=(deployer,), name="topics", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """End the flow; returns when the publishing thread, having sent what was written, is gone."""
        self._deployer = None
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def close(self) -> None:
        """Destroy publishers and subscriptions."""
        for outgoing in self._outgoing.values():
            self._node.destroy_publisher(outgoing.publisher)
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._outgoing.clear()
        self._subscriptions.clear()

    def _publish(self, deployer: Deployer) -> None:
        ending = False
        while not ending:
            ending = self._ending.is_set()  # one more round then: outputs written at the stop are sent too
            for resource, data, _ in deployer.wait_published(0 if ending else _WAIT_NS):
                outgoing = self._outgoing.get(resource)
                if outgoing is not None:
                    outgoing.publisher.publish(data)
                    self._recording.record(outgoing.topic, outgoing.type_name, data, qos=outgoing.qos)

    def _receiver(
        self, resource: str, topic: str, type_name: str, qos: QoSProfile
    ) -> Callable[[bytes], None]:
        def receive(data: bytes) -> None:
            deployer = self._deployer
            if deployer is None:
                return
            if not deployer.write_resource(resource, data):
                self.refused += 1
            self._recording.record(topic, type_name, data, qos=qos)

        return receive
