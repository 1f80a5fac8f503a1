"""Types of messages' fields by their paths, such as `pose.position.x` or `ranges[3]`."""

import re
from collections.abc import Mapping, Sequence
from math import inf
from typing import NamedTuple

from mauve_rt.fields import LENGTH, split_path
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
_ELEMENT = re.compile(r"sequence<(?P<of>.+?)(?:, \d+)?>|(?P<in_array>[^\[]+)\[(?P<size>\d+)\]")


class FieldType(NamedTuple):
    """What a path leads to."""

    type: str = ""
    unknown: str = ""  # the first name of the path that nothing has
    within: str = ""  # of which message
    known: Sequence[str] = ()


def field_type(type_name: str, path: str) -> FieldType | None:
    """The type of a field, or in words why there is none; None when the message is not installed."""
    try:
        parts = split_path(path)
    except ValueError:
        return FieldType(unknown=path, within=type_name)
    try:
        return _field_type(type_name, parts)
    except _NoField as error:
        return FieldType(type=str(error))


class _NoField(Exception):  # noqa: N818 - no error of this function
    """A part of the path leads nowhere; in words."""


def _field_type(type_name: str, parts: Sequence[tuple[str, int | None]]) -> FieldType | None:
    for name, index in parts:
        is_list = _ELEMENT.fullmatch(type_name) is not None
        if is_list and name == LENGTH and index is None:
            type_name = "uint32"
            continue
        if is_list or "/" not in type_name:
            raise _NoField(f"no message ({type_name})")
        message = message_class(re.sub(r"^(\w+)/(\w+)$", r"\1/msg/\2", type_name))
        if message is None:
            return None
        fields: Mapping[str, str] = message.get_fields_and_field_types()
        if name not in fields:
            return FieldType(unknown=name, within=type_name, known=tuple(fields))
        type_name = fields[name] if index is None else _element_type(fields[name], name, index)
    return FieldType(type=type_name)


def _element_type(type_name: str, name: str, index: int) -> str:
    element = _ELEMENT.fullmatch(type_name)
    if element is None:
        raise _NoField(f"no list ({name} is {type_name})")
    if element["size"] and index >= int(element["size"]):
        raise _NoField(f"no element {index} of {type_name}")
    return element["of"] or element["in_array"]
