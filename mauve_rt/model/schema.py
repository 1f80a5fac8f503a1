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
      drive: {kind: action_server, type: mauve_msgs/action/DriveTo, action: {name: drive_to, answer_ms: 100}}
      map: {kind: mauve_examples/Map, service: {name: map/clear, offers: clear}}
      wanted: {kind: shared_data, type: geometry_msgs/msg/Twist,
               topic: {name: cmd_vel, direction: subscribe, qos: {profile: sensor_data, depth: 1}}}
    connections:
      - [exploration.goal, goal.write]

Each setting has its description, for docs/reference/architecture_file.md. The `diagnostics` of a component
take the place of those of the executor; the figures are those since the last status:

    executor: {diagnostics: {overruns: {warn: 1, error: 10}}, sender: {priority: 70, cpus: [0]}}
    components:
      control: {..., deadline_ns: 5000000, states: {Control: {wcet_ns: 200000, max_execution_ns: 1000000}},
                diagnostics: {wakeup_max_us: {warn: 500, error: 2000}, overruns: null}}

No plug-in is needed to read a file.
"""

from collections.abc import Mapping
from typing import Any, Literal, Self

from mauve_rt._kernel import TASK_SETTINGS
from mauve_rt.file_schema.frame_names import FRAME_OF_ROBOT
from mauve_rt.file_schema.json_schema import Definitions, JsonSchema, given, has, reference, when
from mauve_rt.file_schema.kinds import (
    Choice,
    Fault,
    Faults,
    Flag,
    ListOf,
    Real,
    Scalar,
    TableOf,
    Text,
    Whole,
)
from mauve_rt.file_schema.section import Part, Section, setting
from mauve_rt.file_schema.words import listed
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.model.kernel_settings import KernelSetting, kernel_setting
from mauve_rt.model.resource_kinds import given_kinds, read_parameters, resource_schema, service_schema

PropertyValue = bool | int | float | str

QOS_NAMES = ("reliable", "best_effort", "transient_local", "sensor_data")
MAX_DEPTH = 1_000_000  # of the queue of a topic
_LONGEST_MS = 1e9
_LONGEST_NS = TASK_SETTINGS["deadline_ns"].most

_PLUGIN = r"[A-Za-z]\w*/[A-Za-z_]\w*"
_ROS_WORDS = r"[A-Za-z_]\w*(?:/[A-Za-z_]\w*)*"
PLUGIN_NAME = Text(_PLUGIN, "package/Class")
MAX_NAME = 100
_IDENTIFIER = rf"[A-Za-z]\w{{0,{MAX_NAME - 1}}}"  # the kernel's rule for all names: check_name() of names.hpp
_SUCH_NAMES = (
    f"of letters, digits and single underscores that starts with a letter, at most {MAX_NAME} characters"
)
IDENTIFIER = Text(_IDENTIFIER, f"a name {_SUCH_NAMES}", without="__")
IDENTIFIER_OR_NONE = Text(f"({_IDENTIFIER})?", f"a name {_SUCH_NAMES}", without="__")
ROS_NAME = Text(rf"(?:~/|/)?{_ROS_WORDS}", "a ROS name such as scan, /map or ~/status", without="__")
_NAMESPACE = Text(
    rf"/*(?:{_ROS_WORDS})?/*",
    "a namespace such as /robot_1",
    without="__",
    made=lambda text: "/" + text.strip("/"),
)
_VALUE_NAME = Text(r"\w+(?:\.\w+)?", "a resource, or component.port")
DEFAULT_MIRROR_HZ, MAX_MIRROR_HZ = 50.0, 1000.0
_ENDPOINT = Text(r"\w+\.\w+", "name.port or name.service")
_OUTPUT_NUMBER = Text(
    rf"{_IDENTIFIER}(?:\.\w+(?:\[\d+\])*)+",
    "a write port, a dot and the path of a number, such as command.torque or command.axes[0]",
)
_RESOURCE_KIND = Text(
    rf"{'|'.join(given_kinds())}|{_PLUGIN}",
    f"{', '.join(given_kinds())} or the name of a plug-in, package/Class",
)
_STATIC_DEPTH = 100  # as of tf2's listeners: each publisher's last message waits for who comes later
_DURATION_MS = Real(least=0, most=_LONGEST_MS)


class _Alternatives(ListOf):
    """A list of plug-ins, or the word `installed`."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        if value == "installed" or isinstance(value, list):
            return value if value == "installed" else super().read(value, place, faults)
        expected = "a list of cores, fsms and shells, or the word installed"
        faults.append(Fault(place, "form", limit=expected, found=value))
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return {"anyOf": [super().json_schema(definitions), {"const": "installed"}]}


class _Requirement(Flag):
    """True, false, or the word `warn`."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        if not isinstance(value, bool) and value != "warn":
            faults.append(Fault(place, "form", limit="true, false or the word warn", found=value))
        return value

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return {"anyOf": [super().json_schema(definitions), {"const": "warn"}]}


class ThresholdModel(Section):
    """From which figure on a status is a warning, and from which an error."""

    warn: float | None = setting(Real(above=0), "the status is a warning from this figure on", default=None)
    error: float | None = setting(Real(above=0), "the status is an error from this figure on", default=None)

    def misfit(self) -> Fault | None:
        """One of them at least, and in order."""
        if self.warn is None and self.error is None:
            return Fault((), "form", limit="warn or error or both of them")
        if self.warn is not None and self.error is not None and self.warn > self.error:
            return Fault((), "form", limit="an error that is no less than warn")
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit()."""
        return {"anyOf": [given("warn"), given("error")]}


_THRESHOLD = Part(ThresholdModel)


class DiagnosticsModel(Section):
    """Thresholds of what /diagnostics tells of a component; figures since the last status."""

    wakeup_max_us: ThresholdModel | None = setting(
        _THRESHOLD, "largest wake-up latency of the component", default=None
    )
    execution_max_us: ThresholdModel | None = setting(
        _THRESHOLD, "longest execution of a state", default=None
    )
    overruns: ThresholdModel | None = setting(_THRESHOLD, "number of overruns", default=None)
    skipped: ThresholdModel | None = setting(
        _THRESHOLD, "number of instants that overruns skipped", default=None
    )
    allocations: ThresholdModel | None = setting(
        _THRESHOLD, "number of allocations on the thread of the component", default=None
    )
    page_faults: ThresholdModel | None = setting(
        _THRESHOLD, "number of page faults of the thread of the component", default=None
    )

    def overridden_by(self, other: Self) -> Self:
        """These thresholds, but those that `other` sets, or switches off, in their place."""
        return self.changed(**{key: getattr(other, key) for key in other.given})


class SenderModel(Section):
    """The thread that sends the messages of bound topics."""

    priority: int = kernel_setting("priority", "priority of the thread", default=1)
    cpus: list[int] | None = kernel_setting(
        "cpus", "CPUs on which the thread may run; without the key any CPU"
    )
    wcet_ns: int | None = setting(
        Whole(1, _LONGEST_NS),
        "worst-case execution time of one activation, which sends all messages that wait, for the timing "
        "analysis; nothing enforces it",
        default=None,
    )
    min_interarrival_ns: int | None = setting(
        Whole(1, _LONGEST_NS),
        "least time from one activation to the next, for the timing analysis; nothing enforces it",
        default=None,
    )


class MirrorModel(Section):
    """A value that the executor publishes on a topic while it runs."""

    name: str = setting(_VALUE_NAME, "a resource, or component.port of a read or write port")
    field: str = setting(Text(), "one number of the value; without the key the whole value", default="")
    topic: str = setting(
        Text(rf"(?:(?:~/|/)?{_ROS_WORDS})?", "a ROS name such as scan, /map or ~/status", without="__"),
        "name of the topic, relative to the namespace of the executor; without the key ~/mirror/NAME",
        default="",
    )
    rate_hz: float = setting(
        Real(above=0, most=MAX_MIRROR_HZ), "most messages a second", default=DEFAULT_MIRROR_HZ
    )


class _Mirror(Part):
    """A MirrorModel, or the name alone."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        return super().read({"name": value} if isinstance(value, str) else value, place, faults)

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        name = self.section.settings["name"].kind
        return {"anyOf": [name.json_schema(definitions), super().json_schema(definitions)]}


class ExecutorModel(Section):
    """The process as a whole."""

    namespace: str = setting(
        _NAMESPACE,
        "ROS namespace of the executor; relative names of topics and services are resolved against it",
        default="/",
    )
    peers: list[str] = setting(ListOf(IDENTIFIER), "names of the other robots", default=[])
    require_realtime: bool = setting(
        Flag(), "refuse to start without the rights for real-time priorities and locked memory", default=False
    )
    diagnostics: DiagnosticsModel = setting(
        Part(DiagnosticsModel), "thresholds of /diagnostics for every component", default=DiagnosticsModel()
    )
    sender: SenderModel = setting(
        Part(SenderModel), "the thread that sends the messages of bound topics", default=SenderModel()
    )
    wakeup_us: float | None = setting(
        Real(least=0, most=_LONGEST_MS),
        "longest time from an instant to the start of its thread on this computer, for the timing analysis",
        default=None,
    )
    overhead_ns: int | None = setting(
        Whole(0, _LONGEST_NS),
        "cost of a release of a component beside its states on this computer, for the timing analysis",
        default=None,
    )
    require_schedulable: bool | str = setting(
        _Requirement(),
        "refuse a change, and rules, that the timing analysis does not prove schedulable; warn: make the "
        "change, and warn",
        default=False,
    )
    sentinel: bool = setting(
        Flag(),
        "start a process that publishes the outputs of a stop when a crash of native code ends the executor",
        default=False,
    )
    record: list[str] = setting(
        ListOf(_VALUE_NAME),
        "values that are recorded whenever the executor records: resources, or component.port",
        default=[],
    )
    mirror: list[MirrorModel] = setting(
        ListOf(_Mirror(MirrorModel)),
        "values that the executor publishes while it runs: names, or mappings with the keys below",
        default=[],
    )


class QosModel(Section):
    """Quality of service: a profile by name, and fields that say otherwise. Durations in ms, 0: none."""

    profile: Literal["reliable", "best_effort", "transient_local", "sensor_data"] = setting(
        Choice(*QOS_NAMES), "the profile that gives the value of each key that is absent", default="reliable"
    )
    reliability: Literal["reliable", "best_effort"] | None = setting(
        Choice("reliable", "best_effort"), "repair lost messages, or not", default=None
    )
    durability: Literal["volatile", "transient_local"] | None = setting(
        Choice("volatile", "transient_local"),
        "keep the last messages for subscribers that come later, or not",
        default=None,
    )
    depth: int | None = setting(
        Whole(1, MAX_DEPTH),
        "length of the queue of messages; without the key as the profile says",
        default=None,
    )
    deadline_ms: float = setting(
        _DURATION_MS, "longest expected time between two messages; 0: none", default=0.0
    )
    lifespan_ms: float = setting(
        _DURATION_MS, "a message that is older is not delivered; 0: no limit", default=0.0
    )
    liveliness: Literal["automatic", "manual_by_topic"] = setting(
        Choice("automatic", "manual_by_topic"), "how a publisher shows that it is alive", default="automatic"
    )
    lease_ms: float = setting(
        _DURATION_MS, "a publisher that is silent for longer counts as gone; 0: never", default=0.0
    )

    @property
    def is_kept(self) -> bool:
        """Whether subscribers that come later receive the last messages."""
        return (self.durability or self.profile) == "transient_local"


class _Qos(Part):
    """A QosModel, or the name of a profile."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        if isinstance(value, str) and value not in QOS_NAMES:
            expected = (
                f"{', '.join(QOS_NAMES)}, or a mapping with profile, reliability, depth, deadline_ms, ..."
            )
            faults.append(Fault(place, "form", limit=expected, found=value))
            return value
        return super().read({"profile": value} if isinstance(value, str) else value, place, faults)

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        profile = self.section.settings["profile"].kind
        return {"anyOf": [profile.json_schema(definitions), super().json_schema(definitions)]}


class TopicModel(Section):
    """The ROS topic that a resource is bound to; the name is relative to the executor's namespace."""

    name: str = setting(ROS_NAME, "name of the topic, relative to the namespace of the executor")
    direction: Literal["publish", "subscribe"] = setting(
        Choice("publish", "subscribe"),
        "publish each write to the resource, or write each received message to the resource",
    )
    qos: QosModel = setting(
        _Qos(QosModel),
        "quality of service: the name of a profile, or a mapping with the keys below",
        default=QosModel(),
    )
    driver_timeout_ms: float | None = setting(
        _DURATION_MS,
        "of what is published: the silence after which its driver is safe by itself, and the deadline that "
        "is offered; 0: no driver acts on it",
        default=None,
    )

    @property
    def offered_qos(self) -> QosModel:
        """`qos`, with the deadline that a driver may count on."""
        if not self.driver_timeout_ms or self.qos.deadline_ms:
            return self.qos
        return self.qos.changed(deadline_ms=self.driver_timeout_ms)

    def misfit(self) -> Fault | None:
        """A driver receives what is published, in time."""
        if self.driver_timeout_ms is None:
            return None
        found = self.driver_timeout_ms
        if self.direction != "publish":
            fault = Fault(
                ("driver_timeout_ms",), "form", limit="no such key, as the topic is subscribed", found=found
            )
            fault.hint = "leave it out; a rule with silence notices that nothing comes"
            return fault
        if 0 < found < self.qos.deadline_ms:
            limit = f"no less than deadline_ms, which is {self.qos.deadline_ms:g}"
            fault = Fault(("driver_timeout_ms",), "form", limit=limit, found=found)
            fault.hint = "leave deadline_ms out: the driver's time is offered"
            return fault
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit()."""
        return when(given("driver_timeout_ms"), has("direction", "publish"))


class ServiceModel(Section):
    """The ROS service that a client calls, or that a resource offers; names as TopicModel."""

    name: str = setting(ROS_NAME, "name of the service, relative to the namespace of the executor")
    offers: str | None = setting(
        IDENTIFIER,
        "call of the resource that the service runs; without the key the resource is a client of the service",
        default=None,
    )
    timeout_ms: float | None = setting(
        Real(above=0, most=_LONGEST_MS), "of a client: a call blocks no longer than this", default=None
    )


class ActionModel(Section):
    """The ROS action that an action_server offers, or an action_client uses; names as TopicModel."""

    name: str = setting(ROS_NAME, "name of the action, relative to the namespace of the executor")
    answer_ms: float | None = setting(
        Real(above=0, most=_LONGEST_MS),
        "of a server: a goal without the answer of a component is rejected after this time; of a client: the "
        "longest time for an answer of the server",
        default=None,
    )


class ResourceModel(Section):
    """Data that components share. What else it is told is of its kind, which says what that may be."""

    kind: str = setting(_RESOURCE_KIND, "kind of the resource: a given kind, or a plug-in")
    type: str = setting(
        Text(),
        "type of the values: a ROS message, a ROS service, a ROS action, or a type of a plug-in",
        default="",
    )
    topic: TopicModel | None = setting(
        Part(TopicModel), "the ROS topic that carries the values", default=None
    )
    service: ServiceModel | None = setting(
        Part(ServiceModel), "the ROS service that the resource calls or offers", default=None
    )
    action: ActionModel | None = setting(
        Part(ActionModel), "the ROS action that the resource uses or offers", default=None
    )
    frame: str | None = setting(
        FRAME_OF_ROBOT,
        "the frame that the values are in: a port or a message in another frame is refused",
        default=None,
    )
    child_frame: str | None = setting(
        FRAME_OF_ROBOT, "of poses and transforms: the frame whose pose they are", default=None
    )
    longest_hold_ns: int | None = setting(
        Whole(1, _LONGEST_NS),
        "the longest time for which one component holds its lock: the timing analysis takes it, nothing "
        "enforces it; without it, what the resource's code declares",
        default=None,
    )

    log_level: Literal["debug", "info", "warn", "error", "fatal"] | None = setting(
        Choice(*TASK_SETTINGS["log_level"].choices),
        "level from which on log lines of the resource are kept; info without it",
        default=None,
    )

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Those of its kind that it is told; of a plug-in's kind as the file has them, whatever they are."""
        told: Mapping[str, Any] = vars(self)["_parameters"]
        return told

    def parameter(self, name: str) -> Any:
        """The parameter of a given kind, or its initial value; None: the kind has no such parameter."""
        kind = given_kinds().get(self.kind)
        initial = {each.name: each.initial for each in kind.parameters} if kind is not None else {}
        return self.parameters.get(name, initial.get(name))

    @property
    def static_topic(self) -> TopicModel | None:
        """The topic of its static transforms; None: there is none."""
        name = self.parameter("static_topic")
        if self.topic is None or not name:
            return None
        qos = QosModel(profile="transient_local", depth=_STATIC_DEPTH)
        return TopicModel(name=name, direction=self.topic.direction, qos=qos)

    @property
    def ros_names(self) -> dict[str, str]:
        """The names of its topic, service or action as the file has them, by fields of ResourceInfo."""
        names = {}
        if self.topic is not None:
            names["publishes" if self.topic.direction == "publish" else "subscribes"] = self.topic.name
        if self.service is not None:
            names["offers" if self.service.offers else "calls"] = self.service.name
        if self.action is not None:
            names["offers" if self.kind == "action_server" else "calls"] = self.action.name
        return names

    @property
    def topic_type(self) -> str:
        """The message type of its topic."""
        kind = given_kinds().get(self.kind)
        return self.type or (kind.messages[-1] if kind is not None and kind.messages else "")

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, ResourceModel) and super().__eq__(other) and self.parameters == other.parameters
        )

    __hash__ = None

    def _take(self, values: Mapping[str, Any], place: Location, faults: Faults) -> None:
        super()._take({key: value for key, value in values.items() if key in self.settings}, place, faults)
        told = {key: value for key, value in values.items() if key not in self.settings}
        if (kind := given_kinds().get(str(values.get("kind")))) is not None:
            told = read_parameters(kind, told, place, faults, others=tuple(self.settings))
        vars(self)["_parameters"] = told

    @classmethod
    def json_definition(cls, definitions: Definitions) -> JsonSchema:
        """As of any section, but the kind says which other keys there are; of a plug-in's, any."""
        schema = super().json_definition(definitions)
        del schema["additionalProperties"]
        for name, kind in given_kinds().items():
            definitions[f"{name} resource"] = resource_schema(kind, others=cls.settings)
        kinds = [when(has("kind", name), reference(f"{name} resource")) for name in given_kinds()]
        of_plugin = {"properties": {"kind": {"pattern": "/"}}}
        keys = {"service": service_schema(None), "action": {"type": "null"}}
        kinds.append(when(of_plugin, {"properties": keys}))
        return {**schema, "allOf": kinds}


class StateModel(Section):
    """Times of an execution state, in the place of what the fsm's own code says."""

    max_execution_ns: int | None = setting(
        Whole(1, _LONGEST_NS),
        "bound of one execution; the watchdog faults a component that exceeds it",
        default=None,
    )
    simulated_execution_ns: int | None = setting(
        Whole(0, _LONGEST_NS), "execution time in virtual time", default=None
    )
    wcet_ns: int | None = setting(
        Whole(1, _LONGEST_NS),
        "worst-case execution time (CPU time), of a wait its guards', for the timing analysis; enforce_wcet "
        "of the component enforces that of executions",
        default=None,
    )

    def misfit(self) -> Fault | None:
        """One of them at least, and no worst case above the bound."""
        if (self.wcet_ns, self.max_execution_ns, self.simulated_execution_ns) == (None, None, None):
            return Fault((), "form", limit=f"at least one of {listed(self.settings)}")
        if self.wcet_ns is None or self.max_execution_ns is None or self.wcet_ns <= self.max_execution_ns:
            return None
        limit = f"at most max_execution_ns, which is {self.max_execution_ns}"
        fault = Fault(("wcet_ns",), "form", limit=limit, found=self.wcet_ns)
        fault.hint = "lower wcet_ns, or raise max_execution_ns"
        return fault

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit()."""
        return {"anyOf": [given(key) for key in cls.settings]}


class FramesModel(Section):
    """The frames of a port's values; at least one of them."""

    frame: str | None = setting(FRAME_OF_ROBOT, "the frame that the values are in", default=None)
    child_frame: str | None = setting(
        FRAME_OF_ROBOT, "of poses and transforms: the frame whose pose they are", default=None
    )

    def misfit(self) -> Fault | None:
        """One of them at least."""
        if self.frame is None and self.child_frame is None:
            return Fault((), "form", limit="frame or child_frame or both of them")
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit()."""
        return {"anyOf": [given(key) for key in cls.settings]}


class _Frames(Part):
    """A FramesModel, or the frame alone."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        if isinstance(value, str) and not FRAME_OF_ROBOT.fits(value):
            faults.append(Fault(place, "form", limit=FRAME_OF_ROBOT.expected, found=value))
            return value
        return super().read({"frame": value} if isinstance(value, str) else value, place, faults)

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return {"anyOf": [FRAME_OF_ROBOT.json_schema(definitions), super().json_schema(definitions)]}


class ComponentModel(Section):
    """A component and the thread it runs on."""

    shell: str = setting(PLUGIN_NAME, "plug-in of the shell: ports and properties")
    core: str = setting(PLUGIN_NAME, "plug-in of the core: data and algorithms")
    fsm: str = setting(PLUGIN_NAME, "plug-in of the fsm: the states")
    alternatives: list[str] | Literal["installed"] = setting(
        _Alternatives(PLUGIN_NAME),
        "cores, fsms and shells that may replace the present ones; installed: every plug-in that fits",
        default=[],
    )
    fallback: str | None = setting(PLUGIN_NAME, "core that takes over after a fault", default=None)
    priority: int = kernel_setting("priority", "SCHED_FIFO priority of the thread of the component")
    cpus: list[int] | None = kernel_setting(
        "cpus", "CPUs on which the thread may run; without the key any CPU"
    )
    offset_ms: float = kernel_setting("offset_ns", "time from the epoch to the first instant", in_ms=True)
    period_ns: int = kernel_setting("period_ns", "period of the grid; 0: as the fsm says")
    overrun: Literal["skip", "catch_up", "fault"] = kernel_setting(
        "overrun", "policy after an overrun: skip the missed instants, catch up, or fault"
    )
    max_backlog: int = kernel_setting(
        "max_backlog", "most instants that a component may owe with the policy catch_up"
    )
    stack_bytes: int = kernel_setting("stack_bytes", "size of the stack; the whole stack is held in memory")
    trace_records: int | None = kernel_setting(
        "trace_records", "room for trace records until they are drained; without the key by the period"
    )
    hung_after_ms: float | None = kernel_setting(
        "hung_after_ns",
        "a state that executes for longer is reported as hung; without the key 10 periods, at least 1 s",
        in_ms=True,
    )
    deadline_ns: int | None = kernel_setting(
        "deadline_ns",
        "deadline of a job after its release, for the timing analysis; without the key the next instant",
    )
    log_level: Literal["debug", "info", "warn", "error", "fatal"] = kernel_setting(
        "log_level", "level from which on log lines of the component are kept"
    )
    enforce_wcet: bool = kernel_setting(
        "enforce_wcet", "fault the component when an execution uses more CPU time than its wcet_ns"
    )
    states: dict[str, StateModel] = setting(
        TableOf(Part(StateModel), names=IDENTIFIER),
        "times of execution states by name; each replaces the time in the code of the fsm",
        default={},
    )
    reconfigurable: bool = setting(Flag(), "whether requests may change the component", default=True)
    properties: dict[str, PropertyValue] = setting(
        TableOf(Scalar()),
        "values of properties by name; without a name the default of its shell, core or fsm",
        default={},
    )
    frames: dict[str, FramesModel] = setting(
        TableOf(_Frames(FramesModel), names=IDENTIFIER),
        "frames of the values of ports by name, in addition to those in the code of the shell",
        default={},
    )
    max_slew: dict[str, float] = setting(
        TableOf(Real(above=0), names=_OUTPUT_NUMBER),
        "greatest change per second of a number that the component writes, by PORT.PATH such as "
        "command.torque, whatever its core asks for",
        default={},
    )
    diagnostics: DiagnosticsModel = setting(
        Part(DiagnosticsModel),
        "thresholds of /diagnostics in the place of those of the executor; null removes one",
        default=DiagnosticsModel(),
    )

    def task_settings(self) -> dict[str, Any]:
        """How the kernel is to run it; what the file does not say is the kernel's choice."""
        told = {
            each.name: each.to_kernel(getattr(self, key))
            for key, each in self.settings.items()
            if isinstance(each, KernelSetting) and getattr(self, key) is not None
        }
        states = {
            name: {key: getattr(state, key) for key in state.given} for name, state in self.states.items()
        }
        told |= {"states": states} if states else {}
        return told | ({"max_slew": dict(self.max_slew)} if self.max_slew else {})


class FileModel(Section):
    """A whole architecture file."""

    mauve: Literal[1] = setting(
        Choice(1), "version of the schema", hint="this program reads version 1 of the schema"
    )
    executor: ExecutorModel = setting(Part(ExecutorModel), "settings of the process", default=ExecutorModel())
    components: dict[str, ComponentModel] = setting(
        TableOf(Part(ComponentModel), names=IDENTIFIER, few=1), "components by name"
    )
    resources: dict[str, ResourceModel] = setting(
        TableOf(Part(ResourceModel), names=IDENTIFIER), "resources by name", default={}
    )
    connections: list[list[str]] = setting(
        ListOf(ListOf(_ENDPOINT, few=2, many=2)), "pairs [component.port, resource.service]", default=[]
    )


class FragmentModel(FileModel):
    """A part of an architecture file: what one step of a transaction adds."""

    components: dict[str, ComponentModel] = setting(
        TableOf(Part(ComponentModel), names=IDENTIFIER), "components by name", default={}
    )
