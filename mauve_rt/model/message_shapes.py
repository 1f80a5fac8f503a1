"""C++ structs held against the ROS messages whose names they bear, field by field."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import zip_longest
from typing import Any, NamedTuple

from mauve_rt._kernel import FieldShape, MessageShape
from mauve_rt.parts.message_types import message_class, service_class

REMEDY = "give MAUVE_TYPE the message's fields, in its order and with its types, and build the package again"
_WORDS = {"double": "float64", "float": "float32", "boolean": "bool", "octet": "uint8"}


class Mismatch(NamedTuple):
    """The first field in which a struct differs from its message."""

    type: str  # the message's, as the struct names it
    field: str  # of the message, or of the struct where the message has no more; dotted within messages
    expected: str  # as in a .msg file
    found: str

    @property
    def what(self) -> str:
        """In words, without expected and found."""
        return f"the C++ struct for {self.type} differs from the message in field '{self.field}'"


class _Field(NamedTuple):
    """A field of a message, or of a struct in the same words."""

    name: str
    type: str
    text_capacity: int  # of a string; 0: any
    array: str  # "", "fixed" or "sequence"
    size: int  # of the array; 0: any

    def __str__(self) -> str:
        text = self.type + (f"<={self.text_capacity}" if self.text_capacity else "")
        if self.array == "fixed":
            text += f"[{self.size}]"
        elif self.array:
            text += f"[<={self.size}]" if self.size else "[]"
        return f"{text} {self.name}"


def message_definition(name: str) -> Any:
    """The class of a message, or of a service's request or response; None when it is not installed."""
    match = re.fullmatch(r"(.+/srv/.+)_(Request|Response)", name)
    if match is None:
        return message_class(name)
    service = service_class(match[1])
    return None if service is None else getattr(service, match[2])


def mismatches(
    messages: Iterable[MessageShape], *, find: Callable[[str], Any] = message_definition
) -> Iterator[Mismatch]:
    """One for each struct that bears the name of an installed ROS message and is none.

    `find`: message_definition, or a cache of it for a caller that asks about many ports of few types.
    """
    for message in messages:
        definition = find(message.type)
        if definition is None:
            continue
        found = _difference(definition, message.fields, find)
        if found is not None:
            yield Mismatch(message.type, *found)


def _difference(
    definition: Any, fields: Iterable[FieldShape], find: Callable[[str], Any]
) -> tuple[str, str, str] | None:
    """Field, expected and found of the first difference."""
    declared: Mapping[str, str] = definition.get_fields_and_field_types()
    for (name, words), shape in zip_longest(declared.items(), fields, fillvalue=(None, "")):
        expected = message_field(name, words) if name is not None else None
        found = _of_struct(shape) if isinstance(shape, FieldShape) else None
        if expected is None or found is None:
            known = expected or found
            assert known is not None  # noqa: S101 - one of the two lists was not at its end
            return known.name, str(expected or "no further field"), str(found or "no further field")
        if not _same(expected, found):
            return expected.name, str(expected), str(found)
        assert isinstance(shape, FieldShape)  # noqa: S101 - else `found` were None
        inner = find(expected.type) if shape.fields else None
        if inner is not None and (difference := _difference(inner, shape.fields, find)) is not None:
            return (f"{expected.name}.{difference[0]}", *difference[1:])
    return None


def _same(expected: _Field, found: _Field) -> bool:
    """Whether a struct's field stands for a message's.

    Its name may have one word more, such as a unit. Where the message sets no bound, or one that is as
    large, the struct's capacity is its own affair.
    """
    if re.fullmatch(rf"{re.escape(expected.name)}(_[a-z0-9]*)?", found.name) is None:
        return False
    if (expected.type, expected.array) != (found.type, found.array):
        return False
    if expected.array == "fixed" and expected.size != found.size:
        return False
    return _within(found.size, expected.size) and _within(found.text_capacity, expected.text_capacity)


def _within(capacity: int, bound: int) -> bool:
    """0 is no bound."""
    return bound == 0 or 0 < capacity <= bound


def _of_struct(shape: FieldShape) -> _Field:
    array = "" if not shape.is_array else "fixed" if shape.is_fixed else "sequence"
    return _Field(shape.name, shape.type, shape.text_capacity, array, shape.size)


def message_field(name: str, words: str) -> _Field:
    """From the words of a generated class: `sequence<geometry_msgs/Point, 4>`, `double[9]`, `string<10>`."""
    element, array, size = words, "", 0
    if match := re.fullmatch(r"sequence<(.+?)(?:, (\d+))?>", words):
        element, array, size = match[1], "sequence", int(match[2] or 0)
    elif match := re.fullmatch(r"(.+)\[(\d+)\]", words):
        element, array, size = match[1], "fixed", int(match[2])
    match = re.fullmatch(r"(w?string)<(\d+)>", element)
    kind, capacity = (match[1], int(match[2])) if match else (element, 0)
    package, slash, message = kind.partition("/")
    full = f"{package}/msg/{message}" if slash else _WORDS.get(kind, kind)
    return _Field(name, full, capacity, array, size)
