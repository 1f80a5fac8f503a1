"""The fields of a type as the native reader of numbers takes them."""

from collections.abc import Iterable
from typing import Any

from mauve_rt._kernel import FieldShape, MessageShape
from mauve_rt.model.message_shapes import message_field
from mauve_rt.parts.message_types import message_class

Flat = tuple[str, str, str, int, list[Any]]
"""(name, type as in .msg files, "" or "fixed" or "sequence", size, fields of a message)"""


def flat_fields(type_name: str, shapes: Iterable[MessageShape]) -> list[Flat]:
    """Of an installed message, else of the C++ struct; none where there is neither."""
    message = message_class(type_name)
    if message is not None:
        return _of_message(message)
    return next((_of_struct(shape.fields) for shape in shapes if shape.type == type_name), [])


def _of_message(message: Any) -> list[Flat]:
    flat = []
    for name, words in message.get_fields_and_field_types().items():
        field = message_field(name, words)
        inner = message_class(field.type) if "/" in field.type else None
        fields = _of_message(inner) if inner is not None else []
        flat.append((name, field.type, field.array, field.size, fields))
    return flat


def _of_struct(fields: Iterable[FieldShape]) -> list[Flat]:
    return [
        (
            field.name,
            field.type,
            ("fixed" if field.is_fixed else "sequence") if field.is_array else "",
            field.size,
            _of_struct(field.fields),
        )
        for field in fields
    ]
