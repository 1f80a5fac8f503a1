"""The native kernel, translated one to one. Times are int64 nanoseconds of CLOCK_MONOTONIC."""

from collections.abc import Callable
from typing import Protocol, TypeAlias, final

PropertyValue: TypeAlias = bool | int | float | str

class MauveError(Exception):
    """An error of the kernel. str() is one line: what, where, expected, found, remedy.

    code is the name of an ErrorCode: 'invalid_argument', 'unknown_component', 'unknown_core',
    'undeclared_core', 'unknown_shell', 'unknown_fsm', 'unknown_resource', 'unknown_service', 'unknown_port',
    'unknown_property', 'unknown_type', 'type_mismatch', 'out_of_range', 'duplicate_name',
    'loop_without_wait', 'bad_fsm', 'bad_period', 'configure_failed', 'not_configured', 'not_running',
    'already_running', 'faulted', 'not_reconfigurable', 'adopt_refused', 'prepare_failed', 'timeout',
    'realtime_denied', 'plugin', 'io', 'internal'.
    """

    code: str
    component: str
    element: str
    expected: str
    found: str
    remedy: str

@final
class PortDescription:
    name: str
    kind: str  # 'read', 'write', 'call', 'event'
    type: str  # 'geometry_msgs/msg/Point', or 'void(package/Name)' for call ports
    resource: str  # '' when not connected
    service: str

@final
class PropertyDescription:
    name: str
    type: str  # 'bool', 'int', 'float', 'str'
    value: PropertyValue  # default, or the present value for a component
    unit: str
    description: str
    minimum: float | None
    maximum: float | None

@final
class ShellDescription:
    name: str
    ports: list[PortDescription]
    properties: list[PropertyDescription]

@final
class ServiceDescription:
    name: str
    kind: str  # as PortDescription.kind: the kind of port that connects to it
    type: str

@final
class ResourceDescription:
    name: str
    kind: str  # 'shared_data', 'ring_buffer', or the plug-in's name
    type: str
    services: list[ServiceDescription]

@final
class ComponentDescription:
    """A snapshot; fields as mauve_msgs/msg/ComponentInfo."""

    name: str
    shell: str
    core: str
    fsm: str
    state: str  # 'UNCONFIGURED', 'STOPPED', 'RUNNING', 'HELD', 'STOPPING', 'FAULTED'
    current_state: str  # FSM state being executed or waited in
    clock_ns: int
    period_ns: int
    offset_ns: int
    policy: str  # 'SCHED_FIFO' | 'SCHED_OTHER' | '' before deployment
    priority: int
    cpus: list[int]
    alternatives: list[str]
    reconfigurable: bool
    ports: list[PortDescription]
    properties: list[PropertyDescription]
    fault: str
    releases: int
    overruns: int
    skipped: int
    wakeup_p50_ns: int
    wakeup_p99_ns: int
    wakeup_max_ns: int

@final
class StepReport:
    """Fields as mauve_msgs/msg/StepReport."""

    step: str
    component: str
    from_core: str
    to_core: str
    prepare_ns: int
    blackout_ns: int
    missed_releases: int
    phase_nominal_ns: int
    phase_actual_ns: int  # NOT_MEASURED until the first release after the commit

NOT_MEASURED: int

class PythonCore(Protocol):
    """What a core written in Python offers: a method per action and guard of the FSM.

    And, if it likes, these and adopt(old), which may refuse by returning False or raising.
    """

    def configure(self) -> bool | None: ...
    def cleanup(self) -> None: ...

@final
class PluginRegistry:
    def __init__(self) -> None: ...
    def load_library(self, path: str) -> None:
        """Opens a plug-in library (RTLD_NOW | RTLD_LOCAL, never closed).

        A second call for one path does nothing.
        """
    def add_python_core(self, name: str, shell: str, factory: Callable[[object], object]) -> None:
        """factory(shell_view) -> core object.

        Its actions run on the component's thread under the interpreter's lock.
        """
    def names(self, kind: str) -> list[str]:
        """kind: 'shell', 'core', 'fsm', 'resource', 'type'."""
    def describe_shell(self, name: str) -> ShellDescription: ...
    def describe_resource(self, kind: str, type: str) -> ResourceDescription: ...
    def core_shell(self, name: str) -> str:
        """Name of the shell a core was written for."""
    def fsm_shell(self, name: str) -> str: ...

@final
class Architecture:
    def __init__(self, registry: PluginRegistry) -> None: ...
    def add_component(
        self,
        name: str,
        *,
        shell: str,
        core: str,
        fsm: str,
        priority: int = 50,
        cpus: list[int] = [],
        offset_ns: int = 0,
        period_ns: int = 0,
        overrun: str = "skip",
        max_backlog: int = 10,
        stack_bytes: int = 524288,
        alternatives: list[str] = [],
        reconfigurable: bool = True,
    ) -> None: ...
    def add_resource(
        self, name: str, *, kind: str, type: str = "", capacity: int = 0, overwrite: bool = False
    ) -> None: ...
    def connect(self, component: str, port: str, resource: str, service: str) -> None: ...
    def set_property(self, component: str, name: str, value: PropertyValue) -> None:
        """Before configure. Once configured use Deployer.set_property."""
    def publish(self, resource: str) -> None:
        """Marks a resource as bound to an outgoing topic.

        Deployer.wait_published yields what is written to it.
        """
    def configure(self) -> None: ...
    def cleanup(self) -> None: ...
    def components(self) -> list[ComponentDescription]: ...
    def resources(self) -> list[ResourceDescription]: ...

@final
class RealtimeStatus:
    granted: bool
    missing: list[str]

@final
class TraceDrain:
    records: bytes  # n * 48, layout of mauve_msgs/msg/TraceRecord, little-endian, no padding
    written: list[int]  # per component
    dropped: list[int]
    monotonic_ns: int
    realtime_ns: int

@final
class Deployer:
    """Threads of an architecture. Every call releases the interpreter's lock."""

    def __init__(
        self, architecture: Architecture, *, require_realtime: bool = False, trace: bool = True
    ) -> None: ...
    def prepare_process(self) -> None:
        """Locks memory, holds /dev/cpu_dma_latency at 0, notes what was denied.

        Called by deploy() if not before.
        """
    def deploy(self) -> None:
        """Creates the threads, meets them at the barrier, publishes the epoch, starts every component."""
    def shutdown(self) -> None:
        """Stops in reverse order (outputs written), joins the threads.

        The architecture can be deployed again.
        """
    def stop(self, component: str, timeout_ns: int = 1_000_000_000) -> None: ...
    def start(self, component: str, clock_ns: int | None = None) -> None: ...
    def get_time(self, component: str) -> int: ...
    def replace_core(
        self,
        component: str,
        core: str,
        *,
        commit_timeout_ns: int = 1_000_000_000,
        phase_timeout_ns: int = 1_000_000_000,
    ) -> StepReport:
        """Prepare, commit, retire.

        Waits up to phase_timeout_ns for the next release to measure phase_actual_ns.
        """
    def set_property(
        self, component: str, name: str, value: PropertyValue, *, commit_timeout_ns: int = 1_000_000_000
    ) -> StepReport: ...
    def realtime_status(self) -> RealtimeStatus: ...
    @property
    def epoch_ns(self) -> int: ...
    def drain_trace(self) -> TraceDrain: ...
    def trace_components(self) -> list[str]: ...
    def trace_names(self) -> list[str]: ...
    def wait_published(self, timeout_ns: int) -> list[tuple[str, bytes, int]]:
        """What was written to published resources since the last call.

        (resource, serialized message with its CDR header, writer's time), one thread at a time.
        """
    def write_resource(self, resource: str, data: bytes) -> bool:
        """Writes a serialized message to a shared_data or ring_buffer resource; False when a ring is full."""
    def read_resource(self, resource: str) -> tuple[bytes, int, int]:
        """Looks at a shared_data resource.

        (serialized message, sequence number - 0: never written, writer's time)
        """
    def wait_change(self, timeout_ns: int) -> bool:
        """Waits until any component changes its state or core (a fault included); False at the timeout."""
    def wake(self) -> None:
        """Ends every wait_published and wait_change at once (for shutting down)."""

def monotonic_ns() -> int: ...
