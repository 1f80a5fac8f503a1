"""Definitions of messages as text, of C++ structs without a ROS message too."""

from collections.abc import Iterable, Iterator

from mauve_rt._kernel import FieldShape, MessageShape
from mauve_rt.errors import MauveError
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.definitions import SEPARATOR, find_definition

_OWN_PACKAGE = "mauve"
"""Of structs whose name has no package."""


def message_text(type_name: str, shapes: Iterable[MessageShape]) -> str:
    """The definition of a type and of those it uses: an installed message's, else one made from the struct.

    Raises:
        MauveError: there is neither.
    """
    try:
        return find_definition(type_name).text
    except TraceError as error:
        shape = next((shape for shape in shapes if shape.type == type_name), None)
        if shape is None:
            raise MauveError(str(error)) from error
    inner: dict[str, str] = {}
    text = _fields(shape.fields, inner)
    return text + "".join(f"{SEPARATOR}\nMSG: {name}\n{part}" for name, part in inner.items())


def message_file(shape: MessageShape) -> str:
    """The .msg file of a struct; messages within it have files of their own."""
    return _fields(shape.fields, {})


def message_name(type_name: str) -> str:
    """The name that a message has whose struct is of this type: package/msg/Name."""
    package, _, name = type_name.rpartition("/")
    return f"{package.removesuffix('/msg') or _OWN_PACKAGE}/msg/{name}"


def _fields(fields: Iterable[FieldShape], inner: dict[str, str]) -> str:
    """The lines of a struct; into `inner` those of the structs within it, by their names behind `MSG:`."""
    return "".join(f"{line}\n" for line in _lines(fields, inner))


def _lines(fields: Iterable[FieldShape], inner: dict[str, str]) -> Iterator[str]:
    for field in fields:
        kind = field.item
        if field.fields:
            kind = message_name(field.type).replace("/msg/", "/")
            if kind not in inner:
                inner[kind] = ""  # no struct contains itself; this keeps the order
                inner[kind] = _fields(field.fields, inner)
        yield f"{kind}{field.array} {_field_name(field.name)}"


def _field_name(name: str) -> str:
    """As .msg files may have it."""
    return name.rstrip("_") or name
