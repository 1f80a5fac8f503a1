"""What the executor tells by itself: ~/state on changes, ~/events on requests, /diagnostics at 1 Hz."""

import resource
import threading
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message

from mauve_msgs.msg import ArchitectureState, ReconfigurationEvent
from mauve_rt._kernel import ComponentDescription, Deployer
from mauve_rt.node.executor_messages import architecture_state, reconfiguration_event
from mauve_rt.node.executor_recording import Recording
from mauve_rt.node.executor_requests import Outcome, Request
from mauve_rt.node.executor_runtime import Runtime

_WAIT_NS = 200_000_000  # how long a watching thread that should end may go on waiting
_EVENT_DEPTH = 100


class StatePublisher:
    """~/state and ~/events. refresh() and event() may be called from any thread."""

    def __init__(self, node: LifecycleNode, runtime: Runtime, recording: Recording) -> None:
        self._node = node
        self._runtime = runtime
        self._recording = recording
        self._state_qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._event_qos = QoSProfile(depth=_EVENT_DEPTH)
        self._states = node.create_publisher(ArchitectureState, "~/state", self._state_qos)
        self._events = node.create_publisher(ReconfigurationEvent, "~/events", self._event_qos)
        self._lock = threading.Lock()
        self._published_epoch = -1
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def refresh(self, *, again: bool = False) -> None:
        """Publish the state if it changed since it was published last, or in any case `again`."""
        with self._lock:
            self._runtime.observe()
            if again or self._runtime.epoch != self._published_epoch:
                state = architecture_state(self._runtime, self._node.get_clock().now().to_msg())
                self._published_epoch = state.epoch
                self._send(self._states, "mauve_msgs/msg/ArchitectureState", state, self._state_qos)

    def event(self, request: Request, outcome: Outcome) -> None:
        """Publish what came of a request."""
        stamp = self._node.get_clock().now().to_msg()
        event = reconfiguration_event(request, outcome, stamp=stamp, instance_id=self._runtime.instance_id)
        self._send(self._events, "mauve_msgs/msg/ReconfigurationEvent", event, self._event_qos)

    def start(self, deployer: Deployer) -> None:
        """Watch the components, so that changes nobody asked for, such as faults, are published at once."""
        self._ending.clear()
        self._thread = threading.Thread(target=self._watch, args=(deployer,), name="state", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the watch."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _watch(self, deployer: Deployer) -> None:
        told: dict[str, str] = {}
        while not self._ending.is_set():
            if not deployer.wait_change(_WAIT_NS):
                continue
            self.refresh()
            faults = {part.name: part.fault for part in self._runtime.components() if part.state == "FAULTED"}
            for name, fault in faults.items():
                if told.get(name) != fault:
                    self._node.get_logger().error(f"component '{name}' is faulted: {fault}")
            told = faults

    def _send(self, publisher: Any, type_name: str, message: Any, qos: QoSProfile) -> None:
        data = serialize_message(message)
        publisher.publish(data)
        self._recording.record(publisher.topic_name, type_name, data, qos=qos)


class Diagnostics:
    """/diagnostics, one status per component and one for the process. On the node's timer only."""

    def __init__(self, node: LifecycleNode, runtime: Runtime) -> None:
        self._node = node
        self._runtime = runtime
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", QoSProfile(depth=10))
        self._overruns: dict[str, int] = {}

    def publish(self) -> None:
        """Publish once."""
        array = DiagnosticArray(status=[self._component(part) for part in self._runtime.components()])
        array.header.stamp = self._node.get_clock().now().to_msg()
        array.status.append(self._process())
        self._publisher.publish(array)

    def _component(self, part: ComponentDescription) -> Any:
        more_overruns = part.overruns - self._overruns.get(part.name, 0)
        self._overruns[part.name] = part.overruns
        level, message = DiagnosticStatus.OK, part.state.lower()
        if part.state == "FAULTED":
            level, message = DiagnosticStatus.ERROR, part.fault
        elif more_overruns > 0:
            level, message = DiagnosticStatus.WARN, f"{more_overruns} overruns since the last status"
        values = {
            "core": part.core,
            "state": part.current_state,
            "releases": part.releases,
            "overruns": part.overruns,
            "skipped": part.skipped,
            "wakeup_p50_ns": part.wakeup_p50_ns,
            "wakeup_p99_ns": part.wakeup_p99_ns,
            "wakeup_max_ns": part.wakeup_max_ns,
        }
        return self._status(part.name, level, message, values)

    def _process(self) -> Any:
        status = self._runtime.realtime_status()
        missing = list(status.missing) if status is not None else []
        usage = resource.getrusage(resource.RUSAGE_SELF)
        level = DiagnosticStatus.WARN if missing else DiagnosticStatus.OK
        message = "without real-time rights" if missing else "real-time rights granted"
        values = {
            "epoch": self._runtime.epoch,
            "missing": "; ".join(missing),
            "page_faults_major": usage.ru_majflt,
            "page_faults_minor": usage.ru_minflt,
        }
        return self._status("process", level, message, values)

    def _status(self, name: str, level: bytes, message: str, values: dict[str, object]) -> Any:
        return DiagnosticStatus(
            level=level,
            name=f"{self._node.get_fully_qualified_name()}: {name}",
            message=message,
            hardware_id=self._node.get_namespace(),
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
