"""The model file, schema version 1: what each key may be, and its description.

    mauve_model: 1
    package: my_robot
    shells:
      GuidanceShell:
        properties: {unit_ms: {type: int64, default: 10, minimum: 1, unit: ms, read_by: fsm}}
        ports: {goal: {read: geometry_msgs/msg/Point}, target: {write: geometry_msgs/msg/Point}}
    cores:
      Guidance:
        shell: GuidanceShell
        actions: [read_inputs, follow_path]
        guards: [has_path]
        implementations: {StraightGuidance: {wcet: {read_inputs: 0.2 ms, follow_path: 0.2 ms}}}
    fsms:
      GuidanceFsm:
        core: Guidance
        initial: Idle
        states:
          Idle: {run: read_inputs, next: [{if: has_path, to: Following}, W1]}
          Following: {run: follow_path, next: W1}
          W1: {wait: 1 * unit_ms, next: Idle}

`mauve_rt.modelling.checks` says whether the names in it fit each other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from mauve_rt.file_schema.frame_names import FRAME
from mauve_rt.file_schema.json_schema import Definitions, JsonSchema, given, has, text_form, when
from mauve_rt.file_schema.kinds import Choice, Fault, Faults, Flag, Kind, ListOf, Real, Scalar, TableOf, Text
from mauve_rt.file_schema.section import Part, Section, setting
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.modelling import durations, type_names
from mauve_rt.modelling.durations import Duration
from mauve_rt.modelling.type_names import TypeName

_NAME = r"[A-Za-z]\w{0,99}"  # the kernel's rule for all names
_NAME_WORDS = "a name of letters, digits and single underscores that starts with a letter"
NAME = Text(_NAME, _NAME_WORDS, without="__")
_PART = Text(rf"(?:[a-z]\w*/)?{_NAME}", "a name, or package/Name of another package's model", without="__")
_PACKAGE = Text(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*", "small letters, digits and single underscores")
_FIELD = Text(
    r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*", "a field's name of .msg files: small letters, digits, underscores"
)
_HEADER = Text(r"[\w./+-]+\.(?:h|hpp|hh|hxx)", "a header such as my_robot/map.hpp")
_CPP = Text(r"[A-Za-z_:][\w:<>,()&*. ]*", "a type in C++")
_MODULE = Text(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*", "a module such as my_robot.planned_guidance")
_REGISTERED = Text(r"[A-Za-z]\w*(?:/[A-Za-z_]\w*){1,2}", "package/Name or package/msg/Name")
_SERVICE = Text(
    r"[a-z]\w*/srv/[A-Za-z]\w*", "a service's type such as std_srvs/srv/SetBool, or {cpp, include, name}"
)
_LINE = Text(r"[^\r\n]*", "one line of text")
_OUTPUT = Choice("hold", "set_zero")


class _TypeName(Kind):
    """A type."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        read = type_names.parse_type(value) if isinstance(value, str) else None
        if read is None and not isinstance(value, TypeName):
            faults.append(Fault(place, "form", limit=type_names.EXPECTED, found=value))
        return value if read is None else read

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": "string", **text_form(type_names.PATTERN, expected=type_names.EXPECTED)}


class _Duration(Kind):
    """A length of time."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        read = durations.parse_duration(value) if isinstance(value, str) else None
        if read is None and not isinstance(value, Duration):
            faults.append(Fault(place, "form", limit=durations.EXPECTED, found=value))
        return value if read is None else read

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": "string", **text_form(durations.PATTERN, expected=durations.EXPECTED)}


class _OneOrMore(ListOf):
    """A list, or its one element without brackets."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        return (
            super().read(value, place, faults)
            if isinstance(value, list)
            else [self.kind.read(value, place, faults)]
        )

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return {"anyOf": [self.kind.json_schema(definitions), super().json_schema(definitions)]}


_TYPE, _TIME = _TypeName(), _Duration()


class CppType(Section):
    """A struct that exists in C++, with MAUVE_TYPE."""

    cpp: str = setting(_CPP, "the struct")
    include: str = setting(_HEADER, "its header")
    name: str = setting(_REGISTERED, "the name by which it is registered")


TypeModel = Mapping[str, TypeName] | CppType
"""A type of a model."""


class _Type(Kind):
    """The fields of a struct, or a struct that exists in C++."""

    _fields = TableOf(_TYPE, names=_FIELD, few=1)

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if isinstance(value, CppType):
            return value
        is_existing = isinstance(value, dict) and "cpp" in value
        return CppType.read(value, place, faults) if is_existing else self._fields.read(value, place, faults)

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        existing, fields = CppType.json_schema(definitions), self._fields.json_schema(definitions)
        return {"type": "object", "if": {"required": ["cpp"]}, "then": existing, "else": fields}


class PropertyModel(Section):
    """A property of a shell."""

    type: Literal["bool", "int64", "float64", "string"] = setting(
        Choice("bool", "int64", "float64", "string"), "type of the value"
    )
    default: bool | int | float | str = setting(Scalar(), "the value until it is set")
    unit: str = setting(Text(), "unit, such as m, rad or m/s", default="")
    minimum: float | None = setting(Real(), "least value", default=None)
    maximum: float | None = setting(Real(), "greatest value", default=None)
    description: str = setting(_LINE, "what it is", default="")
    read_by: list[str] = setting(
        _OneOrMore(Choice("shell", "core", "fsm")),
        "the parts that read it only when they are configured: one, or a list",
        default=[],
    )

    def misfit(self) -> Fault | None:
        """A default of another type, or out of the range; a range of what is no number."""
        is_number = self.type in ("int64", "float64")
        if not is_number and (self.minimum is not None or self.maximum is not None):
            return Fault(("type",), "form", limit="int64 or float64, as it has a range", found=self.type)
        if (rule := self._broken_rule()) is not None:
            return Fault(("default",), "form", limit=rule, found=self.default)
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit(), without the bounds of the property itself."""
        defaults: Mapping[str, JsonSchema] = {
            "bool": {"type": "boolean"},
            "int64": {"type": "integer", "minimum": -(2**63), "maximum": 2**63 - 1},
            "float64": {"type": "number"},
            "string": {"type": "string"},
        }
        rules = [
            when(has("type", name), {"properties": {"default": kind}}) for name, kind in defaults.items()
        ]
        ranged = {"anyOf": [given("minimum"), given("maximum")]}
        return {"allOf": [*rules, when(ranged, has("type", "int64", "float64"))]}

    def _broken_rule(self) -> str | None:
        value = self.default
        fits = {
            "bool": isinstance(value, bool),
            "int64": isinstance(value, int) and not isinstance(value, bool) and -(2**63) <= value < 2**63,
            "float64": isinstance(value, int | float) and not isinstance(value, bool),
            "string": isinstance(value, str),
        }
        if not fits[self.type]:
            return f"a value of type {self.type}"
        if self.minimum is not None and self.maximum is not None and self.minimum > self.maximum:
            return "a minimum that is no more than the maximum"
        if self.minimum is not None and value < self.minimum:  # type: ignore[operator] # a number
            return f"at least {self.minimum:g}, its minimum"
        if self.maximum is not None and value > self.maximum:  # type: ignore[operator]
            return f"at most {self.maximum:g}, its maximum"
        return None


class CppCall(Section):
    """A call that no message describes."""

    cpp: str = setting(_CPP, "its signature")
    include: str = setting(_HEADER, "the header of the types in it")
    name: str = setting(_REGISTERED, "the name by which ports and services fit each other")


class _Call(Kind):
    """A service's type, or a signature in C++."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if isinstance(value, CppCall):
            return value
        return (
            CppCall.read(value, place, faults)
            if isinstance(value, dict)
            else _SERVICE.read(value, place, faults)
        )

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return {"anyOf": [_SERVICE.json_schema(definitions), CppCall.json_schema(definitions)]}


class PortModel(Section):
    """A port of a shell: one of read, write, call and event."""

    read_type: TypeName | None = setting(_TYPE, "it reads values of this type", default=None, key="read")
    write: TypeName | None = setting(_TYPE, "it writes values of this type", default=None)
    call: str | CppCall | None = setting(_Call(), "it calls a service of this type", default=None)
    event: bool = setting(Flag(), "it raises an event", default=False)
    on_commit: str | None = setting(
        _OUTPUT, "what a write port has while its component is replaced", default=None
    )
    on_stop: str | None = setting(_OUTPUT, "what a write port has when its component stops", default=None)
    optional: bool = setting(Flag(), "it may stay unconnected; not of a call", default=False)
    frame: str | None = setting(FRAME, "the frame that its values are in", default=None)
    child_frame: str | None = setting(
        FRAME, "of poses and transforms: the frame whose pose they are", default=None
    )
    description: str = setting(_LINE, "what it is for", default="")

    def misfit(self) -> Fault | None:
        """Not one kind of port, or an output's setting of what is none."""
        kinds = [each for each in (self.read_type, self.write, self.call, self.event or None) if each]
        if len(kinds) != 1:
            return Fault((), "form", limit="one of read, write, call and event")
        if self.call is not None and self.optional:
            return Fault(("optional",), "form", limit="nothing: a call port is always connected")
        for name in ("on_commit", "on_stop"):
            if getattr(self, name) is not None and self.write is None:
                return Fault((name,), "form", limit="nothing: only a write port has one")
        for name in ("frame", "child_frame"):
            if getattr(self, name) is not None and self.data_type is None:
                return Fault((name,), "form", limit="nothing: only a port that reads or writes has one")
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit()."""
        written = [when(given(key), given("write")) for key in ("on_commit", "on_stop")]
        call = when(given("call"), {"properties": {"optional": {"const": False}}})
        data = {"anyOf": [given("read"), given("write")]}
        written += [when(given(key), data) for key in ("frame", "child_frame")]
        kinds = [*map(given, ("read", "write", "call")), has("event", True)]
        return {"oneOf": kinds, "allOf": [*written, call]}

    @property
    def data_type(self) -> TypeName | None:
        """The type of its values; None of a call or an event."""
        return self.read_type or self.write


class ShellModel(Section):
    """Ports and properties: the only part of a component that is visible from outside."""

    description: str = setting(_LINE, "what it is", default="")
    properties: dict[str, PropertyModel] = setting(
        TableOf(Part(PropertyModel), names=NAME), "properties by name", default={}
    )
    ports: dict[str, PortModel] = setting(TableOf(Part(PortModel), names=NAME), "ports by name", default={})


class HandoverModel(Section):
    """How a core takes over from another."""

    budget: Duration = setting(_TIME, "the time that adopt and take need together")


class ImplementationModel(Section):
    """An algorithm."""

    wcet: dict[str, Duration] = setting(
        TableOf(_TIME, names=NAME), "worst-case execution times of its actions and guards", default={}
    )
    include: str = setting(_HEADER, "the header of its class, in C++", default="")
    module: str = setting(_MODULE, "the module of its class, in Python", default="")
    description: str = setting(_LINE, "what it is", default="")


class CoreModel(Section):
    """What an fsm may call, and the algorithms that do it."""

    shell: str = setting(_PART, "the shell that it uses, also package/Name")
    description: str = setting(_LINE, "what it is", default="")
    actions: list[str] = setting(ListOf(NAME, few=1), "methods that execution states call")
    guards: list[str] = setting(ListOf(NAME), "methods that transitions ask, bool and const", default=[])
    state: dict[str, TypeName] = setting(
        TableOf(_TYPE, names=NAME),
        "values that a core which replaces it takes over, by name and type",
        default={},
    )
    handover: HandoverModel | None = setting(Part(HandoverModel), "how it takes over", default=None)
    implementations: dict[str, ImplementationModel] = setting(
        TableOf(Part(ImplementationModel), names=NAME), "its algorithms by name", default={}
    )


@dataclass(frozen=True)
class Branch:
    """Where a state leads to: `to` when the guard holds; without a guard otherwise."""

    to: str
    guard: str = ""


class _BranchModel(Section):
    to: str = setting(NAME, "the next state")
    guard: str = setting(NAME, "only if this guard of the core holds", default="", key="if")


class _Next(Kind):
    """A state's name, or a list of branches whose last one has no guard."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if not isinstance(value, list):
            return [self._branch(value, place, faults)]
        if not value:
            faults.append(Fault(place, "few", limit=1, found=value))
        return [self._branch(each, (*place, index), faults) for index, each in enumerate(value)]

    @staticmethod
    def _branch(value: Any, place: Location, faults: Faults) -> Any:
        if isinstance(value, Branch):
            return value
        if not isinstance(value, dict):
            return Branch(to=NAME.read(value, place, faults))
        before = len(faults)
        read = _BranchModel.read(value, place, faults)
        return Branch(to=read.to, guard=read.guard) if len(faults) == before else value

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        branch = {"anyOf": [NAME.json_schema(definitions), _BranchModel.json_schema(definitions)]}
        return {"anyOf": [*branch["anyOf"], {"type": "array", "items": branch, "minItems": 1}]}


class EventModel(Section):
    """A wait for an event."""

    inputs: list[str] = setting(_OneOrMore(NAME, few=1, many=1), "the read port whose resource is written")
    timeout: Duration = setting(_TIME, "it ends by then without an event; forever: it does not")
    min_interarrival: Duration = setting(_TIME, "least time from one release to the next")


class StateModel(Section):
    """A state: one of run, wait and wait_event."""

    run: str | None = setting(NAME, "the action of an execution state", default=None)
    wait: Duration | None = setting(_TIME, "the length of a wait", default=None)
    wait_event: EventModel | None = setting(Part(EventModel), "a wait for an event", default=None)
    max_execution: Duration | None = setting(
        _TIME, "longest execution of an execution state, which the watchdog enforces", default=None
    )
    next: list[Branch] = setting(
        _Next(), "where it leads to: a state, or guards in their order and a state", default=[]
    )

    def misfit(self) -> Fault | None:
        """Not one kind of state, or one that leads nowhere."""
        if sum(each is not None for each in (self.run, self.wait, self.wait_event)) != 1:
            return Fault((), "form", limit="one of run, wait and wait_event")
        if self.max_execution is not None and self.run is None:
            return Fault(("max_execution",), "form", limit="nothing: only an execution state has one")
        if not self.next and (self.wait is None or not self.wait.is_forever):
            return Fault((), "missing", limit="next")
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:  # noqa: ARG003
        """As misfit()."""
        kinds = [given(key) for key in ("run", "wait", "wait_event")]
        leads = {"if": has("wait", "forever"), "else": {"required": ["next"]}}
        return {"oneOf": kinds, "allOf": [leads, when(given("max_execution"), given("run"))]}


class FsmModel(Section):
    """A machine of states."""

    core: str = setting(_PART, "the core whose methods it calls, also package/Name")
    description: str = setting(_LINE, "what it is", default="")
    periodic: Duration | None = setting(
        _TIME, "the period of a machine that executes one state in each", default=None
    )
    initial: str = setting(NAME, "the first state")
    states: dict[str, StateModel] = setting(TableOf(Part(StateModel), names=NAME, few=1), "states by name")


class ParameterModel(PropertyModel):
    """A parameter of a resource."""

    required: bool = setting(Flag(), "architecture files have to give it", default=False)

    def misfit(self) -> Fault | None:
        """As of a property; a resource has no parts that read it."""
        if self.read_by:
            return Fault(
                ("read_by",), "form", limit="nothing: a resource reads its parameters when it is made"
            )
        return super().misfit()

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:
        """As misfit()."""
        rules = super().json_rules(definitions)["allOf"]
        return {"allOf": [*rules, {"properties": {"read_by": {"type": "array", "maxItems": 0}}}]}


class ServiceModel(Section):
    """A service of a resource, which call ports connect to."""

    call: str | CppCall = setting(_Call(), "its type: a ROS service's, or a signature in C++")
    description: str = setting(_LINE, "what it does", default="")


class ResourceModel(Section):
    """A kind of resource of the package's own. Its class is written by hand."""

    description: str = setting(_LINE, "what it is", default="")
    services: dict[str, ServiceModel] = setting(
        TableOf(Part(ServiceModel), names=NAME), "services by name", default={}
    )
    parameters: dict[str, ParameterModel] = setting(
        TableOf(Part(ParameterModel), names=NAME), "parameters by name", default={}
    )
    include: str = setting(_HEADER, "the header of its class, in C++", default="")
    module: str = setting(_MODULE, "the module of its class, in Python", default="")


class ModelFile(Section):
    """A whole model."""

    mauve_model: Literal[1] = setting(
        Choice(1), "version of the schema", hint="this program reads version 1 of the schema"
    )
    package: str = setting(_PACKAGE, "the package whose parts these are")
    types: dict[str, TypeModel] = setting(
        TableOf(_Type(), names=Text(r"[A-Z][A-Za-z0-9]*", "a message's name such as Point2D")),
        "structs, which become messages of the package; or structs that exist in C++",
        default={},
    )
    shells: dict[str, ShellModel] = setting(
        TableOf(Part(ShellModel), names=NAME), "shells by name", default={}
    )
    cores: dict[str, CoreModel] = setting(TableOf(Part(CoreModel), names=NAME), "cores by name", default={})
    fsms: dict[str, FsmModel] = setting(TableOf(Part(FsmModel), names=NAME), "fsms by name", default={})
    resources: dict[str, ResourceModel] = setting(
        TableOf(Part(ResourceModel), names=NAME), "kinds of resources by name", default={}
    )
