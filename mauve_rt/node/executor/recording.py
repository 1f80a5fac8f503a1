"""The bags of an executor: its trace, messages it sends and receives, topics it is asked to record."""

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from mauve_rt._kernel import monotonic_ns
from mauve_rt.control.recorded_values import RecordedValues, choose
from mauve_rt.control.requests import Code, RecordingOrder, RefusalError
from mauve_rt.control.runtime import Observed, Runtime
from mauve_rt.errors import MauveError, ParameterError, one_line
from mauve_rt.interfaces.descriptions import trace_architecture
from mauve_rt.interfaces.qos import recorded_qos
from mauve_rt.interfaces.recorded_shadows import RecordedShadows
from mauve_rt.model import message_class
from mauve_rt.model.schema import QOS_NAMES
from mauve_rt.model.threads import real_time_threads
from mauve_rt.node.executor.bound_resources import BoundResources
from mauve_rt.node.executor.received_topics import ChosenTopic, ReceivedTopics
from mauve_rt.trace.bag.recorded import SentMessage, Split
from mauve_rt.trace.errors import TraceError

if TYPE_CHECKING:
    from mauve_rt.trace.recording.recorder import MessageSource, Recorder
    from mauve_rt.trace.recording.trace_bag import Entry

_BEST_EFFORT = "best_effort"


_OWN = {  # recorded in any case
    "~/state": "mauve_msgs/msg/ArchitectureState",
    "~/events": "mauve_msgs/msg/ReconfigurationEvent",
    "~/decisions": "mauve_msgs/msg/SupervisorDecision",
    "~/shadow": "mauve_msgs/msg/Shadow",
    "~/violations": "mauve_msgs/msg/BoundViolation",
    "~/trace/batches": "mauve_msgs/msg/TraceBatch",
    "~/trace/names": "mauve_msgs/msg/TraceNames",
    "~/trace/architecture": "mauve_msgs/msg/TraceArchitecture",
}


@dataclass(frozen=True, kw_only=True)
class RecordingStatus:
    """How the recording fares, the present or the last one."""

    bag: str
    recording: bool
    messages: int
    """In the bag, the trace's own among them."""
    dropped: int
    """Of those that came, not in the bag."""
    others: "Mapping[str, Entry]"
    """What became of the messages of each topic of other nodes."""
    error: str
    """Why it ended by itself; empty when it did not."""

    @property
    def lost_before(self) -> int:
        """Messages of other nodes that were lost before they came here."""
        return sum(entry.lost_before for entry in self.others.values())


class Recording:
    """Records into one bag at a time, from a start to a stop. From any thread.

    | member           | written by       | guarded by      |
    | ---------------- | ---------------- | --------------- |
    | `_recorder`      | start(), stop()  | exchanged whole |
    | `_shadows`       | start()          | `_lock`         |
    | `_received`      | start(), stop()  | exchanged whole |
    | `_chosen`        | start(), stop()  | exchanged whole |
    | `_told`          | look()           |                 |
    | `_last`          | stop()           | exchanged whole |
    """

    def __init__(
        self, node: LifecycleNode, runtime: Runtime, bound: BoundResources, *, queue_bytes: int
    ) -> None:
        """Take the node whose trace it is; so much of other nodes' messages may wait for the recorder."""
        self._queue_bytes = queue_bytes
        self._node = node
        self._runtime = runtime
        self._bound = bound
        self._lock = threading.RLock()
        self._recorder: Recorder | None = None
        self._shadows: RecordedShadows | None = None
        self._last: RecordingStatus | None = None
        self._received: ReceivedTopics | None = None
        self._chosen: tuple[ChosenTopic, ...] = ()
        self._told: set[tuple[str, str]] = set()  # topics, and types of others on them

    def start(self, bag: Path, topics: Sequence[str], *, split: Split, values: Sequence[str] = ()) -> Path:
        """Create the bag and record from now on; returns its folder, absolute. Another recording ends.

        Args:
            bag: the folder, which must not exist yet.
            topics: further ones, each as `name`, `name:package/msg/Type` or `name:package/msg/Type:qos`. Best
                effort, the default, hears every publisher; transient_local also hears what was said before.
                What the executor sends, and what its resources are bound to, is recorded anyhow, and once.
            split: when to go on in a new file.
            values: resources, or COMPONENT.PORT, whose every write is recorded, besides those of the file.

        Raises:
            ParameterError: a value is not there; a topic is written otherwise, nobody knows its type, that is
                not installed, or the topic is used with another one.
            TraceError: the folder exists already or cannot be written.

        """
        from mauve_rt.native_program import native_program  # noqa: PLC0415 - a start without a bag needs none
        from mauve_rt.trace.recording.recorder import Recorder  # noqa: PLC0415

        chosen = tuple(self._choose(topics))
        name = self._node.get_fully_qualified_name()
        try:
            recorded = choose(self._runtime, [*self._runtime.model.recorded, *values], name)
        except MauveError as error:
            raise ParameterError(str(error)) from error
        with self._lock:
            self.stop()
            # First: what is refused here leaves no folder behind.
            received = None
            if chosen:
                received = ReceivedTopics(
                    self._node, chosen, bound=self._bound.types, queue_bytes=self._queue_bytes
                )
            self._received = received
            self._shadows = RecordedShadows(self._runtime, name, _serialized)
            try:
                recorder = Recorder(
                    self._runtime.host,
                    bag.absolute(),
                    node_name=name,
                    split=split,
                    on_error=self._node.get_logger().error,
                    messages=_Sources(self._bound, RecordedValues(self._runtime, recorded), self._shadows),
                    topics=received,
                    keeper=native_program("bag_keeper"),
                )
            except TraceError:
                self._unsubscribe()
                raise
            recorder.tell_architecture(self._architecture(self._runtime.observe()))
            recorder.start(discard=self._runtime.active)
            self._recorder, self._chosen = recorder, chosen
            return recorder.directory

    def stop(self) -> RecordingStatus | None:
        """Seal the bag; returns how it went, None when nothing was recorded. May be called again."""
        with self._lock:
            recorder = self._recorder
            if self._received is not None:
                self._received.stop()  # the recorder takes the last messages
            if recorder is not None:
                if self._shadows is not None:
                    self._shadows.finish()
                recorder.stop()
                self._last = self.status()
                self._recorder = None
            self._unsubscribe()
            return self._last if recorder is not None else None

    @property
    def recording(self) -> bool:
        """Whether a bag is being written."""
        recorder = self._recorder
        return recorder is not None and recorder.recording

    def status(self) -> RecordingStatus | None:
        """How the present recording fares, or the last one did; None when there was none."""
        recorder = self._recorder
        if recorder is None:
            return self._last
        return RecordingStatus(
            bag=str(recorder.directory),
            recording=recorder.recording,
            messages=recorder.message_count,
            dropped=recorder.dropped_messages,
            others=recorder.others,
            error=recorder.error,
        )

    def record(self, topic: str, type_name: str, data: bytes, *, qos: QoSProfile | None = None) -> None:
        """Record a serialized message that was sent or received now."""
        recorder = self._recorder
        if recorder is not None:
            offered = None if qos is None else recorded_qos(qos)
            recorder.record(topic, type_name, data, monotonic_ns=monotonic_ns(), qos=offered)

    def look(self) -> None:
        """Warn of nodes that use another type or quality of service on a topic. One thread at a time."""
        if not (chosen := self._chosen):
            return
        received = self._received
        for topic, policy in received.misfits() if received is not None else ():
            self._warn(
                topic, f"a publisher's quality of service does not fit, in {policy}: it is not recorded"
            )
        known = dict(self._node.get_topic_names_and_types())
        for topic in chosen:
            for other in set(known.get(topic.full_name, ())) - {topic.type_name}:
                if (topic.full_name, other) not in self._told:
                    self._told.add((topic.full_name, other))
                    self._warn(topic, f"other nodes use {other} on it, and none of that is recorded")

    def tell_architecture(self, observed: Observed) -> None:
        """Record what runs now."""
        recorder = self._recorder
        if recorder is not None:
            recorder.tell_architecture(self._architecture(observed))

    def _architecture(self, observed: Observed) -> bytes:
        return _serialized(
            trace_architecture(self._runtime, observed, self._bound.bindings(), others=real_time_threads())
        )

    def _choose(self, topics: Sequence[str]) -> Iterator[ChosenTopic]:
        """Each topic once; those that are recorded in any case are left out."""
        anyhow = {self._node.resolve_topic_name(name): type_name for name, type_name in _OWN.items()}
        anyhow |= self._bound.types()
        found: dict[str, ChosenTopic] = {}
        for text in topics:
            topic = self._parse(text, anyhow)
            before = found.setdefault(topic.full_name, topic)
            if before[1:] != topic[1:]:
                what = f"{before.type_name}:{before.qos} and {topic.type_name}:{topic.qos}"
                raise ParameterError(
                    f"topic {topic.full_name} to record: named twice, as {what}; name it once"
                )
        return (topic for name, topic in found.items() if name not in anyhow)

    def _parse(self, topic: str, anyhow: Mapping[str, str]) -> ChosenTopic:
        name, type_name, qos, *more = [*topic.split(":"), *([""] * (2 - topic.count(":")))]
        try:
            full_name = self._node.resolve_topic_name(name)
        except Exception as error:  # rclpy has an exception class of its own for each mistake
            expected = f"expected a name, found '{name}': {one_line(str(error))}"
            raise ParameterError(f"topic to record: {expected}") from error
        known = dict(self._node.get_topic_names_and_types()).get(full_name, [])
        known = [anyhow[full_name]] if full_name in anyhow else known
        if not type_name:
            if len(known) != 1:
                found = f"used with the types {' and '.join(known)}" if known else "used by nobody now"
                raise ParameterError(
                    f"topic {full_name} to record: {found}; give its type, {name}:package/msg/Type"
                )
            type_name = known[0]
        elif known and type_name not in known:
            raise ParameterError(
                f"topic {full_name} to record: used as {' and '.join(known)}, found {type_name}"
            )
        if message_class(type_name) is None or more or (qos or _BEST_EFFORT) not in QOS_NAMES:
            expected = "name, name:package/msg/Type of an installed message, and perhaps one of"
            expected = f"{expected} {', '.join(f':{word}' for word in QOS_NAMES)}"
            raise ParameterError(f"topic to record: expected {expected}; found '{topic}'")
        return ChosenTopic(name, full_name, type_name, qos or _BEST_EFFORT)

    def _unsubscribe(self) -> None:
        self._chosen = ()
        received, self._received = self._received, None
        if received is not None:
            received.close()

    def _warn(self, topic: ChosenTopic, what: str) -> None:
        self._node.get_logger().warning(f"topic {topic.full_name} to record: {what}")


def _serialized(message: Any) -> bytes:
    return bytes(serialize_message(message))


class _Sources:
    """Several sources of messages as one."""

    def __init__(self, *sources: "MessageSource") -> None:
        self._sources = sources

    def keep_messages(self, *, on: bool) -> None:
        for source in self._sources:
            source.keep_messages(on=on)

    def take_messages(self) -> Sequence[SentMessage]:
        return [message for source in self._sources for message in source.take_messages()]

    def dropped_messages(self) -> int:
        return sum(source.dropped_messages() for source in self._sources)


class RecordingOrders:
    """Carries out orders to start and stop recordings. They name folders below one, and only there."""

    def __init__(self, recording: Recording, runtime: Runtime, *, folder: Path) -> None:
        """Take the folder that bags are below."""
        self._recording = recording
        self._runtime = runtime
        self._folder = folder.absolute()

    def carry_out(self, order: RecordingOrder) -> tuple[str, str]:
        """Start or stop; returns what was done, in words, and the bag's folder.

        Raises:
            RefusalError: and nothing was started or stopped.

        """
        return self._start(order) if order.start else self._stop()

    def _start(self, order: RecordingOrder) -> tuple[str, str]:
        if not self._runtime.configured:
            raise RefusalError(
                Code.NOT_ACTIVE, "the executor is not configured; configure it first (lifecycle)"
            )
        if self._recording.recording:
            raise RefusalError(Code.ALREADY_RUNNING, "it records already; stop that first")
        bag = self._folder / (order.bag or f"mauve_{datetime.now().astimezone():%Y_%m_%d-%H_%M_%S}")
        if self._folder.resolve() not in bag.resolve().parents:
            text = (
                f"bag '{order.bag}': expected a folder below {self._folder} (the executor's parameter bags)"
            )
            raise RefusalError(Code.INVALID, text)
        try:
            split = Split(after_s=order.split_s or Split().after_s, after_bytes=order.split_bytes)
            directory = self._recording.start(bag, order.topics, split=split, values=order.values)
        except ParameterError as error:
            raise RefusalError(Code.INVALID, str(error)) from error
        except TraceError as error:
            raise RefusalError(Code.PREPARE_FAILED, str(error)) from error
        return f"recording into {directory}", str(directory)

    def _stop(self) -> tuple[str, str]:
        status = self._recording.stop()
        if status is None:
            raise RefusalError(Code.NOT_RUNNING, "nothing is being recorded")
        words = f"{status.messages:,} messages are in {status.bag}"
        if status.dropped:
            words += f"; {status.dropped:,} were dropped"
        if status.lost_before:
            words += f"; {status.lost_before:,} of other nodes were lost before they came here"
        if status.error:
            words += f"; it had ended by itself: {status.error}"
        return words, status.bag
