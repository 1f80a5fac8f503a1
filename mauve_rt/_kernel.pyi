"""The native kernel, translated one to one. Times are int64 nanoseconds of CLOCK_MONOTONIC."""

from collections.abc import Callable, Mapping, Sequence
from typing import (
    Any,
    ClassVar,
    Final,
    Literal,
    TypeAlias,
    TypedDict,
    Unpack,
    final,
    overload,
    type_check_only,
)

from mauve_rt.parts.cores import Core
from mauve_rt.parts.fsms import Fsm
from mauve_rt.parts.resources import AnyResource, Resource
from mauve_rt.parts.shells import Shell

__version__: Final[str]

PropertyValue: TypeAlias = bool | int | float | str

class MauveError(Exception):
    """An error of the kernel. str() is one line: what, where, expected, found, remedy."""

    code: str  # a key of ERROR_REPLIES
    statement: str  # what alone
    component: str
    element: str
    expected: str
    found: str
    remedy: str
    step: int  # of a transaction, from 1; 0: none
    step_name: str

# By code: the constant of mauve_msgs/msg/ReplyCode that answers a request which such an error refuses.
ERROR_REPLIES: Final[dict[str, str]]

@type_check_only
class TaskSettings(TypedDict, total=False):
    """How a component is run; of what is left out the kernel has the default. Limits: TASK_SETTINGS."""

    priority: int
    cpus: list[int]  # empty: any
    offset_ns: int
    period_ns: int  # 0: as the FSM says
    overrun: str
    max_backlog: int
    stack_bytes: int
    trace_records: int  # 0: by the period
    hung_after_ns: int  # 0: 10 periods, 1 s at least
    deadline_ns: int  # from a release to the next wait, for the analysis; 0: the next instant
    states: dict[str, StateTimes]  # of the fsm's execution states, by name

@type_check_only
class StateTimes(TypedDict, total=False):
    """Times of an execution state, in the place of the fsm's own."""

    max_execution_ns: int | None  # the bound that the watchdog enforces
    simulated_execution_ns: int | None  # what it takes in virtual time
    wcet_ns: int | None  # worst case for the timing analysis; not enforced

@final
class TaskSetting:
    """What one of TaskSettings may be. A default outside of the limits is the kernel's own choice."""

    default: Final[int | list[int] | str]
    least: Final[int]  # of the number, or of each of the numbers
    most: Final[int]
    choices: Final[list[str]]  # of a word
    hint: Final[str]

TASK_SETTINGS: Final[dict[str, TaskSetting]]

@final
class FieldShape:
    """A field of a message as its C++ struct has it."""

    name: Final[str]
    type: Final[str]  # of an element, as in .msg files: 'float64', 'string', 'geometry_msgs/msg/Point'
    text_capacity: Final[int]  # of a string; 0: any length
    is_array: Final[bool]
    is_fixed: Final[bool]  # an array of exactly `size`, not of at most
    size: Final[int]
    offset: Final[int]  # in bytes, within its struct
    fields: Final[list[FieldShape]]  # of a message within the message

@final
class MessageShape:
    """A message as its C++ struct has it."""

    type: Final[str]
    bytes: Final[int]  # of the struct
    fields: Final[list[FieldShape]]

@final
class PortDescription:
    name: Final[str]
    kind: Final[str]  # 'read', 'write', 'call', 'event'
    type: str  # 'geometry_msgs/msg/Point'; of a call port the name that its service declares
    resource: Final[str]  # '' when not connected
    service: Final[str]
    required: Final[bool]  # told of a shell's ports, not of a component's
    messages: Final[list[MessageShape]]  # likewise
    longest_hold_ns: Final[int]  # for how long a user holds its resource's lock; 0: not declared
    wait_free: Final[bool]  # it takes no lock, as ports are connected now; told of a component's ports

@final
class PropertyDescription:
    name: Final[str]
    type: Final[str]  # 'bool', 'int', 'float', 'str'
    value: Final[PropertyValue]  # default, or the present value for a component
    unit: Final[str]
    description: Final[str]
    minimum: Final[float | None]
    maximum: Final[float | None]
    structural: Final[list[str]]  # parts that read it only when they are configured: shell, core, fsm
    def check(self, value: PropertyValue) -> None:
        """Raises MauveError (type_mismatch, out_of_range) for a value that it does not take."""

@final
class ShellDescription:
    name: Final[str]
    ports: Final[list[PortDescription]]
    properties: Final[list[PropertyDescription]]
    bytes: Final[int]  # of its class; 0: not written in C++

@final
class ServiceDescription:
    name: Final[str]
    kind: Final[str]  # as PortDescription.kind: the kind of port that connects to it
    type: Final[str]
    takes_messages: Final[bool]  # a call that can be a ROS service
    messages: Final[list[MessageShape]]  # a call's request and response; none where C++ has no struct
    is_wait_free: Final[bool]  # whether a port takes no lock, as ports are connected now

@final
class ResourceDescription:
    name: Final[str]
    kind: Final[str]  # a given kind, or the plug-in's name
    type: Final[str]
    services: Final[list[ServiceDescription]]
    longest_hold_ns: Final[int]  # for how long a user holds its lock; 0: not declared

@final
class ExecutionTimeDescription:
    """How long an execution state took since its machine was configured."""

    state: Final[str]
    count: Final[int]
    mean_ns: Final[int]
    max_ns: Final[int]

@final
class DescribedState:
    """A state of an fsm; fields as mauve_msgs/msg/StateInfo."""

    name: Final[str]
    is_initial: Final[bool]
    is_wait: Final[bool]
    is_event_wait: Final[bool]
    duration_ns: Final[int]  # of a wait; of an event wait its timeout; FOREVER: it has none
    min_interarrival_ns: Final[int]  # of an event wait
    max_execution_ns: Final[int]  # of an execution state: its bound; 0: none
    simulated_execution_ns: Final[int]  # what it takes in virtual time
    successors: Final[list[str]]  # in the order in which guards are asked; last the one without a guard
    wcet_ns: Final[int]  # of an execution state: its worst case; 0: not declared

@final
class ComponentDescription:
    """A snapshot; fields as mauve_msgs/msg/ComponentInfo."""

    name: Final[str]
    shell: Final[str]
    core: Final[str]
    fsm: Final[str]
    state: Final[str]  # 'UNCONFIGURED', 'STOPPED', 'RUNNING', 'STOPPING', 'FAULTED'
    current_state: Final[str]  # FSM state being executed or waited in
    clock_ns: Final[int]
    period_ns: Final[int]
    offset_ns: Final[int]
    policy: Final[str]  # 'SCHED_FIFO' | 'SCHED_OTHER' | '' before deployment
    priority: Final[int]
    cpus: Final[list[int]]
    alternatives: Final[list[str]]
    reconfigurable: Final[bool]
    ports: Final[list[PortDescription]]
    properties: Final[list[PropertyDescription]]
    fault: Final[str]  # also of a core that the fallback has replaced
    fallback: Final[str]  # the core that takes over after a fault; '' when none was declared
    fell_back: Final[bool]  # it took over
    releases: Final[int]
    overruns: Final[int]
    skipped: Final[int]
    wakeup_p50_ns: Final[int]
    wakeup_p99_ns: Final[int]
    wakeup_max_ns: Final[int]
    allocations: Final[int]  # C++ operators new of its thread since its last start; see allocation_counting()
    page_faults: Final[int]  # of its thread since its last start, minor and major
    execution_times: Final[list[ExecutionTimeDescription]]  # one for each execution state
    # How long it has been executing current_state; of a wait: how long past its pending instant; 0: parked.
    state_age_ns: Final[int]
    state_bound_ns: Final[int]  # declared max_execution of current_state; 0: none, or a wait
    hung_after_ns: Final[int]  # an older state is told as hung
    waiting: Final[bool]  # current_state is a wait
    hung: Final[bool]
    deadline_ns: Final[int]  # declared; 0: the next instant
    overrun: Final[str]  # 'skip', 'catch_up', 'fault'
    states: Final[list[DescribedState]]  # of the fsm

@final
class RecentMaxima:
    """The largest figures of a component since they were taken last; 0 where nothing happened."""

    component: Final[str]
    wakeup_ns: Final[int]
    response_ns: Final[int]  # from the nominal instant of a release to the entry of the next wait
    execution_ns: Final[dict[str, int]]  # by execution state

@final
class StepReport:
    """Fields as mauve_msgs/msg/StepReport."""

    step: Final[str]
    component: Final[str]
    from_core: Final[str]
    to_core: Final[str]
    prepare_ns: Final[int]
    blackout_ns: Final[int]
    missed_releases: Final[int]
    phase_nominal_ns: Final[int]
    phase_actual_ns: Final[int]  # NOT_MEASURED until the first release after the commit
    remark: Final[str]  # why releases were missed; empty when none was
    shift_ns: Final[int]  # by which a new epoch made its instants later
    released_ns: Final[int]  # the instant of the release that followed
    instant_ns: Final[int]  # T: the component executes with the change from this instant on
    release_ns: Final[int]  # nominal instant of the release that followed
    taken: Final[list[str]]  # state fields that the new core took over
    left: Final[list[str]]  # state fields that it did not, with the reason

NOT_MEASURED: Final[int]

@final
class ShellView:
    """What a part written in Python reaches of its component's shell; messages in serialized form.

    Raises MauveError (not_configured) once the component is gone.
    """

    def read(self, port: str) -> tuple[bytes, int, int]:
        """(message, 0 none - 1 old - 2 new, writer's time in ns)."""
    def write(self, port: str, data: bytes) -> bool:
        """False when there was no room."""
    def call(self, port: str, *args: Any, **kwargs: Any) -> Any:
        """Calls a service in Python."""
    def raise_event(self, port: str) -> None: ...
    def property(self, name: str) -> Any:
        """The value in force."""
    def ports(self) -> list[PortDescription]: ...
    def properties(self) -> list[PropertyDescription]: ...
    def clock(self) -> int:
        """The component's logical clock, ns of CLOCK_MONOTONIC."""
    def period(self) -> int:
        """The component's period g in ns."""
    def python(self) -> Shell | None:
        """The shell's own object, when it is written in Python."""
    def implementation(self) -> str: ...

@final
class ShellBuilder:
    """Takes the declarations of a shell written in Python. `zero`: the message's default, serialized."""

    def read_port(self, name: str, type: str, zero: bytes | None, optional: bool = False) -> None: ...
    def write_port(
        self, name: str, type: str, zero: bytes | None, on_commit: str, on_stop: str, optional: bool = False
    ) -> None: ...
    def call_port(self, name: str, type: str) -> None: ...
    def event_port(self, name: str, optional: bool = False) -> None: ...
    def property(
        self,
        name: str,
        value: PropertyValue,
        unit: str,
        description: str,
        minimum: float | None,
        maximum: float | None,
        structural: list[str],
    ) -> None: ...

@final
class FsmBuilder:
    """Takes the declarations of a state machine written in Python; states by their names."""

    def execution(
        self, name: str, method: str, max_execution_ns: int, simulated_execution_ns: int, wcet_ns: int
    ) -> None: ...
    def wait(self, name: str, duration_ns: int) -> None: ...
    def wait_event(self, name: str, port: str, timeout_ns: int, min_interarrival_ns: int) -> None: ...
    def set_initial(self, state: str) -> None: ...
    def next(self, state: str, to: str) -> None: ...
    def transition(self, state: str, guard: str, to: str) -> None: ...

@final
class PartFactory:
    """How to make a part written in Python."""

    def __init__(
        self, kind: Literal["shell", "core", "fsm", "resource"], name: str, make: Callable[..., object]
    ) -> None: ...
    @property
    def kind(self) -> str: ...
    @property
    def name(self) -> str: ...

@final
class DataResource:
    """A resource of a data type. `zero`: the message's default, serialized; None when it is no message."""

    def __init__(
        self,
        *,
        kind: str,
        type: str,
        parameters: dict[str, PropertyValue],
        zero: bytes | None,
    ) -> None: ...

@final
class ResourceParameter:
    """What one resource of a kind can be told."""

    def __init__(
        self,
        name: str,
        initial: PropertyValue,
        *,
        unit: str = "",
        description: str = "",
        minimum: float | None = None,
        maximum: float | None = None,
        required: bool = False,
    ) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def type(self) -> str:
        """As PropertyDescription.type."""
    @property
    def initial(self) -> PropertyValue:
        """Unless told otherwise."""
    @property
    def description(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def minimum(self) -> float | None: ...
    @property
    def maximum(self) -> float | None: ...
    @property
    def required(self) -> bool: ...
    @property
    def counts_values(self) -> bool:
        """So many values more take memory."""
    @property
    def limits_readers(self) -> bool:
        """So many ports may connect to the service `read`."""
    @property
    def file_key(self) -> str:
        """Its key in architecture files: `capacity`, or `service.timeout_ms`."""

@final
class ResourceKind:
    """What a kind of resource tells of itself."""

    name: Final[str]
    parameters: Final[list[ResourceParameter]]
    type_kind: Final[str]  # of what its type is: 'type' or 'call_type' of a registry; '': it has none
    messages: Final[list[str]]  # as which its topic may say it, the last where no type is given
    values: Final[int]  # so many take memory, besides those that parameters count
    has_one_writer: Final[bool]

def given_resource_kinds() -> list[ResourceKind]:
    """The kinds that the kernel gives, in their order."""

@final
class PluginGeneration:
    """Entries of a registry that are not in force: after begin_generation() those of before."""

    def __init__(self) -> None: ...

@final
class PluginRegistry:
    def __init__(self) -> None: ...
    def load_library(self, path: str) -> None:
        """Opens a plug-in library (RTLD_NOW | RTLD_LOCAL, never closed).

        A second call for one path does nothing.
        """
    def begin_generation(self, number: int, replaced: PluginGeneration) -> None:
        """Lets what is added take the place of entries of the same name, until end_generation()."""
    def end_generation(self) -> None: ...
    def drop(self, kind: str, name: str) -> None:
        """Within a generation: takes out what the new code has no more."""
    def exchange(self, other: PluginGeneration) -> None:
        """Puts the kept entries in force and keeps those that go out."""
    def generation_of(self, kind: str, name: str) -> int:
        """1 as first loaded; 0: there is no such entry."""
    def type_shapes(self) -> list[MessageShape]:
        """The structs of the registered data types."""
    def add_python_core(self, name: str, shell: str, factory: Callable[[ShellView], object]) -> None:
        """factory(shell_view) -> core object.

        Its actions run on the component's thread under the interpreter's lock.
        """
    def shell(self, name: str, shell_class: type[Shell]) -> None:
        """Registers a class under a name, package/Class."""
    def core(self, name: str, core_class: type[Core[Any]], shell_name: str) -> None: ...
    def fsm(self, name: str, fsm_class: type[Fsm[Any, Any]], shell_name: str) -> None: ...
    def resource(self, name: str, resource_class: type[Resource]) -> None:
        """`name` is its kind in architecture files, its parameters are the keys."""
    def resource_kind(self, name: str) -> ResourceKind:
        """Given, or registered."""
    def names(self, kind: str) -> list[str]:
        """kind: 'shell', 'core', 'fsm', 'resource', 'type'."""
    def value_bytes(self, type: str) -> int:
        """What a value of a registered data type takes, in bytes; 0 when it is none."""
    def describe_shell(self, name: str) -> ShellDescription: ...
    @overload
    def describe_resource(self, kind: str, type: str) -> ResourceDescription: ...
    @overload
    def describe_resource(self, resource: AnyResource) -> ResourceDescription: ...
    def core_shell(self, name: str) -> str:
        """Name of the shell a core was written for."""
    def fsm_shell(self, name: str) -> str: ...

@final
class Component:
    """One component of an architecture, by name: it keeps the architecture. For ordinary threads."""

    @property
    def name(self) -> str: ...
    @property
    def shell(self) -> Any:
        """Its shell's object; None when that is written in C++."""
    @property
    def core(self) -> Any:
        """Its core's object; None when that is written in C++. Not while somebody replaces the core."""
    @property
    def state(self) -> str:
        """As ComponentDescription.state."""
    def get_time(self) -> int:
        """The nominal instant of the last entry of the initial state."""
    def describe(self) -> ComponentDescription: ...
    def is_configured(self) -> bool: ...
    def configure(self) -> None: ...
    def cleanup(self) -> None: ...
    def set_property(self, name: str, value: PropertyValue) -> None:
        """At once before the start, else in the component's next wait."""
    def cleanup_core(self) -> None:
        """Listing 3 of the paper: of a stopped component, cleanup_core, replace_core, configure_core."""
    def replace_core(self, core: str | type[Core[Any]]) -> None: ...
    def configure_core(self) -> None: ...
    def swap_core(
        self,
        core: str | type[Core[Any]],
        *,
        commit_timeout_ns: int = 1_000_000_000,
        phase_timeout_ns: int = 1_000_000_000,
    ) -> StepReport:
        """Replaces the core in flight: prepare, commit inside a wait, retire the old one."""

@final
class ArchitectureDescription:
    """Equal to another exactly when nothing was changed; str() has one line a fact."""

    def __eq__(self, value: object) -> bool: ...
    __hash__: ClassVar[None]  # type: ignore[assignment]

@final
class Transaction:
    """A list of steps that take effect as one, or not at all; nothing happens before Host.commit.

    Parts are classes or registered names. Each step returns the transaction.
    """

    def __init__(self) -> None: ...
    def add(
        self, kind: str, target: str = "", name: str = "", value: PropertyValue | None = None
    ) -> Transaction:
        """A step by the name of its kind, with no object in it; the calls below are the same, typed."""
    def replace_core(
        self, component: str, core: str | type[Core[Any]], probation: ProbationOptions | None = None
    ) -> Transaction:
        """With `probation`, an fsm that the same transaction replaces is on probation with the core."""
    def shadow(self, component: str, core: str, budget_ns: int) -> Transaction:
        """A candidate executes in parallel with the core; its budget is for one release, on average."""
    def replace_fsm(self, component: str, fsm: str | type[Fsm[Any, Any]]) -> Transaction:
        """The new one goes on in the wait of the same name, where the pending instant lies on its grid.

        Else it starts in its initial state, on its own period, on the deployment's epoch.
        """
    def replace_shell(self, component: str, shell: str | type[Shell]) -> Transaction:
        """Ports keep their connections by name, properties their values."""
    def set_property(self, component: str, name: str, value: PropertyValue) -> Transaction: ...
    def connect(self, component: str, port: str, resource: str, service: str) -> Transaction: ...
    def disconnect(self, component: str, port: str) -> Transaction: ...
    def add_component(
        self,
        name: str,
        shell: str | type[Shell],
        core: str | type[Core[Any]],
        fsm: str | type[Fsm[Any, Any]],
        *,
        properties: dict[str, PropertyValue] = {},
        alternatives: list[str] = [],
        fallback: str = "",
        reconfigurable: bool = True,
        **settings: Unpack[TaskSettings],
    ) -> Transaction:
        """It arrives STOPPED; a start step starts it."""
    def remove_component(self, name: str) -> Transaction: ...
    @overload
    def add_resource(
        self, name: str, resource: AnyResource, *, topic: str = "", longest_hold_ns: int = 0
    ) -> Transaction: ...
    @overload
    def add_resource(
        self,
        name: str,
        *,
        kind: str,
        type: str = "",
        topic: str = "",
        longest_hold_ns: int = 0,
        **parameters: PropertyValue,
    ) -> Transaction:
        """As Architecture.add_resource; `topic`: 'publish', 'subscribe' (as its methods) or ''."""
    def remove_resource(self, name: str) -> Transaction:
        """Refused while a port is connected to it."""
    def configure(self, component: str) -> Transaction:
        """Cleans up and configures anew one that is not running; it is STOPPED then, a fault is forgotten.

        Its hooks run before the commit; where they refuse, it is UNCONFIGURED.
        """
    def start(self, component: str, clock_ns: int | None = None) -> Transaction: ...
    def stop(self, component: str) -> Transaction: ...
    def by(self, author: str) -> Transaction:
        """Who makes the change, for Architecture.authors(); empty: the program itself."""
    def resynchronise(self) -> Transaction:
        """A new common epoch, 20 ms after the commit.

        Every component goes on in its place, all its instants later by the same, less than a period. The
        report has a line for each, with its `shift_ns`.
        """

@final
class OutputLimit:
    """What a number of an output must be; NaN breaks a bound, too. `field`: empty: each number."""

    def __init__(
        self,
        port: str,
        field: str = "",
        *,
        minimum: float | None = None,
        maximum: float | None = None,
        not_nan: bool = False,
    ) -> None: ...

@final
class ProbationOptions:
    """How long a new core is on probation, and which violations put the old core back."""

    def __init__(
        self,
        duration_ns: int,
        *,
        on_fault: bool = True,
        on_overrun: bool = False,
        on_over_declared: bool = False,
        outputs: list[OutputLimit] = [],
        min_releases: int = 1,
    ) -> None: ...

@final
class ProbationRecord:
    """One probation; fields as mauve_msgs/msg/Probation."""

    component: Final[str]
    from_core: Final[str]
    to_core: Final[str]
    verdict: Final[str]  # running, passed, reverted or inconclusive
    reason: Final[str]
    releases: Final[int]  # of the new core
    begin_ns: Final[int]
    end_ns: Final[int]  # when it was decided; while it runs: when it is over

@final
class NumberDifference:
    path: Final[str]
    count: Final[int]
    maximum: Final[float]
    rms: Final[float]
    nan: Final[int]
    live_nan: Final[int]

@final
class OutputDifference:
    port: Final[str]
    type: Final[str]
    both: Final[int]
    live_only: Final[int]
    shadow_only: Final[int]
    is_truncated: Final[bool]  # the value has more numbers than are compared
    numbers: Final[list[NumberDifference]]
    lag: Final[int | None]  # releases by which the candidate's first number is later

@final
class ShadowRecord:
    """One shadow; fields as mauve_msgs/msg/Shadow."""

    component: Final[str]
    core: Final[str]
    live_core: Final[str]
    verdict: Final[str]  # running, ended, faulted or promoted
    reason: Final[str]
    begin_ns: Final[int]
    end_ns: Final[int]
    releases: Final[int]
    compared: Final[int]
    skipped_late: Final[int]
    skipped_budget: Final[int]
    idle: Final[int]
    over_budget: Final[int]
    budget_ns: Final[int]
    largest_execution_ns: Final[int]
    outputs: Final[list[OutputDifference]]

@final
class TransactionReport:
    steps: Final[list[StepReport]]
    revision: Final[int]  # of the architecture, after
    prepare_ns: Final[int]
    blackout_ns: Final[int]  # the longest of any component's
    is_complete: Final[bool]  # False: a release that follows has not come yet
    instant_ns: Final[int]  # T; NOT_MEASURED when the transaction changed no running component

@final
class Committed:
    """A transaction that is in force. Others may change what it did while its report is asked for."""

    def report(self, phase_timeout_ns: int = 0) -> TransactionReport:
        """What it cost, so far; waits up to so long for the releases that follow. May be called again."""

@final
class Architecture:
    """Components and resources, connected. Parts are classes written in Python or registered names."""

    def __init__(self, registry: PluginRegistry) -> None: ...
    def add_component(
        self,
        name: str,
        shell: str | type[Shell],
        core: str | type[Core[Any]],
        fsm: str | type[Fsm[Any, Any]],
        *,
        alternatives: list[str] = [],
        fallback: str | type[Core[Any]] | None = None,
        reconfigurable: bool = True,
        **settings: Unpack[TaskSettings],
    ) -> Component:
        """`fallback`: the core that takes over after a fault."""
    def component(self, name: str) -> Component: ...
    @overload
    def add_resource(self, name: str, resource: AnyResource, *, longest_hold_ns: int = 0) -> None: ...
    @overload
    def add_resource(
        self,
        name: str,
        *,
        kind: str,
        type: str = "",
        longest_hold_ns: int = 0,
        **parameters: PropertyValue,
    ) -> None:
        """Adds a resource of a kind; PluginRegistry.resource_kind tells its parameters.

        `longest_hold_ns`: the longest execution for which one user holds its lock, for the timing analysis:
        nothing enforces it. 0: what the resource's own code declares.
        """
    def connect(self, component: str, port: str, resource: str, service: str) -> None: ...
    def commit(self, transaction: Transaction) -> TransactionReport:
        """Carries out a transaction, by the host if there is one; as Host.commit."""
    def set_property(self, component: str, name: str, value: PropertyValue) -> None:
        """At once before the start, else in the component's next wait."""
    def publish(self, resource: str) -> None:
        """Marks a resource as bound to an outgoing topic.

        Host.wait_published yields what is written to it.
        """
    def subscribe(self, resource: str) -> None:
        """Counts an incoming topic, which uses Host.write_resource, as a writer of a resource.

        Refused for a latest_value that has one.
        """
    def configure(self) -> None: ...
    def cleanup(self) -> None: ...
    def is_configured(self) -> bool: ...
    @property
    def pointer(self) -> int:
        """Its address, for other native modules."""
    def describe(self) -> ArchitectureDescription:
        """Components, implementations, wiring, properties, states, grids and resources, as of one moment."""
    def authors(self) -> list[tuple[str, str, str]]:
        """(target, element, author) of what was changed since the file or program made it.

        element: core, fsm, shell, state, "property NAME", "port NAME"; empty: the target itself.
        """
    def note_author(self, target: str, element: str, author: str) -> None:
        """Of a change that was made without a transaction."""
    def revision(self) -> int:
        """Grows with every committed change and every start, stop and fault; never 0."""
    def threads_left_behind(self) -> int:
        """Threads of removed components that still run a timed-out execution."""
    def components(self) -> list[ComponentDescription]: ...
    def previewed_states(self, component: str) -> list[DescribedState]:
        """The states that the component's fsm will have, before anything is configured.

        Raises:
            MauveError: it cannot be so.
        """
    def take_recent_maxima(self) -> list[RecentMaxima]:
        """Of every component, and counted anew from here on: for one caller only."""
    def resources(self) -> list[ResourceDescription]: ...

@final
class RealtimeStatus:
    granted: Final[bool]
    missing: Final[list[str]]

@final
class TraceDrain:
    records: Final[bytes]  # n * 48, layout of mauve_msgs/msg/TraceRecord, little-endian, no padding
    written: Final[list[int]]  # per component
    dropped: Final[list[int]]
    monotonic_ns: Final[int]
    realtime_ns: Final[int]

class Host:
    """What runs an architecture: a Deployer, on threads, or a SimulatedHost, in virtual time.

    An architecture has one host at a time. Every call releases the interpreter's lock. In virtual time
    nothing happens while the caller waits: waits return at once, and preparing takes no time.
    """

    def prepare_process(self) -> None:
        """On threads: locks memory, holds /dev/cpu_dma_latency at 0, notes what was denied.

        Called by deploy() if not before.
        """
    def deploy(self) -> None:
        """Publishes the epoch and starts every component; a simulation deploys all its hosts at once.

        On threads: creates these, meets them at the barrier first. Shortens the interpreter's switch interval
        to 0.1 ms where it is longer, for components in Python.
        """
    def shutdown(self) -> None:
        """Stops in reverse order (outputs written), joins the threads; waits for nobody's preparation.

        The architecture can be deployed again.
        """
    def stop(self, component: str, timeout_ns: int = 1_000_000_000, *, force: bool = False) -> bool:
        """Stops a component at the end of its state; a wait ends at once.

        By force: a component that still executes a state, or a guard, at the time-out is given up. It is
        FAULTED, its outputs are written as on a stop, and its thread is left behind until the state ends.
        True when that was done. A core that loops in Python is given up like any other. An extension that
        never releases the interpreter's lock stops all Python of the process, this call included.

        Raises:
            MauveError: not_running; timeout, and the stop stays pending: it takes effect when the state ends.
        """
    def start(self, component: str, clock_ns: int | None = None) -> None: ...
    def get_time(self, component: str) -> int: ...
    def commit(
        self,
        transaction: Transaction,
        *,
        dry_run: bool = False,
        expected_revision: int = 0,
        commit_timeout_ns: int = 1_000_000_000,
        phase_timeout_ns: int = 1_000_000_000,
        force: bool = False,
    ) -> TransactionReport:
        """Carries out a transaction, deployed or not.

        It takes effect at one logical instant T: each component takes its change on its own thread, in its
        wait, before its first release at or after T. No component waits for another one. A component that
        never comes to a wait stops the change from being made: timeout, and nothing is changed. A component
        that is late at T takes its change at the end of its overrun. Until then it runs its old parts.

        By force: a component that is removed, stopped or given new parts, and whose state does not end within
        the commit's time-out, is stopped by force, as stop() says. It stays FAULTED whatever becomes of the
        transaction. The commit is tried once more, without the thread of one that is removed or stopped; for
        new parts it is refused (faulted): remove the component and add it anew, in one transaction.

        Raises MauveError with the number of the failed step (`step`); nothing was changed then.
        """
    def make(
        self,
        transaction: Transaction,
        *,
        dry_run: bool = False,
        expected_revision: int = 0,
        commit_timeout_ns: int = 1_000_000_000,
        force: bool = False,
    ) -> Committed:
        """As commit(), but waits for no release that follows: ask what it returns."""
    def settle_probations(self) -> None:
        """Decides the probations whose time is over, and retires what they have put out."""
    def probations(self) -> list[ProbationRecord]:
        """Of each component the last verdict, then the core on probation now."""
    def shadows(self) -> list[ShadowRecord]:
        """Of each component the shadow that runs, or the last one that has ended."""
    def revert_probation(self, component: str, reason: str, timeout_ns: int = 1_000_000_000) -> bool:
        """Puts the old core back; False: no core is on probation, or it was decided before.

        Raises MauveError (timeout): the request stays pending.
        """
    def replace_core(
        self,
        component: str,
        core: str | type[Core[Any]],
        *,
        commit_timeout_ns: int = 1_000_000_000,
        phase_timeout_ns: int = 1_000_000_000,
    ) -> StepReport:
        """Prepare, commit, retire.

        A name must be one that the component declares; a class is the program's own choice.

        Waits up to phase_timeout_ns for the next release to measure phase_actual_ns.
        """
    def set_property(
        self, component: str, name: str, value: PropertyValue, *, commit_timeout_ns: int = 1_000_000_000
    ) -> StepReport: ...
    def describe(self) -> ArchitectureDescription:
        """As Architecture.describe."""
    def is_deployed(self) -> bool: ...
    def now_ns(self) -> int:
        """Now, as the components see it."""
    def realtime_status(self) -> RealtimeStatus: ...
    @property
    def epoch_ns(self) -> int:
        """The instant that all grids are counted from; 0 before deployment."""
    def collect_trace(self, period_ns: int) -> None:
        """Let a native thread empty the rings so often, for drain_trace(); 0: no longer."""
    def drain_trace(self) -> TraceDrain: ...
    def trace_components(self) -> list[str]:
        """Names by the numbers that records carry; those of removed components stay."""
    def trace_names(self) -> list[str]: ...
    def wait_published(self, timeout_ns: int) -> list[tuple[str, bytes, int]]:
        """What was written to published resources since the last call.

        (resource, serialized message with its CDR header, writer's time), one thread at a time.
        """
    def write_resource(self, resource: str, data: bytes) -> bool:
        """Writes a serialized message to a given resource, raises an event; False when a ring is full."""
    def read_resource(self, resource: str) -> tuple[bytes, int, int]:
        """Looks at a shared_data resource.

        (serialized message, sequence number - 0: never written, writer's time)
        """
    def wait_change(self, timeout_ns: int) -> bool:
        """Waits until any component changes its state or core (a fault included); False at the timeout."""
    def wake(self) -> None:
        """Ends every wait_published and wait_change at once (for shutting down)."""

@final
class ValueLog:
    """Every write to the resource of a name, also when another one takes that name. For one thread."""

    def __init__(self, architecture: Architecture, resource: str, *, bytes: int = 1048576) -> None:
        """Keep writes from now on, as many as have room in about so many bytes: 16 to 8,192.

        Raises:
            MauveError: there is no such resource, or it has no values.
        """
    def take(self) -> list[tuple[bytes, int]]:
        """(serialized message, writer's time in ns) of each write since the last call, in order."""
    def end(self) -> None:
        """Keep no more; what was not taken is gone. May be called again."""
    @property
    def lost(self) -> int:
        """Writes that found no room."""

@final
class Deployer(Host):
    """The host of threads: one for each component."""

    def __init__(
        self, architecture: Architecture, *, require_realtime: bool = False, trace: bool = True
    ) -> None: ...

@final
class SimulatedHost(Host):
    """The host of one architecture in virtual time; from Simulation.add, which it keeps."""

@final
class Simulation:
    """Architectures in virtual time on the calling thread, the same every time.

    Time passes without the interpreter's lock; callbacks and components written in Python take it.
    An exception of a callback ends run_until, which may be called again. A reference from a callback to the
    simulation's owner lives until shutdown().
    """

    def __init__(self, *, trace: bool = True, begin_ns: int = 1_000_000_000) -> None: ...
    def add(self, architecture: Architecture) -> SimulatedHost:
        """Takes in a configured architecture, before deploy(), which lives as long as the simulation.

        Returns what runs it, to command and change it by, from callbacks or between two run_until().
        """
    def deploy(self) -> None:
        """Gives all components one epoch and starts them."""
    def shutdown(self) -> None:
        """Stops every component, drops the callbacks and lets the architectures go."""
    def at(self, instant_ns: int, callback: Callable[[], object]) -> None:
        """Calls back once, at the instant or now if that is past."""
    def every(self, first_ns: int, period_ns: int, callback: Callable[[], object]) -> None: ...
    def run_until(self, instant_ns: int) -> None:
        """Lets virtual time pass up to the instant, that instant included."""
    def now_ns(self) -> int: ...
    def epoch_ns(self) -> int:
        """The instant that all grids are counted from; 0 before deploy()."""

def allocation_counting() -> str:
    """Which C++ allocations the counters see: 'none', 'some' or 'all'.

    'none' under a sanitizer. 'some': not those inside the C++ standard library (streams), when the process
    had loaded it before; start it with LD_PRELOAD=libmauve_rt.so and it is 'all'. malloc, called directly by
    C code or by the interpreter, is never counted.
    """

def monotonic_ns() -> int: ...

END_SIGNALS: set[int]
"""Signals that end a process in order: see wait_end_signal()."""

STOP_TIMEOUT_NS: int
"""How long a state may go on after a stop of all components, before its component is given up."""

def process_ends() -> bool:
    """Whether one of END_SIGNALS came: nothing is deployed any more."""

def wait_end_signal(*, grace_ns: int, dump_signal: int = 0) -> int:
    """Sleep until one of END_SIGNALS comes, which all threads have to block; returns it.

    Before it returns, every deployer of the process is shut down for good: outputs are safe. None of that
    needs the interpreter's lock. The process ends `grace_ns` after the signal at the latest, with status 1;
    it raises `dump_signal` then, for a handler that shows where the threads are.
    """

# ---- rules: the engine that the supervisor, virtual time and tools share; instants are the caller's

@final
class ConditionParameter:
    """What a condition may be told."""

    @property
    def name(self) -> str: ...
    @property
    def type(self) -> str:
        """bool, int, float or str.

        Of a text what it is (topic, message_type, component, resource, field, executor), or the texts that it
        can be, as 'wake_up|response'.
        """
    @property
    def unit(self) -> str: ...
    @property
    def minimum(self) -> float | None: ...
    @property
    def maximum(self) -> float | None: ...
    @property
    def initial(self) -> bool | int | float | str | None: ...
    @property
    def required(self) -> bool: ...

@final
class ConditionKind:
    """A row of the table of conditions."""

    @property
    def name(self) -> str: ...
    @property
    def summary(self) -> str:
        """When it holds."""
    @property
    def parameters(self) -> list[ConditionParameter]: ...

def condition_kinds() -> list[ConditionKind]:
    """All conditions that there are."""

@final
class WhenSpec:
    """A tree of conditions: `kind` one of the table, or all, any, not, at_least (with `count`)."""

    def __init__(
        self,
        kind: str,
        *,
        parameters: Mapping[str, bool | int | float | str] = {},
        parts: Sequence[WhenSpec] = [],
        count: int = 0,
        for_ns: int = 0,
        within_ns: int = 0,
    ) -> None: ...

@final
class RuleSpec:
    """One rule; `about`: the components that it changes, of which only one rule at a time decides."""

    def __init__(
        self,
        name: str,
        when: WhenSpec,
        *,
        for_ns: int = 0,
        undoes: bool = False,
        undo_for_ns: int = 0,
        cooldown_ns: int = 0,
        priority: int = 0,
        about: Sequence[str] = [],
        otherwise_after_ns: int | None = None,
        takes_over: bool = False,
    ) -> None: ...

@final
class SignalSpec:
    """What one condition hears."""

    @property
    def kind(self) -> str:
        """A kind of SignalKind in rules/signal.hpp: message, write, field, overruns ..."""
    @property
    def target(self) -> str: ...
    @property
    def detail(self) -> str: ...

@final
class PendingAction:
    """What an engine wants done now: do, undo or otherwise. cause_ns: since when its condition is so."""

    @property
    def rule(self) -> int: ...
    @property
    def act(self) -> str: ...
    @property
    def cause_ns(self) -> int: ...
    @property
    def measured(self) -> float: ...

@final
class RuleDecision:
    """One decision. decision: as in SupervisorDecision.msg; why: in words, '' where there is no reason."""

    @property
    def stamp_ns(self) -> int: ...
    @property
    def rule(self) -> int: ...
    @property
    def decision(self) -> str: ...
    @property
    def act(self) -> str: ...
    @property
    def why(self) -> str: ...
    @property
    def other(self) -> int | None:
        """The rule that outranks it, or whose action is under way."""
    @property
    def cause_ns(self) -> int:
        """Since when the condition is as it is."""
    @property
    def sample_ns(self) -> int:
        """What made it so: the last sample before a silence, the first one beyond a bound."""
    @property
    def wait_ns(self) -> int: ...
    @property
    def measured(self) -> float: ...

@final
class RuleStatus:
    """How one rule fares. next: 'do' or 'undo' if nothing changes, and when."""

    @property
    def armed(self) -> bool: ...
    @property
    def holds(self) -> bool: ...
    @property
    def in_effect(self) -> bool: ...
    @property
    def changed_by_another(self) -> bool: ...
    @property
    def since_ns(self) -> int: ...
    @property
    def measured(self) -> float: ...
    @property
    def next(self) -> str | None: ...
    @property
    def next_ns(self) -> int | None: ...

@final
class RuleEngine:
    """Decides what rules want done, and when. All but tell, wake and wait from one thread.

    Raises MauveError (invalid_argument) for what cannot be so, IndexError for a rule that there is not.
    """

    def __init__(self, rules: Sequence[RuleSpec]) -> None: ...
    @property
    def signals(self) -> list[SignalSpec]:
        """One for each condition that listens; several may hear the same."""
    def tell(self, signal: int, time_ns: int, value: float = 0.0) -> None:
        """Something was heard. One thread at a time for each signal."""
    def arm(self, now_ns: int) -> None:
        """All rules are present."""
    def set_present(self, rule: int, present: bool, now_ns: int) -> None:
        """Whether all that the rule is about is there and runs."""
    def set_in_place(self, rule: int, act: str, in_place: bool, now_ns: int) -> None:
        """Whether what the act would do is in effect."""
    def set_own(self, rule: int, is_own: bool) -> None:
        """Whether what its do would do is in effect by a rule; it is until the opposite is said."""
    def set_ready(self, rule: int, act: str, ready: bool) -> None:
        """Whether the act could begin at once."""
    def adopt(self, rule: int, now_ns: int) -> None:
        """What the rule does is in effect already: it is undone when it is time."""
    def forget(self, rule: int | None = None) -> None:
        """The architecture is another one."""
    def step(self, now_ns: int) -> int:
        """Look at all conditions; the instant at which to step again at the latest."""
    @property
    def pending(self) -> PendingAction | None: ...
    def begun(self, now_ns: int) -> None:
        """The pending action is being carried out."""
    def ended(self, rule: int, act: str, how: str, now_ns: int) -> None:
        """An action that was begun has ended. How: done, refused, stale, withdrawn or timed_out."""
    def gives_way(self, rule: int) -> str | None:
        """The action of the rule that is to be called off, for that of a rule of higher rank."""
    def take(self) -> RuleDecision | None:
        """The next decision that was not taken yet."""
    def lost(self) -> int:
        """Decisions that found no room."""
    def status(self, rule: int) -> RuleStatus: ...
    def wake(self) -> None:
        """Ends a wait."""
    def word(self) -> int:
        """Changes with all that is of interest; for wait()."""
    def wait(self, word: int, until_ns: int) -> bool:
        """Sleep until the word is another one (True) or until the instant of CLOCK_MONOTONIC (False)."""

@final
class ActionStep:
    """One step of what a rule does: its kind, and the names and the plain value that it takes."""

    def __init__(
        self, kind: str, target: str = "", name: str = "", value: bool | float | str | None = None
    ) -> None: ...

@final
class RuleActions:
    """What a rule does and undoes; no `undo`: nothing. reserve: stop or safe_outputs."""

    def __init__(
        self,
        do: Sequence[ActionStep],
        *,
        undo: Sequence[ActionStep] = [],
        reserve: str = "stop",
    ) -> None: ...

@final
class ToldDecision:
    """A decision, and of `done` and `failed` what came of the action."""

    @property
    def decision(self) -> RuleDecision: ...
    @property
    def report(self) -> TransactionReport | None: ...
    @property
    def failure(self) -> str:
        """Why it is not in force, in words."""

@final
class RuleFacts:
    """How one rule of a RuleRunner fares."""

    @property
    def name(self) -> str: ...
    @property
    def status(self) -> RuleStatus: ...
    @property
    def ready(self) -> bool:
        """Whether what it would do or undo next could begin."""
    @property
    def problem(self) -> str:
        """Why that cannot be made ready, or what the rule hears not be heard."""
    @property
    def memory_bytes(self) -> int:
        """What is kept prepared."""

@final
class RuleRunner:
    """Rules at work beside the components of a host, on native threads: they need no Python to act.

    Raises MauveError (invalid_argument, unknown_component, unknown_resource ...) for what cannot be there.
    """

    def __init__(
        self,
        host: Host,
        rules: Sequence[RuleSpec],
        actions: Sequence[RuleActions],
        topics: Mapping[str, str] = {},
    ) -> None:
        """`actions`: of the rules, in their order. `topics`: topic -> the resource that is bound to it."""
    def start(self) -> None:
        """Begin to watch; the host is deployed."""
    def stop(self) -> None:
        """Nothing is done any more; what is in effect stays so. May be called again."""
    def wait_told(self, timeout_ns: int) -> list[ToldDecision]:
        """Decisions not taken yet; waits for one at most so long, or until wake()."""
    def wake(self) -> None:
        """End that wait, now and from now on."""
    def facts(self) -> list[RuleFacts]: ...
    def beat(self) -> None:
        """Say that the executor's Python side works, for conditions `node_silent`."""
    def lost(self) -> int:
        """Decisions that were left out, because those before them were not taken in time."""
    def advance(self) -> int:
        """In virtual time: do all that is due now; when to call again at the latest."""
