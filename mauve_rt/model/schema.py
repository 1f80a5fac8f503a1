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
               topic: {name: cmd_vel, direction: subscribe, qos: {profile: sensor_data, depth: 1}}}
    connections:
      - [exploration.goal, goal.write]

`alternatives` are the cores, fsms and shells that a component takes beside those it starts with; the word
`installed` stands for all there are. `fallback` is the core that takes over by itself after a fault.
`deadline_ns` and `states` are what the timing analysis asks for: how long after a release its work is to be
done, and how long a state executes. `wcet_ns` is its worst-case execution time; only the analysis takes it,
and nothing enforces it. `max_execution_ns` is a bound, which the watchdog enforces; the analysis takes it of
a state without `wcet_ns`. `simulated_execution_ns` is what it takes in virtual time, and no bound:

    control: {..., deadline_ns: 5000000, states: {Control: {wcet_ns: 200000, max_execution_ns: 1000000}}}

`longest_hold_ns` of a resource is the longest time for which one component holds its lock: the analysis
takes it, and nothing enforces it. It takes precedence over the time that the resource's code declares:

    map: {kind: mauve_examples/Map, longest_hold_ns: 2000000}

`trace_records` is the room for its trace until it is drained, 2,048 or more where the period is short; what
does not fit is counted as lost. A state that lasts longer than `hung_after_ms` is told as hung: an error in
/diagnostics, in ~/state and in the log; without the key after 10 periods, but no sooner than after 1 s.

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

from collections.abc import Mapping
from typing import Any, Literal, Self

from mauve_rt._kernel import TASK_SETTINGS
from mauve_rt.model.kernel_settings import KernelSetting, kernel_setting
from mauve_rt.model.kinds import (
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
from mauve_rt.model.resource_kinds import given_kinds, read_parameters
from mauve_rt.model.section import Part, Section, setting
from mauve_rt.model.words import listed
from mauve_rt.model.yaml_file import Location

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
_ENDPOINT = Text(r"\w+\.\w+", "name.port or name.service")
_RESOURCE_KIND = Text(
    rf"{'|'.join(given_kinds())}|{_PLUGIN}",
    f"{', '.join(given_kinds())} or the name of a plug-in, package/Class",
)
_DURATION_MS = Real(least=0, most=_LONGEST_MS)


class _Alternatives(ListOf):
    """A list of plug-ins, or the word `installed`."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        if value == "installed" or isinstance(value, list):
            return value if value == "installed" else super().read(value, place, faults)
        expected = "a list of cores, fsms and shells, or the word installed"
        faults.append(Fault(place, "form", limit=expected, found=value))
        return value


class ThresholdModel(Section):
    """From which figure on a status is a warning, and from which an error."""

    warn: float | None = setting(Real(above=0), default=None)
    error: float | None = setting(Real(above=0), default=None)

    def misfit(self) -> Fault | None:
        """One of them at least, and in order."""
        if self.warn is None and self.error is None:
            return Fault((), "form", limit="warn or error or both of them")
        if self.warn is not None and self.error is not None and self.warn > self.error:
            return Fault((), "form", limit="an error that is no less than warn")
        return None


_THRESHOLD = Part(ThresholdModel)


class DiagnosticsModel(Section):
    """Thresholds of what /diagnostics tells of a component; figures since the last status."""

    wakeup_max_us: ThresholdModel | None = setting(_THRESHOLD, default=None)  # the largest wake-up latency
    execution_max_us: ThresholdModel | None = setting(_THRESHOLD, default=None)  # the longest of a state
    overruns: ThresholdModel | None = setting(_THRESHOLD, default=None)
    skipped: ThresholdModel | None = setting(_THRESHOLD, default=None)  # instants
    allocations: ThresholdModel | None = setting(_THRESHOLD, default=None)  # of its thread
    page_faults: ThresholdModel | None = setting(_THRESHOLD, default=None)

    def overridden_by(self, other: Self) -> Self:
        """These thresholds, but those that `other` sets, or switches off, in their place."""
        return self.changed(**{key: getattr(other, key) for key in other.given})


class SenderModel(Section):
    """The thread that sends the messages of bound topics."""

    priority: int = kernel_setting("priority", default=1)
    cpus: list[int] | None = kernel_setting("cpus")  # absent: any


class ExecutorModel(Section):
    """The process as a whole."""

    namespace: str = setting(_NAMESPACE, default="/")
    peers: list[str] = setting(ListOf(IDENTIFIER), default=[])
    require_realtime: bool = setting(Flag(), default=False)
    diagnostics: DiagnosticsModel = setting(
        Part(DiagnosticsModel), default=DiagnosticsModel()
    )  # of every component
    sender: SenderModel = setting(Part(SenderModel), default=SenderModel())


class QosModel(Section):
    """Quality of service: a profile by name, and fields that say otherwise. Durations in ms, 0: none."""

    profile: Literal["reliable", "best_effort", "transient_local", "sensor_data"] = setting(
        Choice(*QOS_NAMES), default="reliable"
    )
    reliability: Literal["reliable", "best_effort"] | None = setting(
        Choice("reliable", "best_effort"), default=None
    )
    durability: Literal["volatile", "transient_local"] | None = setting(
        Choice("volatile", "transient_local"), default=None
    )
    depth: int | None = setting(Whole(1, MAX_DEPTH), default=None)
    deadline_ms: float = setting(_DURATION_MS, default=0.0)
    lifespan_ms: float = setting(_DURATION_MS, default=0.0)
    liveliness: Literal["automatic", "manual_by_topic"] = setting(
        Choice("automatic", "manual_by_topic"), default="automatic"
    )
    lease_ms: float = setting(_DURATION_MS, default=0.0)  # a publisher silent for longer counts as gone


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


class TopicModel(Section):
    """The ROS topic that a resource is bound to; the name is relative to the executor's namespace."""

    name: str = setting(ROS_NAME)
    direction: Literal["publish", "subscribe"] = setting(Choice("publish", "subscribe"))
    qos: QosModel = setting(_Qos(QosModel), default=QosModel())


class ServiceModel(Section):
    """The ROS service that a client calls, or that a resource offers; names as TopicModel."""

    name: str = setting(ROS_NAME)
    offers: str | None = setting(
        IDENTIFIER, default=None
    )  # the resource's call; absent: the resource is a client
    # Of a client: no call blocks longer.
    timeout_ms: float | None = setting(Real(above=0, most=_LONGEST_MS), default=None)


class ResourceModel(Section):
    """Data that components share. What else it is told is of its kind, which says what that may be."""

    kind: str = setting(_RESOURCE_KIND)
    type: str = setting(Text(), default="")
    topic: TopicModel | None = setting(Part(TopicModel), default=None)
    service: ServiceModel | None = setting(Part(ServiceModel), default=None)
    # For how long one user holds its lock; for the analysis; None: as its code declares.
    longest_hold_ns: int | None = setting(Whole(1, _LONGEST_NS), default=None)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Those of its kind that it is told; of a plug-in's kind as the file has them, whatever they are."""
        told: Mapping[str, Any] = vars(self)["_parameters"]
        return told

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


class StateModel(Section):
    """Times of an execution state, in the place of what the fsm's own code says."""

    max_execution_ns: int | None = setting(Whole(1, _LONGEST_NS), default=None)  # the watchdog enforces it
    simulated_execution_ns: int | None = setting(Whole(0, _LONGEST_NS), default=None)  # in virtual time
    wcet_ns: int | None = setting(Whole(1, _LONGEST_NS), default=None)  # for the analysis; not enforced

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


class ComponentModel(Section):
    """A component and the thread it runs on."""

    shell: str = setting(PLUGIN_NAME)
    core: str = setting(PLUGIN_NAME)
    fsm: str = setting(PLUGIN_NAME)
    alternatives: list[str] | Literal["installed"] = setting(_Alternatives(PLUGIN_NAME), default=[])
    fallback: str | None = setting(PLUGIN_NAME, default=None)
    priority: int = kernel_setting("priority")
    cpus: list[int] | None = kernel_setting("cpus")  # absent: any
    offset_ms: float = kernel_setting("offset_ns", in_ms=True)
    period_ns: int = kernel_setting("period_ns")  # 0: as the FSM says
    overrun: Literal["skip", "catch_up", "fault"] = kernel_setting("overrun")
    max_backlog: int = kernel_setting("max_backlog")
    stack_bytes: int = kernel_setting("stack_bytes")
    trace_records: int | None = kernel_setting("trace_records")  # None: by the period
    # A state that lasts longer is told as hung; None: 10 periods, 1 s at least.
    hung_after_ms: float | None = kernel_setting("hung_after_ns", in_ms=True)
    deadline_ns: int | None = kernel_setting("deadline_ns")  # None: the next instant
    states: dict[str, StateModel] = setting(TableOf(Part(StateModel), names=IDENTIFIER), default={})
    reconfigurable: bool = setting(Flag(), default=True)
    properties: dict[str, PropertyValue] = setting(TableOf(Scalar()), default={})
    diagnostics: DiagnosticsModel = setting(Part(DiagnosticsModel), default=DiagnosticsModel())

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
        return {**told, "states": states} if states else told


class FileModel(Section):
    """A whole architecture file."""

    mauve: Literal[1] = setting(Choice(1), hint="this program reads version 1 of the schema")
    executor: ExecutorModel = setting(Part(ExecutorModel), default=ExecutorModel())
    components: dict[str, ComponentModel] = setting(TableOf(Part(ComponentModel), names=IDENTIFIER, few=1))
    resources: dict[str, ResourceModel] = setting(TableOf(Part(ResourceModel), names=IDENTIFIER), default={})
    connections: list[list[str]] = setting(ListOf(ListOf(_ENDPOINT, few=2, many=2)), default=[])


class FragmentModel(FileModel):
    """A part of an architecture file: what one step of a transaction adds."""

    components: dict[str, ComponentModel] = setting(
        TableOf(Part(ComponentModel), names=IDENTIFIER), default={}
    )
