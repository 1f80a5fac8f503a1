"""The architecture file, schema version 1, and its translation into `ArchitectureModel`.

    mauve: 1
    executor: {namespace: /robot_1, peers: [robot_2], require_realtime: false}
    components:
      exploration: {shell: mauve_examples/ExplorationShell, core: mauve_examples/Exploration,
                    fsm: mauve_examples/ExplorationFsm, alternatives: [mauve_examples/LocalExploration],
                    fallback: mauve_examples/LocalExploration, trace_records: 4096,
                    priority: 40, cpus: [1], offset_ms: 0, overrun: skip, properties: {range: 5.0}}
    resources:
      target: {kind: shared_data, type: geometry_msgs/msg/Point, topic: {name: target, direction: publish}}
      lamp: {kind: client, type: std_srvs/srv/SetBool, service: {name: lamp, timeout_ms: 20}}
      map: {kind: mauve_examples/Map, service: {name: map/clear, offers: clear}}
      wanted: {kind: shared_data, type: geometry_msgs/msg/Twist,
               topic: {name: cmd_vel, direction: subscribe, qos: {profile: sensor_data, deadline_ms: 200}}}
    connections:
      - [exploration.goal, goal.write]

`alternatives` are the cores, fsms and shells that a component takes beside those it starts with; the word
`installed` stands for all there are. `fallback` is the core that takes over by itself after a fault.
`trace_records` is the room for its trace until it is drained, 2,048 or more where the period is short; what
does not fit is counted as lost.

From which figures on /diagnostics warns, for all components and for each one:

    executor: {diagnostics: {overruns: {warn: 1, error: 10}}}
    components:
      control: {..., diagnostics: {wakeup_max_us: {warn: 500, error: 2000}, execution_max_us: {error: 900}}}

Figures are those since the last status, a second before. A key of a component takes the place of the
executor's, `null` switches it off.

Messages are sent by a thread of the executor, after the components have done their work. Where a message must
not wait for other components, or for another CPU to wake up, say where it runs and how urgently:

    executor: {sender: {priority: 70, cpus: [0]}}

Nothing here looks at plug-ins, so a file can be read where none is installed.
"""

import re
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

PropertyValue = bool | int | float | str

QOS_NAMES = ("reliable", "best_effort", "transient_local", "sensor_data")
GIVEN_RESOURCES = ("shared_data", "ring_buffer", "latest_value", "event", "client")
# What an event's topic carries: a message a raise, true a raise, or how often it was raised (the default).
EVENT_TYPES = ("std_msgs/msg/Empty", "std_msgs/msg/Bool", "std_msgs/msg/UInt64")
MAX_PRIORITY = 98  # 99 is the conductor's, which commits reconfigurations
MIN_STACK_BYTES = 16_384
MAX_CAPACITY = 1_000_000
DEFAULT_READERS = 14
DEFAULT_MESSAGE_BYTES = 65_536
MAX_MESSAGE_BYTES = 2**28
MAX_READERS = 1000
MAX_TRACE_RECORDS = 1_048_576


def _plugin_name(value: str) -> str:
    if not re.fullmatch(r"[A-Za-z]\w*/[A-Za-z_]\w*", value, re.ASCII):
        raise PydanticCustomError("expected", "{text}", {"text": "package/Class"})
    return value


def _identifier(value: str) -> str:
    if not re.fullmatch(r"[A-Za-z]\w*", value, re.ASCII) or "__" in value:
        text = "a name of letters, digits and single underscores that starts with a letter"
        raise PydanticCustomError("expected", "{text}", {"text": text})
    return value


def _ros_name(value: str) -> str:
    if not re.fullmatch(r"(~/|/)?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", value, re.ASCII) or "__" in value:
        text = "a ROS name such as scan, /map or ~/status"
        raise PydanticCustomError("expected", "{text}", {"text": text})
    return value


def _namespace(value: str) -> str:
    full = "/" + value.strip("/")
    return full if full == "/" else "/" + _ros_name(full[1:])


def _endpoint(value: str) -> str:
    if not re.fullmatch(r"\w+\.\w+", value, re.ASCII):
        raise PydanticCustomError("expected", "{text}", {"text": "name.port or name.service"})
    return value


def _scalar(value: Any) -> Any:
    if isinstance(value, bool | int | float | str):
        return value
    raise PydanticCustomError("expected", "{text}", {"text": "true, false, a number or text"})


def _resource_kind(value: str) -> str:
    if value not in GIVEN_RESOURCES and "/" not in value:
        text = f"{', '.join(GIVEN_RESOURCES)} or the name of a plug-in, package/Class"
        raise PydanticCustomError("expected", "{text}", {"text": text})
    return value if value in GIVEN_RESOURCES else _plugin_name(value)


def _plugin_names_or_installed(value: Any) -> Any:
    if value == "installed" or isinstance(value, list):
        return value
    raise PydanticCustomError(
        "expected", "{text}", {"text": "a list of cores, fsms and shells, or the word installed"}
    )


def _qos(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    if value not in QOS_NAMES:
        text = f"{', '.join(QOS_NAMES)}, or a mapping with profile, reliability, depth, deadline_ms, ..."
        raise PydanticCustomError("expected", "{text}", {"text": text})
    return {"profile": value}


PluginName = Annotated[str, AfterValidator(_plugin_name)]
Identifier = Annotated[str, AfterValidator(_identifier)]
RosName = Annotated[str, AfterValidator(_ros_name)]
Endpoint = Annotated[str, AfterValidator(_endpoint)]
Cpu = Annotated[int, Field(ge=0, le=65535)]
Threshold = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Int64 = Annotated[int, Field(ge=0, le=2**63 - 1)]
Milliseconds = Annotated[float, Field(ge=0, le=1e9)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class ThresholdModel(_Section):
    """From which figure on a status is a warning, and from which an error."""

    warn: Threshold | None = None
    error: Threshold | None = None

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.warn is None and self.error is None:
            raise PydanticCustomError("expected", "{text}", {"text": "warn or error or both of them"})
        if self.warn is not None and self.error is not None and self.warn > self.error:
            raise PydanticCustomError("expected", "{text}", {"text": "an error that is no less than warn"})
        return self


class DiagnosticsModel(_Section):
    """Thresholds of what /diagnostics tells of a component; figures since the last status."""

    wakeup_max_us: ThresholdModel | None = None  # the largest wake-up latency
    execution_max_us: ThresholdModel | None = None  # the longest execution of a state
    overruns: ThresholdModel | None = None
    skipped: ThresholdModel | None = None  # instants
    allocations: ThresholdModel | None = None  # of its thread
    page_faults: ThresholdModel | None = None

    def overridden_by(self, other: Self) -> Self:
        """These thresholds, but those that `other` sets, or switches off, in their place."""
        return self.model_copy(update={key: getattr(other, key) for key in other.model_fields_set})


class SenderModel(_Section):
    """The thread that sends the messages of bound topics."""

    priority: Annotated[int, Field(ge=1, le=MAX_PRIORITY)] = 1
    cpus: Annotated[list[Cpu], Field(min_length=1)] | None = None  # absent: any


class ExecutorModel(_Section):
    """The process as a whole."""

    namespace: Annotated[str, AfterValidator(_namespace)] = "/"
    peers: list[Identifier] = []
    require_realtime: bool = False
    diagnostics: DiagnosticsModel = DiagnosticsModel()  # of every component
    sender: SenderModel = SenderModel()


class QosModel(_Section):
    """Quality of service: a profile by name, and fields that say otherwise. Durations in ms, 0: none."""

    profile: Literal["reliable", "best_effort", "transient_local", "sensor_data"] = "reliable"
    reliability: Literal["reliable", "best_effort"] | None = None
    durability: Literal["volatile", "transient_local"] | None = None
    depth: Annotated[int, Field(ge=1, le=MAX_CAPACITY)] | None = None
    deadline_ms: Milliseconds = 0
    lifespan_ms: Milliseconds = 0
    liveliness: Literal["automatic", "manual_by_topic"] = "automatic"
    lease_ms: Milliseconds = 0  # a publisher silent for longer counts as gone


class TopicModel(_Section):
    """The ROS topic that a resource is bound to; the name is relative to the executor's namespace."""

    name: RosName
    direction: Literal["publish", "subscribe"]
    qos: Annotated[QosModel, BeforeValidator(_qos)] = QosModel()


class ServiceModel(_Section):
    """The ROS service that a client calls, or that a resource offers; names as TopicModel."""

    name: RosName
    offers: Identifier | None = None  # the resource's call; absent: the resource is a client
    timeout_ms: Annotated[float, Field(gt=0, le=1e9)] = 100.0  # of a client: no call blocks longer


class ResourceModel(_Section):
    """Data that components share."""

    kind: Annotated[str, AfterValidator(_resource_kind)]
    type: str = ""
    capacity: Annotated[int, Field(ge=1, le=MAX_CAPACITY)] | None = None  # elements; ring_buffer only
    overwrite: bool = False  # a full ring_buffer drops its oldest element rather than the new one
    topic: TopicModel | None = None
    service: ServiceModel | None = None
    max_readers: Annotated[int, Field(ge=1, le=MAX_READERS)] = DEFAULT_READERS  # ports; latest_value only
    # of one message, where no plug-in registered its type: what is larger is refused and counted
    max_bytes: Annotated[int, Field(ge=1, le=MAX_MESSAGE_BYTES)] = DEFAULT_MESSAGE_BYTES

    @property
    def topic_type(self) -> str:
        """The message type of its topic."""
        return self.type or (EVENT_TYPES[-1] if self.kind == "event" else "")


class ComponentModel(_Section):
    """A component and the thread it runs on."""

    shell: PluginName
    core: PluginName
    fsm: PluginName
    alternatives: Annotated[
        list[PluginName] | Literal["installed"], BeforeValidator(_plugin_names_or_installed)
    ] = []
    fallback: PluginName | None = None
    priority: Annotated[int, Field(ge=1, le=MAX_PRIORITY)] = 50
    cpus: Annotated[list[Cpu], Field(min_length=1)] | None = None  # absent: any
    offset_ms: Annotated[float, Field(ge=0.0, le=1e9, allow_inf_nan=False)] = 0.0
    period_ns: Int64 = 0  # 0: as the FSM says
    overrun: Literal["skip", "catch_up", "fault"] = "skip"
    max_backlog: Annotated[int, Field(ge=1, le=1_000_000)] = 10
    stack_bytes: Annotated[int, Field(ge=MIN_STACK_BYTES, le=2**30)] = 524_288
    trace_records: Annotated[int, Field(ge=2, le=MAX_TRACE_RECORDS)] | None = None  # None: by the period
    reconfigurable: bool = True
    properties: dict[str, Annotated[PropertyValue, BeforeValidator(_scalar)]] = {}
    diagnostics: DiagnosticsModel = DiagnosticsModel()

    @property
    def offset_ns(self) -> int:
        """The offset from the epoch in nanoseconds."""
        return round(self.offset_ms * 1e6)


class FileModel(_Section):
    """A whole architecture file."""

    mauve: Literal[1]
    executor: ExecutorModel = ExecutorModel()
    components: Annotated[dict[Identifier, ComponentModel], Field(min_length=1)]
    resources: dict[Identifier, ResourceModel] = {}
    connections: list[Annotated[list[Endpoint], Field(min_length=2, max_length=2)]] = []


class FragmentModel(FileModel):
    """A part of an architecture file: what one step of a transaction adds."""

    components: dict[Identifier, ComponentModel] = {}
