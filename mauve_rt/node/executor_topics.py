"""Resources bound to ROS topics. The messages go by the native bridge; this opens it and tells of it."""

from collections.abc import Sequence
from dataclasses import dataclass

from rclpy.lifecycle import LifecycleNode

from mauve_rt._bridge import Bridge, TopicReport
from mauve_rt._kernel import Architecture
from mauve_rt.errors import MauveError, TopicError
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.schema import ResourceModel, TopicModel
from mauve_rt.node.qos import native_qos, qos_profile, recorded_qos
from mauve_rt.trace.bag import TopicQos
from mauve_rt.trace.trace_bag import SentMessage


@dataclass(frozen=True)
class _Bound:
    topic: str
    type_name: str
    qos: TopicQos

    def message(self, time_ns: int, data: bytes) -> SentMessage:
        """A message on it."""
        return SentMessage(self.topic, self.type_name, data, time_ns, self.qos)


class BoundTopics:
    """Publishers and subscriptions of one architecture, from open() to close()."""

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        self._bridge: Bridge | None = None
        self._bound: list[_Bound] = []  # by their numbers in the bridge's log

    def open(self, model: ArchitectureModel, architecture: Architecture) -> None:
        """Create publishers and subscriptions; nothing flows before start().

        Raises:
            MauveError: a message type is not installed, or the middleware refuses; nothing is open then.
        """
        self._bridge = Bridge(self._node.handle.pointer, architecture.pointer)
        try:
            for name, resource in model.resources.items():
                if resource.topic is not None:
                    self._open_one(self._bridge, name, resource, resource.topic)
        except MauveError:
            self.close()
            raise

    def _open_one(self, bridge: Bridge, name: str, resource: ResourceModel, topic: TopicModel) -> None:
        full_name = self._node.resolve_topic_name(topic.name)
        known = dict(self._node.get_topic_names_and_types()).get(full_name, ())
        if others := _others(known, resource.topic_type):
            raise TopicError(full_name, name, expected=resource.topic_type, found=" and ".join(others))
        qos = qos_profile(topic.qos, capacity=resource.capacity or 0)
        bind = bridge.publish if topic.direction == "publish" else bridge.subscribe
        number = bind(name, topic.name, resource.topic_type, native_qos(qos))
        assert number == len(self._bound)  # noqa: S101 - the bridge counts from 0
        self._bound.append(_Bound(full_name, resource.topic_type, recorded_qos(qos)))

    def start(self) -> None:
        """Let messages flow, both ways."""
        if self._bridge is not None:
            self._bridge.start()

    def stop(self) -> None:
        """End the flow; returns when what was written before is sent. May be called again."""
        if self._bridge is not None:
            self._bridge.stop()

    def close(self) -> None:
        """Destroy publishers and subscriptions. May be called again."""
        bridge, self._bridge = self._bridge, None
        if bridge is not None:
            bridge.close()
        self._bound.clear()

    def reports(self) -> list[TopicReport]:
        """How each bound topic fares."""
        return self._bridge.reports() if self._bridge is not None else []

    def other_types(self) -> dict[str, list[str]]:
        """Types that other nodes use on the bound topics: by the graph, as the middleware need not tell."""
        known = dict(self._node.get_topic_names_and_types())
        found = {bound.topic: _others(known.get(bound.topic, ()), bound.type_name) for bound in self._bound}
        return {topic: others for topic, others in found.items() if others}

    # ---- as a MessageSource of the recorder, which is stopped before close()

    def keep_messages(self) -> None:
        """Keep every message from now on until take_messages()."""
        if self._bridge is not None:
            self._bridge.log(on=True)

    def take_messages(self) -> Sequence[SentMessage]:
        """What was sent or received since the last call."""
        taken = self._bridge.take_log() if self._bridge is not None else []
        return [self._bound[number].message(time_ns, data) for number, time_ns, data in taken]

    def dropped_messages(self) -> int:
        """Messages that found no room to wait."""
        return self._bridge.log_dropped if self._bridge is not None else 0


def _others(types: Sequence[str], type_name: str) -> list[str]:
    return [name for name in types if name != type_name]
