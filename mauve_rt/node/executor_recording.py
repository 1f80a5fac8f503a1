"""The bag of an executor: its trace, the messages it sends and receives, and topics it is asked to record."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from mauve_rt._kernel import Deployer, monotonic_ns
from mauve_rt.errors import ParameterError
from mauve_rt.model import message_class
from mauve_rt.model.schema import QOS_NAMES
from mauve_rt.node.qos import qos_profile, recorded_qos
from mauve_rt.trace.recorder import MessageSource, Recorder

_DEPTH = 100  # of the topics recorded beside the executor's own


class Recording:
    """Records into a bag, or does nothing where none was asked for."""

    def __init__(self) -> None:
        self._recorder: Recorder | None = None
        self._subscriptions: list[Any] = []

    def start(
        self, node: LifecycleNode, deployer: Deployer, directory: Path, *, messages: MessageSource
    ) -> None:
        """Create the bag and start to record the trace and the messages of the bound topics.

        Raises:
            TraceError: the folder exists already or cannot be written.
        """
        self._recorder = Recorder(
            deployer,
            directory,
            node_name=node.get_fully_qualified_name(),
            on_error=lambda text: node.get_logger().error(text),
            messages=messages,
        )
        self._recorder.start()

    def add_topics(self, node: LifecycleNode, topics: Sequence[str], group: CallbackGroup) -> None:
        """Record further topics, each given as `name:package/msg/Type` or `name:package/msg/Type:qos`.

        Best effort, the default, hears every publisher; transient_local also hears what was said before.

        Raises:
            ParameterError: one of them is written otherwise, or its type is not installed.
        """
        for topic in topics:
            name, type_name, qos = (*topic.split(":"), "best_effort")[:3] if ":" in topic else ("", "", "")
            found = message_class(type_name)
            if not name or found is None or qos not in QOS_NAMES:
                expected = "name:package/msg/Type of an installed message, and perhaps one of"
                expected = f"{expected} {', '.join(f':{word}' for word in QOS_NAMES)}"
                raise ParameterError(f"parameter record_topics: expected {expected}, found '{topic}'")
            full_name = node.resolve_topic_name(name)
            profile = qos_profile(qos, capacity=_DEPTH)
            receive = self._callback(full_name, type_name, profile)
            # Not by its full name: resolved twice, it might be another.
            subscription = node.create_subscription(
                found, name, receive, profile, raw=True, callback_group=group
            )
            self._subscriptions.append(subscription)

    def record(self, topic: str, type_name: str, data: bytes, *, qos: QoSProfile | None = None) -> None:
        """Record a serialized message that was sent or received now. From any thread."""
        recorder = self._recorder
        if recorder is not None:
            offered = None if qos is None else recorded_qos(qos)
            recorder.record(topic, type_name, data, monotonic_ns=monotonic_ns(), qos=offered)

    def stop(self, node: LifecycleNode) -> None:
        """Seal the bag. May be called again."""
        recorder, self._recorder = self._recorder, None
        for subscription in self._subscriptions:
            node.destroy_subscription(subscription)
        self._subscriptions.clear()
        if recorder is not None:
            recorder.stop()

    def _callback(self, topic: str, type_name: str, qos: QoSProfile) -> Callable[[bytes], None]:
        return lambda data: self.record(topic, type_name, data, qos=qos)
