"""Topics of other nodes, received natively for the recorder."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSPolicyKind

from mauve_rt._bridge import MessageBatch, TopicReceiver
from mauve_rt.errors import MauveError, ParameterError
from mauve_rt.interfaces.qos import native_qos, qos_profile, recorded_qos
from mauve_rt.trace.bag.recorded import ReceivedTopic

_DEPTH = 5000  # of a subscription: 5 s at 1 kHz, while the receiving thread has no CPU
_OFFERED_DEPTH = 100  # by who plays the bag


class ChosenTopic(NamedTuple):
    """A topic to record beside the executor's own."""

    name: str
    """As it was given; the node resolves it."""
    full_name: str
    type_name: str
    qos: str
    """One of QOS_NAMES."""


class ReceivedTopics:
    """The chosen topics, subscribed to from the construction until close(). From any thread.

    The bridge records a topic to which a resource is bound later: here it is ignored from the next flush on.
    """

    def __init__(
        self,
        node: LifecycleNode,
        chosen: Sequence[ChosenTopic],
        *,
        bound: Callable[[], Mapping[str, str]],
        queue_bytes: int,
    ) -> None:
        """Subscribe; `bound`: the topics that resources are bound to now; so much may wait for a flush.

        Raises:
            ParameterError: the middleware refuses a topic; none is subscribed to then.

        """
        self._bound = bound
        self._receiver = TopicReceiver(node.handle.pointer, limit_bytes=queue_bytes)
        self._chosen = tuple(chosen)
        self._ignored: set[str] = set()
        self.topics = tuple(
            ReceivedTopic(
                topic.full_name,
                topic.type_name,
                recorded_qos(qos_profile(topic.qos, capacity=_OFFERED_DEPTH)),
            )
            for topic in chosen
        )
        try:
            for topic in chosen:
                qos = native_qos(qos_profile(topic.qos, capacity=_DEPTH))
                # Not by its full name: resolved twice, it might be another.
                self._receiver.subscribe(topic.name, topic.type_name, qos)
            self._receiver.start()
        except MauveError as error:
            self._receiver.close()
            msg = f"topic {topic.full_name} to record: {error}"
            raise ParameterError(msg) from error

    @property
    def numbered(self) -> bool:
        """Whether the middleware numbers what a writer sends, so that gaps are known."""
        return TopicReceiver.numbered()

    def take(self) -> MessageBatch:
        """What came since the last call. By the recorder alone."""
        batch = self._receiver.take()
        bound = self._bound()
        ignored = {topic.name for topic in self.topics if topic.name in bound}
        for number, topic in enumerate(self.topics):
            if (topic.name in ignored) != (topic.name in self._ignored):
                self._receiver.ignore(number, topic.name in ignored)
        self._ignored = ignored
        return batch

    def misfits(self) -> Iterator[tuple[ChosenTopic, str]]:
        """Topics with a publisher that did not fit since the last call, and in which policy."""
        for topic, policy in zip(self._chosen, self._receiver.take_misfits(), strict=False):
            if policy:
                yield topic, QoSPolicyKind(policy).name.lower()

    def stop(self) -> None:
        """Receive no longer; what came stays for take(). May be called again."""
        self._receiver.stop()

    def close(self) -> None:
        """End the subscriptions, too."""
        self._receiver.close()
