"""Topics of other nodes, received natively for the recorder."""

import threading
from collections.abc import Callable, Iterator, Mapping

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSPolicyKind

from mauve_rt._bridge import MessageBatch, TopicReceiver
from mauve_rt.errors import MauveError, ParameterError
from mauve_rt.interfaces.qos import native_qos, qos_profile, recorded_qos
from mauve_rt.node.executor.topic_choice import Choice, ChosenTopic
from mauve_rt.trace.bag.recorded import ReceivedTopic

_DEPTH = 5000  # of a subscription: 5 s at 1 kHz, while the receiving thread has no CPU
_OFFERED_DEPTH = 100  # by who plays the bag


class ReceivedTopics:
    """The chosen topics, subscribed to until close(). From any thread.

    The bridge records a topic to which a resource is bound later: here it is ignored from the next flush on.

    | member              | written by | guarded by              |
    | ------------------- | ---------- | ----------------------- |
    | `chosen`, `topics`  | add()      | `_lock`, exchanged whole |
    | `_is_stopped`       | stop()     | `_lock`                 |
    | `_ignored`          | take()     |                         |
    """

    def __init__(
        self,
        node: LifecycleNode,
        choice: Choice,
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
        self._ignored: set[str] = set()
        self._lock = threading.Lock()
        self._is_stopped = False
        self.patterns = choice.patterns
        self.chosen: tuple[ChosenTopic, ...] = ()
        self.topics: tuple[ReceivedTopic, ...] = ()
        try:
            for topic in choice.topics:
                self.add(topic)
            self._receiver.start()
        except MauveError:
            self._receiver.close()
            raise

    def add(self, topic: ChosenTopic) -> None:
        """Subscribe to a further topic, unless it is stopped.

        Raises:
            ParameterError: the middleware refuses the topic.

        """
        profile = qos_profile(topic.qos, capacity=_DEPTH)
        offered = recorded_qos(qos_profile(topic.qos, capacity=_OFFERED_DEPTH))
        with self._lock:
            if self._is_stopped:
                return
            try:
                # Not by its full name: resolved twice, it might be another.
                self._receiver.subscribe(topic.name, topic.type_name, native_qos(profile))
            except MauveError as error:
                msg = f"topic {topic.full_name} to record: {error}"
                raise ParameterError(msg) from error
            self.chosen = (*self.chosen, topic)
            self.topics = (*self.topics, ReceivedTopic(topic.full_name, topic.type_name, offered))

    @property
    def numbered(self) -> bool:
        """Whether the middleware numbers what a writer sends, so that gaps are known."""
        return TopicReceiver.numbered()

    def take(self) -> MessageBatch:
        """What came since the last call, of the first `topics`. By the recorder alone."""
        with self._lock:  # never of a topic that is not in `topics` yet
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
        for topic, policy in zip(self.chosen, self._receiver.take_misfits(), strict=False):
            if policy:
                yield topic, QoSPolicyKind(policy).name.lower()

    def stop(self) -> None:
        """Receive no longer; what came stays for take(). May be called again."""
        with self._lock:
            self._is_stopped = True
            self._receiver.stop()

    def close(self) -> None:
        """End the subscriptions, too."""
        self.stop()
        self._receiver.close()
