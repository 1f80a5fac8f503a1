"""Fields of messages by their paths, such as `pose.position.x` or `ranges[3]`."""

import re
from collections.abc import Mapping, Sequence
from math import inf
from typing import Any, NamedTuple

from mauve_rt.parts.message_types import message_class

# The scalar types that are numbers, and between what their values are.
NUMBERS: Mapping[str, tuple[float, float]] = {
    "boolean": (0, 1),
    "float": (-inf, inf),
    "double": (-inf, inf),
    "octet": (0, 2**8 - 1),
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
}
_ELEMENT = re.compile(r"(?P<name>\w+)(?:\[(?P<index>\d+)\])?")


class FieldType(NamedTuple):
    """What a path leads to."""

    type: str = ""
    unknown: str = ""  # the first name of the path that nothing has
    within: str = ""  # of which message
    known: Sequence[str] = ()


def field_type(type_name: str, path: str) -> FieldType | None:
    """The type of a field; None when the message is not installed."""
    for part in path.split("."):
        message = message_class(type_name)
        if message is None:
            return None
        match = _ELEMENT.fullmatch(part)
        fields: Mapping[str, str] = message.get_fields_and_field_types()
        name = match["name"] if match else part
        if name not in fields:
            return FieldType(unknown=name, within=type_name, known=tuple(fields))
        type_name = fields[name]
        if match and match["index"] is not None:
            type_name = re.sub(r"^sequence<(.*?)(?:, \d+)?>$|\[\d*\]$", r"\1", type_name)
    return FieldType(type=type_name)


def field_value(message: Any, path: str) -> float:
    """The number at a path of a message; NaN where there is none, such as beyond an array's end."""
    try:
        for part in path.split("."):
            match = _ELEMENT.fullmatch(part)
            message = getattr(message, match["name"] if match else part)
            if match and match["index"] is not None:
                message = message[int(match["index"])]
        return float(message[0] if isinstance(message, bytes) else message)
    except (AttributeError, IndexError, TypeError, ValueError):
        return float("nan")
