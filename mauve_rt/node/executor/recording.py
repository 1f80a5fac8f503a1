"""The bags of an executor: its trace, messages it sends and receives, topics it is asked to record."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from mauve_rt._kernel import monotonic_ns
from mauve_rt.control.recorded_values import RecordedValues, choose
from mauve_rt.control.requests import Code, Outcome, RecordingOrder, RefusalError
from mauve_rt.control.runtime import Observed, Runtime
from mauve_rt.errors import MauveError, ParameterError
from mauve_rt.interfaces.descriptions import trace_architecture
from mauve_rt.interfaces.qos import recorded_qos
from mauve_rt.interfaces.recorded_shadows import RecordedShadows
from mauve_rt.model.threads import real_time_threads
from mauve_rt.node.executor.bound_resources import BoundResources
from mauve_rt.node.executor.received_topics import ReceivedTopics
from mauve_rt.node.executor.topic_choice import Choice, TopicChoice
from mauve_rt.trace.bag.recorded import SNAPSHOT_BYTES, SentMessage, Split, Window
from mauve_rt.trace.errors import TraceError

if TYPE_CHECKING:
    from mauve_rt.trace.recording.ledger import Entry
    from mauve_rt.trace.recording.recent import WrittenSnapshot
    from mauve_rt.trace.recording.recorder import MessageSource, Recorder

_SNAPSHOT_WAIT_S = 2.0


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
    """Why it ended by itself, or is paused; empty when it did not."""
    is_complete: bool
    """The recording has ended, and the bag is closed."""
    in_memory: bool = False
    """`bag` is the folder of its snapshots, and `messages` are those in memory."""

    @property
    def lost_before(self) -> int:
        """Messages of other nodes that were lost before they came here."""
        return sum(entry.lost_before for entry in self.others.values())


class RecordingBusyError(MauveError):
    """A recording is under way, or starts."""


class NotInMemoryError(MauveError):
    """A snapshot is asked for, and no recording keeps the last seconds."""


class Recording:
    """Records into one bag at a time, from a start to a stop. From any thread.

    A bag is made without the lock: while a start waits for its disk, a stop calls the start off at once.

    | member           | written by       | guarded by      |
    | ---------------- | ---------------- | --------------- |
    | `_recorder`      | start(), stop()  | exchanged whole |
    | `_is_starting`, `_is_called_off` | start(), stop() | `_lock` |
    | `_shadows`       | start()          | `_lock`         |
    | `_received`      | start(), stop()  | exchanged whole |
    | `_last`          | stop()           | exchanged whole |
    """

    def __init__(
        self,
        node: LifecycleNode,
        runtime: Runtime,
        bound: BoundResources,
        *,
        queue_bytes: int,
        waits_for_room: bool = False,
    ) -> None:
        """Take the node whose trace it is.

        `queue_bytes`: so much of other nodes' messages may wait for the recorder.
        `waits_for_room`: a disk that refuses to write pauses a recording; else it ends it.
        """
        self._node = node
        self._runtime = runtime
        self._bound = bound
        self._queue_bytes = queue_bytes
        self._waits_for_room = waits_for_room
        self._lock = threading.RLock()
        self._recorder: Recorder | None = None
        self._shadows: RecordedShadows | None = None
        self._last: Recorder | None = None  # its disk may still write
        self._is_starting = self._is_called_off = False
        self._received: ReceivedTopics | None = None
        self._choice = TopicChoice(node, bound.types)

    def start(
        self,
        bag: Path,
        topics: Sequence[str],
        *,
        split: Split,
        values: Sequence[str] = (),
        expressions: Sequence[str] = (),
        compression: str = "none",
        window: Window | None = None,
    ) -> Path:
        """Create the bag and record from now on; returns its folder, absolute.

        Args:
            bag: the folder, which must not exist yet.
            topics: further ones, each as `name`, `name:package/msg/Type` or `name:package/msg/Type:qos`. Best
                effort, the default, hears every publisher; transient_local also hears what was said before.
                What the executor sends, and what its resources are bound to, is recorded anyhow, and once.
                A name may be a pattern, `/camera/*`, which takes topics that appear later, too.
            split: when to go on in a new file.
            expressions: regular expressions; each topic whose name contains a match, as by a pattern.
            compression: of the chunks of the files, one of COMPRESSIONS.
            values: resources, or COMPONENT.PORT, whose every write is recorded, besides those of the file.
            window: there is no bag: so much stays in memory, and snapshot() creates bags below the folder.

        Raises:
            ParameterError: a value is not there; a topic is written otherwise, nobody knows its type, that is
                not installed, or the topic is used with another one.
            RecordingBusyError: a recording is under way, or starts.
            TraceError: the folder exists already or cannot be written, or stop() called this start off.

        """
        from mauve_rt.native_program import native_program  # noqa: PLC0415 - a start without a bag needs none
        from mauve_rt.trace.recording.recorder import Recorder  # noqa: PLC0415

        choice = self._choice.choose(topics, expressions)
        name = self._node.get_fully_qualified_name()
        try:
            recorded = choose(self._runtime, [*self._runtime.model.recorded, *values], name)
        except MauveError as error:
            raise ParameterError(str(error)) from error
        self._begin(choice)  # first: what is refused here leaves no folder behind
        try:
            shadows = RecordedShadows(self._runtime, name, _serialized)
            recorder = Recorder(
                self._runtime.host,
                bag.absolute(),
                node_name=name,
                split=split,
                on_error=self._node.get_logger().error,
                messages=_Sources(self._bound, RecordedValues(self._runtime, recorded), shadows),
                topics=self._received,
                keeper=native_program("bag_keeper"),
                waits_for_room=self._waits_for_room,
                compression=compression,
                window=window,
            )
            try:
                self._record_into(recorder, shadows)
            except BaseException:
                recorder.stop()
                raise
        except BaseException:
            with self._lock:
                self._unsubscribe()
            raise
        finally:
            with self._lock:
                self._is_starting = False
        return recorder.directory

    def _begin(self, choice: Choice) -> None:
        with self._lock:
            if self._is_starting:
                text = (
                    "a recording is being started: its disk has not answered yet; stop_recording calls it off"
                )
                raise RecordingBusyError(text)
            if self.recording:
                raise RecordingBusyError("it records already; stop that first")
            self.stop()
            if choice.topics or choice.patterns:
                self._received = ReceivedTopics(
                    self._node, choice, bound=self._bound.types, queue_bytes=self._queue_bytes
                )
            self._is_starting, self._is_called_off = True, False

    def _record_into(self, recorder: "Recorder", shadows: RecordedShadows) -> None:
        architecture = self._architecture(self._runtime.observe())
        with self._lock:
            if self._is_called_off:
                raise TraceError(
                    f"bag {recorder.directory}: a stop called its recording off; the bag is empty"
                )
            recorder.tell_architecture(architecture)
            recorder.start(discard=self._runtime.active)
            self._recorder, self._shadows = recorder, shadows

    def stop(self) -> RecordingStatus | None:
        """Seal the bag; returns how it went, None when nothing was recorded. May be called again.

        Where the disk does not answer within 2 s, the status is not complete, and an error is logged.
        """
        with self._lock:
            recorder = self._recorder
            self._is_called_off = self._is_starting
            if recorder is None:
                self._unsubscribe()
                return None
            if self._shadows is not None:
                self._shadows.finish()
            is_complete = recorder.stop()
            self._unsubscribe()
            self._last, self._recorder = recorder, None
            status = _status(recorder)
            if recorder.recent is not None and recorder.recent.written is not None:
                recorder.recent.written.wait(_SNAPSHOT_WAIT_S)  # else the end of the process cuts it off
        if not is_complete:
            self._node.get_logger().error(not_complete(status))
        return status

    def snapshot(self, bag: Path | None = None) -> "WrittenSnapshot":
        """Begin to write the last seconds as a new bag, on a thread of its own; the recording goes on.

        Without a `bag`, its folder is named by the time.

        Raises:
            RecordingBusyError: an earlier snapshot is still being written.
            NotInMemoryError: no recording keeps the last seconds.

        """
        recorder = self._recorder
        recent = recorder.recent if recorder is not None else None
        if recent is None:
            found = "nothing is being recorded" if recorder is None else "the recording writes a bag"
            text = f"a snapshot needs a recording into memory (snapshot_s), and {found}"
            raise NotInMemoryError(text)
        name = f"snapshot_{datetime.now().astimezone():%Y_%m_%d-%H_%M_%S_%f}"[:-3]
        written = recent.snapshot((bag or recent.directory / name).absolute())
        if written is None:
            text = f"{recent.written.directory if recent.written else 'a snapshot'} is still being written"
            raise RecordingBusyError(f"{text}; ask again when it is complete")
        return written

    @property
    def recording(self) -> bool:
        """Whether a bag is being written."""
        recorder = self._recorder
        return recorder is not None and recorder.recording

    def status(self) -> RecordingStatus | None:
        """How the present recording fares, or the last one did; None when there was none."""
        recorder = self._recorder or self._last
        return None if recorder is None else _status(recorder)

    def record(
        self,
        topic: str,
        type_name: str,
        data: bytes,
        *,
        qos: QoSProfile | None = None,
        instant_ns: int | None = None,
    ) -> None:
        """Record a serialized message that was sent or received now, or at that instant."""
        recorder = self._recorder
        if recorder is not None:
            offered = None if qos is None else recorded_qos(qos)
            when_ns = monotonic_ns() if instant_ns is None else instant_ns
            recorder.record(topic, type_name, data, monotonic_ns=when_ns, qos=offered)

    def takes(self, topic: str) -> bool:
        """Whether the topic is recorded as one of other nodes, as it was asked for."""
        received = self._received
        return received is not None and any(each.full_name == topic for each in received.chosen)

    def look(self) -> None:
        """Take topics that patterns take now, and warn of those that do not fit. One thread at a time."""
        if (received := self._received) is None:
            return
        warn = self._choice.warn_once
        for topic, policy in received.misfits():
            warn(
                topic.full_name,
                f"a publisher's quality of service does not fit, in {policy}: it is not recorded",
            )
        known = dict(self._node.get_topic_names_and_types())
        for topic in received.chosen:
            for other in set(known.get(topic.full_name, ())) - {topic.type_name}:
                warn(topic.full_name, f"other nodes use {other} on it, and none of that is recorded")
        taken = [topic.full_name for topic in received.chosen]
        for topic in self._choice.found(received.patterns, taken):
            try:
                received.add(topic)
            except ParameterError as error:
                warn(topic.full_name, str(error))

    def tell_architecture(self, observed: Observed) -> None:
        """Record what runs now."""
        recorder = self._recorder
        if recorder is not None:
            recorder.tell_architecture(self._architecture(observed))

    def _architecture(self, observed: Observed) -> bytes:
        return _serialized(
            trace_architecture(self._runtime, observed, self._bound.bindings(), others=real_time_threads())
        )

    def _unsubscribe(self) -> None:
        received, self._received = self._received, None
        if received is not None:
            received.close()


def not_complete(status: RecordingStatus) -> str:
    """Say that a recording has ended and that its disk has not written the bag yet."""
    return (
        f"{status.bag} is not complete: the recording has ended, and its disk has not answered for 2 s. "
        f"{status.messages:,} messages are in the bag. Check the bag when the disk answers: "
        f"mauve trace check {status.bag}"
    )


def _status(recorder: "Recorder") -> RecordingStatus:
    return RecordingStatus(
        bag=str(recorder.directory),
        recording=recorder.recording,
        messages=recorder.message_count,
        dropped=recorder.dropped_messages,
        others=recorder.others,
        error=recorder.error,
        is_complete=recorder.is_closed,
        in_memory=recorder.recent is not None,
    )


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

    def carry_out(self, order: RecordingOrder) -> Outcome:
        """Start, stop, or write a snapshot. TIMEOUT: the bag is not complete yet.

        Raises:
            RefusalError: and nothing was started, stopped or written.

        """
        if order.kind == "snapshot":
            return self._snapshot(order)
        return self._start(order) if order.kind == "start" else self._stop()

    def _start(self, order: RecordingOrder) -> Outcome:
        if not self._runtime.configured:
            raise RefusalError(
                Code.NOT_ACTIVE, "the executor is not configured; configure it first (lifecycle)"
            )
        window = None
        if order.snapshot_s:
            window = Window(seconds=order.snapshot_s, max_bytes=order.snapshot_bytes or SNAPSHOT_BYTES)
        if window is not None and not order.bag:
            bag = self._folder
        else:
            bag = self._below(order.bag or f"mauve_{datetime.now().astimezone():%Y_%m_%d-%H_%M_%S}")
        try:
            split = Split(
                after_s=order.split_s or Split().after_s,
                after_bytes=order.split_bytes,
                max_bytes=order.max_size_bytes,
            )
            directory = self._recording.start(
                bag,
                order.topics,
                split=split,
                values=order.values,
                expressions=order.topic_regexes,
                compression=order.compression or "none",
                window=window,
            )
        except ParameterError as error:
            raise RefusalError(Code.INVALID, str(error)) from error
        except RecordingBusyError as error:
            raise RefusalError(Code.ALREADY_RUNNING, str(error)) from error
        except TraceError as error:
            raise RefusalError(Code.PREPARE_FAILED, str(error)) from error
        where = str(directory)
        if window is not None:
            where = f"memory: the last {window.seconds:g} s, {window.max_bytes:,} bytes at most; "
            where += f"snapshots are created in {directory}"
        return Outcome(code=Code.OK, message=f"recording into {where}", bag=str(directory))

    def _below(self, name: str) -> Path:
        bag = self._folder / name
        if self._folder.resolve() not in bag.resolve().parents:
            text = f"bag '{name}': expected a folder below {self._folder} (the executor's parameter bags)"
            raise RefusalError(Code.INVALID, text)
        return bag

    def _snapshot(self, order: RecordingOrder) -> Outcome:
        try:
            written = self._recording.snapshot(self._below(order.bag) if order.bag else None)
        except NotInMemoryError as error:
            raise RefusalError(Code.NOT_RUNNING, str(error)) from error
        except RecordingBusyError as error:
            raise RefusalError(Code.ALREADY_RUNNING, str(error)) from error
        bag = str(written.directory)
        if not written.wait(_SNAPSHOT_WAIT_S):
            text = f"{bag} is still being written after {_SNAPSHOT_WAIT_S:g} s; the recording goes on. "
            return Outcome(
                code=Code.TIMEOUT, message=f"{text}Check the bag: mauve trace check {bag}", bag=bag
            )
        if written.error:
            raise RefusalError(Code.PREPARE_FAILED, written.error)
        assert written.snapshot is not None  # noqa: S101 - for mypy
        words = f"{written.messages:,} messages are in {bag}: {written.snapshot.text}"
        return Outcome(code=Code.OK, message=words, bag=bag)

    def _stop(self) -> Outcome:
        status = self._recording.stop()
        if status is None:
            raise RefusalError(Code.NOT_RUNNING, "nothing is being recorded")
        if not status.is_complete:
            return Outcome(code=Code.TIMEOUT, message=not_complete(status), bag=status.bag)
        words = f"{status.messages:,} messages are in {status.bag}"
        if status.in_memory:
            words = f"the recording into memory has ended; its snapshots are in {status.bag}"
        if status.dropped:
            words += f"; {status.dropped:,} were dropped"
        if status.lost_before:
            words += f"; {status.lost_before:,} of other nodes were lost before they came here"
        if status.error:
            words += f"; it had ended by itself: {status.error}"
        return Outcome(code=Code.OK, message=words, bag=status.bag)
