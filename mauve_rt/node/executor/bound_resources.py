"""Resources bound to ROS topics, services and actions. All data goes by the native bridge; this opens it.

Who binds a resource while the executor runs does it in two steps around the commit that adds it: open()
before, where everything can still be refused, attach() after.
"""

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile

from mauve_rt._bridge import ActionReport, Bridge, CallReport, FlatNumbers, TopicReport
from mauve_rt._kernel import Architecture, ResourceDescription
from mauve_rt.errors import MauveError, TopicError
from mauve_rt.interfaces.bound_types import bound_types
from mauve_rt.interfaces.qos import native_qos, qos_profile, recorded_qos
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.qos_remarks import qos_remarks, remark_text
from mauve_rt.model.schema import ActionModel, ResourceModel, ServiceModel, TopicModel
from mauve_rt.trace.bag.recorded import SentMessage

MAX_MIRRORS = 64
_MIRROR_DEPTH = 10
_SIDES = {"publish": "publishes", "subscribe": "subscribes"}  # fields of ResourceInfo


@dataclass(frozen=True)
class BoundTopic:
    """A resource's topic, or a mirror of it; the topic's name is expanded and remapped."""

    resource: str
    direction: str
    topic: str
    type_name: str
    profile: QoSProfile

    def message(self, time_ns: int, data: bytes) -> SentMessage:
        """A message on it."""
        return SentMessage(self.topic, self.type_name, data, time_ns, recorded_qos(self.profile))


class Mirrored(NamedTuple):
    """A value that is polled and published."""

    name: str
    """As requested: a resource, or component.port."""
    field: str
    """One number of it; empty: the whole value."""
    resource: str
    topic: str
    """Expanded and remapped."""
    type: str
    """Of the messages."""
    rate_hz: float


class BoundResources:
    """Publishers, subscriptions, clients and services of one architecture, from configure() to close().

    | member      | written by                          | read by             | guarded by |
    | ----------- | ----------------------------------- | ------------------- | ---------- |
    | `_bridge`   | configure(), close()                | any                 | `_lock`    |
    | `_numbers`  | open(), discard(), remove() ...     | the same            | `_lock`    |
    | `_topics`   | open(), close(): grows, else emptied | recorder, any       | each dict operation is one |
    | `_mirrors`  | mirror(), end_mirrors(), remove() ... | the same           | `_lock`    |
    """

    def __init__(self, node: LifecycleNode) -> None:
        self._node = node
        self._lock = threading.RLock()
        self._bridge: Bridge | None = None
        self._numbers: dict[str, list[int]] = {}  # of what is open, by resource
        self._topics: dict[int, BoundTopic] = {}  # by their numbers in the bridge, also of those closed
        self._mirrors: dict[int, Mirrored] = {}  # of those that are open

    def configure(self, model: ArchitectureModel, architecture: Architecture) -> None:
        """Open and attach whatever the file binds; nothing flows before start().

        Raises:
            MauveError: a type is not installed, or the middleware refuses; nothing is open then.
        """
        with self._lock:
            sender = model.sender
            self._bridge = Bridge(
                self._node.handle.pointer,
                architecture.pointer,
                priority=sender.priority,
                cpus=sender.cpus or (),
            )
            try:
                described = {resource.name: resource for resource in architecture.resources()}
                self.attach(self.open(model.resources, described))
            except MauveError:
                self.close()
                raise

    def open(
        self, resources: Mapping[str, ResourceModel], described: Mapping[str, ResourceDescription]
    ) -> dict[str, list[int]]:
        """Open the topics, services and actions of these resources, which may come later; for attach().

        Raises:
            MauveError: as configure(); none of them is open then.
        """
        opened: dict[str, list[int]] = {}
        if not resources:
            return opened
        with self._lock:
            bridge = self._require_bridge()
            try:
                for name, resource in resources.items():
                    numbers = opened.setdefault(name, [])
                    types = dict(bound_types(resource, described[name]))
                    for topic, is_static in _topics(resource):
                        numbers.append(self._open_topic(bridge, name, resource, topic, is_static=is_static))
                    if resource.service is not None:
                        numbers.append(_open_service(bridge, name, types["service"], resource.service))
                    if resource.action is not None:
                        numbers.append(_open_action(bridge, name, resource, resource.action))
            except MauveError:
                self.discard(opened)
                raise
        return {name: numbers for name, numbers in opened.items() if numbers}

    def _open_topic(
        self, bridge: Bridge, name: str, resource: ResourceModel, topic: TopicModel, *, is_static: bool
    ) -> int:
        full_name = self._node.resolve_topic_name(topic.name)
        known = dict(self._node.get_topic_names_and_types()).get(full_name, ())
        if others := _others(known, resource.topic_type):
            raise TopicError(full_name, name, expected=resource.topic_type, found=" and ".join(others))
        for remark in qos_remarks(topic) if not is_static else ():
            self._node.get_logger().warning(remark_text(name, topic, remark))
        qos = qos_profile(topic.offered_qos, capacity=resource.parameters.get("capacity", 0))
        bind = bridge.publish if topic.direction == "publish" else bridge.subscribe
        number = bind(name, topic.name, resource.topic_type, native_qos(qos), is_static=is_static)
        self._topics[number] = BoundTopic(name, topic.direction, full_name, resource.topic_type, qos)
        return number

    def attach(self, opened: Mapping[str, list[int]]) -> None:
        """Let what was opened serve its resources, which are in the architecture now.

        Raises:
            MauveError: one of them is none to serve.
        """
        if opened:
            with self._lock:
                self._require_bridge().attach([number for numbers in opened.values() for number in numbers])
                self._numbers.update(opened)

    def listen_for_silence(self, resources: Iterable[str], links: Iterable[str]) -> None:
        """Rules listen for the silence of these resources, and of the links to `links`, and of no others.

        Raises:
            MauveError: the middleware refuses.
        """
        with self._lock:
            if self._bridge is not None:
                self._bridge.listen_for_silence(set(resources), set(links))

    def discard(self, opened: Mapping[str, list[int]]) -> None:
        """Close what was opened for resources that did not come to be."""
        if opened:
            with self._lock:
                self._require_bridge().close([number for numbers in opened.values() for number in numbers])

    def remove(self, resources: Iterable[str]) -> None:
        """Close the topics and services of resources that are gone; what they were told before is sent."""
        with self._lock:
            self.end_mirrors(lambda mirrored: mirrored.resource in resources)
            self.discard({name: self._numbers.pop(name) for name in resources if name in self._numbers})

    def start(self) -> None:
        """Let messages and calls flow, both ways."""
        with self._lock:
            if self._bridge is not None:
                self._bridge.start()

    def stop(self) -> None:
        """End the flow; returns when what was written before is sent. May be called again."""
        with self._lock:
            if self._bridge is not None:
                self._bridge.stop()

    def close(self) -> None:
        """Close everything. May be called again."""
        with self._lock:
            bridge, self._bridge = self._bridge, None
            if bridge is not None:
                bridge.close()
            self._numbers.clear()
            self._topics.clear()
            self._mirrors.clear()

    def _require_bridge(self) -> Bridge:
        if self._bridge is None:
            raise MauveError("the executor is not configured: nothing can be bound to ROS")
        return self._bridge

    # ---- values that are polled and published

    def mirror(self, wanted: Mirrored, *, numbers: FlatNumbers | None, number: int | None) -> None:
        """Publish the value of a resource from now on.

        Raises:
            MauveError: another mirror, resource or node has the topic; or the middleware refuses.
        """
        with self._lock:
            bridge = self._require_bridge()
            if wanted in self._mirrors.values():
                return
            if len(self._mirrors) >= MAX_MIRRORS:
                raise MauveError(f"there are {MAX_MIRRORS} mirrors already; stop one of them first")
            if wanted.topic in {bound.topic for bound in self._present()}:
                raise MauveError(f"topic {wanted.topic} is bound already; choose another one")
            if others := self._node.count_publishers(wanted.topic):
                raise MauveError(f"topic {wanted.topic} has {others} other publishers; choose another one")
            qos = QoSProfile(depth=_MIRROR_DEPTH)
            number_ = bridge.mirror(
                wanted.resource,
                wanted.topic,
                wanted.type,
                native_qos(qos),
                period_ns=round(1e9 / wanted.rate_hz),
                numbers=numbers,
                number=number,
            )
            self._topics[number_] = BoundTopic(wanted.resource, "mirror", wanted.topic, wanted.type, qos)
            self._mirrors[number_] = wanted
            bridge.attach([number_])

    def end_mirrors(self, is_meant: Callable[[Mirrored], bool]) -> list[Mirrored]:
        """End the mirrors that are meant; returns them."""
        with self._lock:
            ended = {number: each for number, each in self._mirrors.items() if is_meant(each)}
            if ended:
                self._require_bridge().close([*ended])
            for number in ended:
                del self._mirrors[number]
            return [*ended.values()]

    def mirrors(self) -> list[Mirrored]:
        """Those that are open."""
        with self._lock:
            return [*self._mirrors.values()]

    def _present(self) -> list[BoundTopic]:
        """The topics that are open."""
        numbers = {number for numbers in self._numbers.values() for number in numbers} | set(self._mirrors)
        return [bound for number, bound in self._topics.items() if number in numbers]

    # ---- for those who ask

    def bindings(self) -> dict[str, dict[str, Any]]:
        """The ROS names of each bound resource, expanded and remapped, as ResourceInfo's fields."""
        # `_topics` keeps those closed too: of a resource that was added again the last one counts.
        bound_topics = [each for each in list(self._topics.values()) if each.direction in _SIDES]
        sides = {bound.topic: _SIDES[bound.direction] for bound in bound_topics}
        found: dict[str, dict[str, Any]] = {}
        for mirrored in self.mirrors():
            found.setdefault(mirrored.resource, {}).setdefault("mirrors", []).append(mirrored.topic)
        for topic in self.topics():
            if topic.topic in sides:
                found.setdefault(topic.resource, {})[sides[topic.topic]] = topic.topic
        for call in self.calls():
            side = "offers" if call.is_offered else "calls"
            found.setdefault(call.resource, {})[side] = call.service
        for action in self.actions():
            side = "offers" if action.is_offered else "calls"
            found.setdefault(action.resource, {})[side] = action.action
        return found

    def heard(self) -> dict[str, str]:
        """The resource that takes the messages of each topic; of several the last."""
        names = self.bindings()
        return {sides["subscribes"]: name for name, sides in names.items() if "subscribes" in sides}

    def published(self) -> list[BoundTopic]:
        """The topics on which writes to resources are published."""
        with self._lock:
            return [bound for bound in self._present() if bound.direction == "publish"]

    def types(self) -> dict[str, str]:
        """The type of each bound topic."""
        present = {number for numbers in list(self._numbers.values()) for number in numbers}
        return {
            bound.topic: bound.type_name for number, bound in list(self._topics.items()) if number in present
        }

    def topics(self) -> list[TopicReport]:
        """How each bound topic fares."""
        bridge = self._bridge
        return bridge.topics() if bridge is not None else []

    def calls(self) -> list[CallReport]:
        """How each ROS service that is called or offered fares."""
        bridge = self._bridge
        return bridge.calls() if bridge is not None else []

    def actions(self) -> list[ActionReport]:
        """What became of the goals of each ROS action that is offered or called."""
        bridge = self._bridge
        return bridge.actions() if bridge is not None else []

    def other_types(self) -> dict[str, list[str]]:
        """Types that other nodes use on the bound topics: by the graph, as the middleware need not tell."""
        known = dict(self._node.get_topic_names_and_types())
        bound = list(self._topics.values())
        found = {each.topic: _others(known.get(each.topic, ()), each.type_name) for each in bound}
        return {topic: others for topic, others in found.items() if others}

    # ---- as a MessageSource of the recorder, which is stopped before close()

    def keep_messages(self, *, on: bool) -> None:
        """Keep every message from now on until take_messages(), or none any more."""
        bridge = self._bridge
        if bridge is not None:
            bridge.log(on=on)
            if not on:
                bridge.take_log()

    def take_messages(self) -> Sequence[SentMessage]:
        """What was sent or received since the last call."""
        taken = self._bridge.take_log() if self._bridge is not None else []
        return [self._topics[number].message(time_ns, data) for number, time_ns, data in taken]

    def dropped_messages(self) -> int:
        """Messages that found no room to wait."""
        return self._bridge.log_dropped if self._bridge is not None else 0


def _topics(resource: ResourceModel) -> Iterator[tuple[TopicModel, bool]]:
    """The topics that a resource is bound to, and whether one is that of its static transforms."""
    if resource.topic is None:
        return
    if resource.static_topic is not None:
        yield resource.static_topic, True
    yield resource.topic, False


def _open_service(bridge: Bridge, name: str, type_name: str, service: ServiceModel) -> int:
    if service.offers is None:
        return bridge.call(name, service.name, type_name)
    return bridge.offer(name, service.name, type_name, service.offers)


def _open_action(bridge: Bridge, name: str, resource: ResourceModel, action: ActionModel) -> int:
    is_offered = resource.kind == "action_server"
    return (bridge.offer_action if is_offered else bridge.call_action)(name, action.name, resource.type)


def _others(types: Sequence[str], type_name: str) -> list[str]:
    return [name for name in types if name != type_name]
