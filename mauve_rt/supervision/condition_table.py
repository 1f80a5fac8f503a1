"""The conditions that there are and what each may be told: the engine's own table, as files are read."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from mauve_rt._kernel import ConditionKind, ConditionParameter, condition_kinds
from mauve_rt.file_schema.json_schema import JsonSchema, mapping
from mauve_rt.file_schema.kinds import Choice, Flag, Kind, Real, Text, Whole
from mauve_rt.file_schema.setting_words import described, sentence
from mauve_rt.model.schema import IDENTIFIER, ROS_NAME

__all__ = [
    "ConditionKind",
    "ConditionParameter",
    "choices",
    "condition_schema",
    "conditions",
    "parameter_kind",
    "parameters_of",
    "roles",
]

_INT64 = 2**63
_TEXTS: Mapping[str, Text] = {
    "topic": ROS_NAME,
    "message_type": Text(r"[a-z]\w*/msg/[A-Z]\w*", "a message type such as std_msgs/msg/Float64"),
    "component": IDENTIFIER,
    "resource": IDENTIFIER,
    "executor": ROS_NAME,
    "field": Text(r"[a-z]\w*(?:\[\d+\])*(?:\.[a-z]\w*(?:\[\d+\])*)*", "a field such as pose.position.x"),
    "str": Text(r"[\s\S]+", "text that is not empty"),
}


def conditions() -> Mapping[str, ConditionKind]:
    """Every kind of condition, by name."""
    return MappingProxyType({kind.name: kind for kind in condition_kinds()})


def parameters_of(kind: str) -> Mapping[str, ConditionParameter]:
    """What a kind of condition may be told, by name."""
    return {each.name: each for each in conditions()[kind].parameters}


def choices(parameter: ConditionParameter) -> tuple[str, ...]:
    """The words that a parameter may be; none: it is no choice of words."""
    return tuple(parameter.type.split("|")) if "|" in parameter.type else ()


def parameter_kind(parameter: ConditionParameter) -> Kind:
    """What a parameter may be in a file."""
    if words := choices(parameter):
        return Choice(*words)
    low, high = parameter.minimum, parameter.maximum
    match parameter.type:
        case "bool":
            return Flag()
        case "int":
            return Whole(-_INT64 if low is None else int(low), _INT64 - 1 if high is None else int(high))
        case "float":
            bounds: dict[str, Any] = {"least": low, "most": high}
            return Real(**{name: bound for name, bound in bounds.items() if bound is not None})
        case kind:
            return _TEXTS[kind]


def condition_schema(kind: str) -> JsonSchema:
    """The parameters of a kind of condition as JSON Schema."""
    known = parameters_of(kind)
    return mapping(
        {name: _parameter_schema(each) for name, each in known.items()},
        required=[name for name, each in known.items() if each.required],
        description=sentence(f"holds while {conditions()[kind].summary}"),
    )


def _parameter_schema(parameter: ConditionParameter) -> JsonSchema:
    kind = parameter_kind(parameter)
    words = described("", kind, parameter.unit, parameter.initial)
    description = {"description": words} if words else {}
    default = {} if parameter.initial is None else {"default": parameter.initial}
    return {**kind.json_schema({}), **default, **description}


def roles(kind: str) -> Mapping[str, str]:
    """What each parameter of a kind of condition means: what it names, or else its own name."""
    return {
        name: parameter.type if parameter.type in _TEXTS and parameter.type != "str" else name
        for name, parameter in parameters_of(kind).items()
    }
