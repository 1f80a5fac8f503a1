"""The topics of a simulation: what is published reaches every listener at once. One thread, no ROS graph."""

from collections.abc import Callable
from typing import Any, NamedTuple

from builtin_interfaces.msg import Time
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from mauve_rt.model import message_class
from mauve_rt.simulation.messages import serialize

S = 1_000_000_000
_TRANSFORMS = "tf2_msgs/msg/TFMessage"


class Sample(NamedTuple):
    """A serialized message, and when it was written in virtual time."""

    topic: str
    type_name: str
    data: bytes
    time_ns: int
    qos: QoSProfile

    def message(self) -> Any:
        """The message."""
        return deserialize_message(self.data, message_class(self.type_name))


class SimulatedTopics:
    """Topics by their full names."""

    def __init__(self) -> None:
        self._listeners: dict[str, list[Callable[[Sample], None]]] = {}

    def listen(self, topic: str, heard: Callable[[Sample], None]) -> None:
        """Hear what is published from now on; of several listeners the first hears first."""
        self._listeners.setdefault(topic, []).append(heard)

    def publish(self, sample: Sample) -> None:
        """Tell every listener."""
        for heard in self._listeners.get(sample.topic, ()):
            heard(sample)

    def say(self, topic: str, type_name: str, message: Any, *, time_ns: int, qos: QoSProfile) -> None:
        """Publish a message of rclpy."""
        self.publish(Sample(topic, type_name, serialize(message), time_ns, qos))


def resolved(name: str, namespace: str) -> str:
    """A topic's full name."""
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"


def in_virtual_time(sample: Sample) -> Sample:
    """A sample as it is recorded: a transform_tree stamps by the real clock, which no two runs share."""
    if sample.type_name != _TRANSFORMS:
        return sample
    message = sample.message()
    stamps = [each.header.stamp for each in message.transforms]
    times_ns = [each.sec * S + each.nanosec for each in stamps]
    ahead_ns = max(times_ns) - sample.time_ns
    for each, time_ns in zip(message.transforms, times_ns, strict=True):
        each.header.stamp = stamp(time_ns - ahead_ns)
    return sample._replace(data=serialize(message))


def stamp(time_ns: int) -> Any:
    """builtin_interfaces/msg/Time of a virtual time."""
    return Time(sec=time_ns // S, nanosec=time_ns % S)
