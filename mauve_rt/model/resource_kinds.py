"""Kinds of resources: which keys one has in a file and what they may be, as the registry tells it."""

from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from mauve_rt._kernel import PluginRegistry, ResourceKind, ResourceParameter, given_resource_kinds
from mauve_rt.file_schema.json_schema import JsonSchema, given, when
from mauve_rt.file_schema.kinds import Fault, Faults, Flag, Kind, Real, Text, Whole
from mauve_rt.file_schema.section import Setting
from mauve_rt.file_schema.yaml_file import Location

_INT64 = 2**63
_CAPACITY = "capacity"  # with a field behind a point, or as a mapping by fields: of sequences of the type
_SEQUENCE = Whole(1, 1_000_000_000)
EXAMPLES_OF_TYPES: Mapping[str, str] = {
    "type": "geometry_msgs/msg/Point",
    "call_type": "std_srvs/srv/SetBool",
    "action_type": "mauve_msgs/action/DriveTo",
}
"""A ROS type for each kind of types of resources."""


@cache
def given_kinds() -> Mapping[str, ResourceKind]:
    """The kinds that the kernel gives, by name, in its order; a registry knows those of plug-ins too."""
    return {kind.name: kind for kind in given_resource_kinds()}


def capacities(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the parameters of a resource that are capacities of sequences."""
    return {name: value for name, value in parameters.items() if name.startswith(f"{_CAPACITY}.")}


def has_key(kind: ResourceKind, key: str) -> bool:
    """Whether a resource of the kind has the key in a file: `capacity`, or `service.timeout_ms`."""
    return any(parameter.file_key == key for parameter in kind.parameters)


def given_kinds_with(key: str) -> tuple[str, ...]:
    """The given kinds that have a key."""
    return tuple(name for name, kind in given_kinds().items() if has_key(kind, key))


def is_registered(name: str, kind: ResourceKind, registry: PluginRegistry) -> bool:
    """Whether a loaded library has the type for resources of the kind."""
    return bool(kind.type_kind) and name in registry.names(kind.type_kind)


def needed_binding(kind: ResourceKind | None) -> str:
    """The key of a file without which a resource of the kind has no use: service or action; empty: none."""
    return {"call_type": "service", "action_type": "action"}.get(kind.type_kind, "") if kind else ""


def foreign_bindings(kind: ResourceKind | None) -> tuple[str, ...]:
    """Those of topic, service and action that a resource of the kind, or of a plug-in's, does not have."""
    needed = needed_binding(kind)
    return tuple(
        key for key in ("topic", "service", "action") if key != needed and (needed or key == "action")
    )


def read_parameters(
    kind: ResourceKind, values: Mapping[str, Any], place: Location, faults: Faults, *, others: tuple[str, ...]
) -> dict[str, Any]:
    """The parameters of a resource at `place` of a file; what is wrong is added to `faults`.

    `others`: the keys that a resource of any kind has. Capacities of sequences are held against the type when
    the resource is made.
    """
    known = {each.name: each for each in kind.parameters if each.file_key == each.name}
    read: dict[str, Any] = {}
    for key, value in values.items():
        if key.startswith(f"{_CAPACITY}.") and kind.type_kind == "type":
            read[key] = _SEQUENCE.read(value, (*place, key), faults)
        elif key == _CAPACITY and isinstance(value, Mapping) and kind.type_kind == "type":
            for path, count in value.items():
                read[f"{_CAPACITY}.{path}"] = _SEQUENCE.read(count, (*place, key, path), faults)
        elif key in known:
            read[key] = _read(known[key], value, (*place, key), faults)
        elif owners := given_kinds_with(key):
            faults.append(Fault((*place, key), "foreign", limit=kind.name, known=owners))
        else:
            faults.append(Fault((*place, key), "unknown", known=(*others, *known)))
    for key, parameter in known.items():
        if parameter.required and key not in read:
            faults.append(Fault(place, "lacks", limit=f"{key}: {parameter.description}"))
    return read


def parameter_setting(parameter: ResourceParameter) -> Setting:
    """What a parameter may be in a file."""
    kind, hint = _kind_of(parameter), _hint(parameter)
    return Setting(kind, parameter.description, default=parameter.initial, hint=hint)


def resource_schema(kind: ResourceKind, *, others: Iterable[str]) -> JsonSchema:
    """What a kind adds to the schema of a resource; `others`: the keys that any kind has."""
    own = [each for each in kind.parameters if each.file_key == each.name]
    keys: JsonSchema = dict.fromkeys(others, True)
    keys |= {each.name: parameter_setting(each).json_schema({}, unit=each.unit) for each in own}
    patterns = {}
    if kind.type_kind == "type":
        counts = _SEQUENCE.json_schema({})
        by_field = {"type": "object", "additionalProperties": counts}
        keys[_CAPACITY] = {"anyOf": [by_field, keys[_CAPACITY]]} if _CAPACITY in keys else by_field
        patterns = {"patternProperties": {rf"^{_CAPACITY}\.": counts}}
    if kind.type_kind:
        keys["type"] = {"minLength": 1}
    elif kind.messages:
        keys["type"] = {"enum": ["", *kind.messages]}
    keys["service"] = service_schema(kind)
    keys |= {key: {"type": "null"} for key in foreign_bindings(kind)}
    needed = [each.name for each in own if each.required]
    needed += ["type"] if kind.type_kind else []
    needed += [needed_binding(kind)] if needed_binding(kind) else []
    return {"properties": keys, "required": needed, "additionalProperties": False, **patterns}


def service_schema(kind: ResourceKind | None) -> JsonSchema:
    """What a kind, or that of a plug-in, adds to the schema of its service."""
    is_client = needed_binding(kind) == "service"
    has_timeout = kind is not None and has_key(kind, "service.timeout_ms")
    rules = [{"not": given("offers")} if is_client else given("offers")]
    rules += [] if has_timeout else [{"properties": {"timeout_ms": False}}]
    return {"type": "object", "allOf": rules} if is_client else when({"type": "object"}, {"allOf": rules})


def _read(parameter: ResourceParameter, value: Any, place: Location, faults: Faults) -> Any:
    before = len(faults)
    read = parameter_setting(parameter).read(value, place, faults)
    for fault in faults[before:]:
        if fault.what in ("least", "most") and parameter.unit:
            fault.limit = f"{fault.limit:.15g} {parameter.unit}"
    return read


def _kind_of(parameter: ResourceParameter) -> Kind:
    low, high = parameter.minimum, parameter.maximum
    match parameter.type:
        case "bool":
            return Flag()
        case "int":
            return Whole(-_INT64 if low is None else int(low), _INT64 - 1 if high is None else int(high))
        case "float":
            bounds = {"least": low, "most": high}
            return Real(**{name: bound for name, bound in bounds.items() if bound is not None})
        case _:
            return Text()


def _hint(parameter: ResourceParameter) -> str:
    """What it says, and between which bounds."""
    bounds = [f"{bound:.15g}" for bound in (parameter.minimum, parameter.maximum) if bound is not None]
    text = f"it says {parameter.description}" if parameter.description else "choose a value"
    both = 2
    if len(bounds) == both:
        text += f", {bounds[0]} to {bounds[1]} {parameter.unit}".rstrip()
    return text
