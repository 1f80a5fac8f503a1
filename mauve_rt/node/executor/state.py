"""What the executor tells by itself: ~/state on changes, ~/events on requests and on cores that took over."""

import functools
import threading
from collections.abc import Callable
from typing import Any

from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message

from mauve_msgs.msg import ArchitectureState, ReconfigurationEvent
from mauve_rt._kernel import Host
from mauve_rt.control.faults import FaultWatch
from mauve_rt.control.probations import ProbationWatch, Verdict
from mauve_rt.control.requests import Outcome, Request
from mauve_rt.control.runtime import Observed, Runtime
from mauve_rt.control.state_age import HangWatch
from mauve_rt.interfaces.descriptions import architecture_state, reconfiguration_event
from mauve_rt.node.executor.events import Event, Events
from mauve_rt.node.executor.recording import Recording
from mauve_rt.node.shared.watch import Watch

_WAIT_NS = 200_000_000  # how long a watching thread that should end may go on waiting
_SETTLED_S = 0.002  # what a request changed its own thread tells by then, who asked being answered first
_EVENT_DEPTH = 100


class StatePublisher:
    """~/state and ~/events. refresh() and event() may be called from any thread."""

    def __init__(self, node: LifecycleNode, runtime: Runtime, recording: Recording, watch: Watch) -> None:
        self._node = node
        self._watch = watch
        self._runtime = runtime
        self._recording = recording
        self._state_qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._event_qos = QoSProfile(depth=_EVENT_DEPTH)
        self._states = node.create_publisher(ArchitectureState, "~/state", self._state_qos)
        self._events = node.create_publisher(ReconfigurationEvent, "~/events", self._event_qos)
        self.rules: Callable[[], list[str]] = list  # names of those at work
        self.decided: Callable[[Verdict], None] = lambda _verdict: None  # about a core on probation
        self.completed: Callable[[Request, Outcome], None] = lambda _request, _outcome: None
        self.changed: Callable[[], None] = lambda: None  # the architecture, or who is in which state
        self.error = ""  # why the last lifecycle transition failed
        self._lock = threading.Lock()
        self._published_revision = -1
        self._hangs = HangWatch()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._behind = False  # of that thread
        self._queue = Events(self._publish_event, watch)

    def refresh(self, *, again: bool = False) -> Observed:
        """Publish the state if it changed since it was published last, or in any case `again`."""
        with self._lock:
            observed = self._runtime.observe()
            if again or observed.revision != self._published_revision:
                observed = self._runtime.observe(anew=True)  # how long states last is told as of the stamp
                stamp = self._node.get_clock().now().to_msg()
                state = architecture_state(
                    self._runtime, observed, stamp, error=self.error, rules=self.rules()
                )
                self._published_revision = observed.revision
                self._recording.tell_architecture(observed)
                self.send(self._states, "mauve_msgs/msg/ArchitectureState", state, self._state_qos)
            return observed

    def look_for_hung(self) -> None:
        """Tell who is hung since the last call, and who no longer is. One thread at a time."""
        turns = [*self._hangs.look(self._runtime.components())]
        for turn in turns:
            console = self._node.get_logger()
            (console.error if turn.hung else console.warning)(turn.message)
        if turns:
            self.refresh(again=True)

    def event(self, request: Request, outcome: Outcome) -> None:
        """Publish what came of a request, when its report is complete."""
        self.tell(self.take_down(request, outcome))

    def take_down(self, request: Request, outcome: Outcome) -> Event:
        """As event(), but not before tell()."""
        event = Event(request, outcome, self._node.get_clock().now().to_msg())
        self._queue.add(event)
        return event

    def tell(self, event: Event) -> None:
        """Who asked has the answer: publish the state, if that is not done yet, and then the event."""
        self._queue.tell(event)

    def flush(self) -> None:
        """Publish all events there are, with what is known by now."""
        self._queue.flush()

    def start(self, host: Host) -> None:
        """Watch the components, so that changes nobody asked for, such as faults, are published at once."""
        self._ending.clear()
        look = functools.partial(self._look, host, FaultWatch(), ProbationWatch())
        self._thread = self._watch.thread("state", look, ending=self._ending)
        self._thread.start()

    def stop(self) -> None:
        """End the watch; no event is left behind."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self.flush()

    def close(self) -> None:
        """As stop(), and there will be no event any more."""
        self.stop()
        self._queue.close()

    def _look(self, host: Host, faults: FaultWatch, probations: ProbationWatch) -> None:
        """Wait for a change, and tell of it; one that could not be told is told with the next look."""
        is_changed = host.wait_change(_WAIT_NS)
        self._look_at_probations(host, probations)
        if not is_changed and not self._behind:
            return
        self._ending.wait(_SETTLED_S)
        self._behind = True
        observed = self.refresh()
        self.changed()
        for fault in faults.look(observed.components):
            self._node.get_logger().error(f"{fault.message}: {fault.part.fault}")
            if fault.part.fell_back:
                self.event(*fault.event(observed.revision))
        self._behind = False

    def _look_at_probations(self, host: Host, watch: ProbationWatch) -> None:
        """Decide those whose time is over, and tell of the verdicts."""
        host.settle_probations()
        for verdict in watch.look(host.probations()):
            console = self._node.get_logger()
            (console.error if verdict.is_reverted else console.info)(verdict.message)
            self.event(*verdict.event(self.refresh().revision))
            self.decided(verdict)

    def _publish_event(self, event: Event) -> None:
        self.completed(event.request, event.outcome)
        self.refresh()
        instance_id = self._runtime.instance_id
        message = reconfiguration_event(
            event.request, event.outcome, stamp=event.stamp, instance_id=instance_id
        )
        self.send(self._events, "mauve_msgs/msg/ReconfigurationEvent", message, self._event_qos)

    def send(self, publisher: Any, type_name: str, message: Any, qos: QoSProfile) -> None:
        """Publish a message, and record it."""
        data = serialize_message(message)
        publisher.publish(data)
        self._recording.record(publisher.topic_name, type_name, data, qos=qos)
