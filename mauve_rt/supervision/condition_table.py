"""The conditions that there are and what each may be told."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mauve_rt.model.kinds import Flag, Kind, Real, Text, Whole
from mauve_rt.model.schema import IDENTIFIER, ROS_NAME

_INT64 = 2**63
_TEXTS: Mapping[str, Text] = {
    "topic": ROS_NAME,
    "message_type": Text(r"[a-z]\w*/msg/[A-Z]\w*", "a message type such as std_msgs/msg/Float64"),
    "component": IDENTIFIER,
    "resource": IDENTIFIER,
    "field": Text(r"[a-z]\w*(?:\[\d+\])?(?:\.[a-z]\w*(?:\[\d+\])?)*", "a field such as pose.position.x"),
}


@dataclass(frozen=True)
class ConditionParameter:
    """What a condition may be told."""

    name: str
    type: str  # bool, int, float, str, or what a text is: topic, message_type, component, resource, field
    initial: Any = None
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    required: bool = False


@dataclass(frozen=True)
class ConditionKind:
    """One kind of condition."""

    name: str
    parameters: Mapping[str, ConditionParameter]
    any_of: tuple[str, ...] = ()  # parameters, one of which must be told


def _kind(name: str, *parameters: ConditionParameter, any_of: tuple[str, ...] = ()) -> ConditionKind:
    return ConditionKind(name, {each.name: each for each in parameters}, any_of)


_TOPIC = ConditionParameter("topic", "topic", required=True)
_MESSAGE = ConditionParameter("type", "message_type", required=True)
CONDITIONS = (
    _kind(
        "silence",
        _TOPIC,
        _MESSAGE,
        ConditionParameter("longer_than_s", "float", unit="s", minimum=1e-9, required=True),
    ),
    _kind(
        "value",
        _TOPIC,
        _MESSAGE,
        ConditionParameter("field", "field", required=True),
        ConditionParameter("below", "float"),
        ConditionParameter("above", "float"),
        ConditionParameter("hysteresis", "float", initial=0.0, minimum=0),
        any_of=("below", "above"),
    ),
)


def conditions() -> Mapping[str, ConditionKind]:
    """Every kind of condition, by name."""
    return {kind.name: kind for kind in CONDITIONS}


def parameter_kind(parameter: ConditionParameter) -> Kind:
    """What a parameter may be in a file."""
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
            return _TEXTS.get(kind, Text())


def roles(kind: str) -> Mapping[str, str]:
    """What each parameter of a kind of condition means: its name, but where its type says more."""
    return {
        name: "message_type" if name == "type" else parameter.type if parameter.type in _TEXTS else name
        for name, parameter in conditions()[kind].parameters.items()
    }
