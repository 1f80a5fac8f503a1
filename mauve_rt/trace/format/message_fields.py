"""Fields of decoded messages: all of them by their names, or the one at a path."""

import dataclasses
import json
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

MOST_ELEMENTS = 1000
"""Of an array that is written out; of a longer one, as an image's, its length is."""
_PART = re.compile(r"(?P<name>\w+)(?:\[(?P<index>\d+)\])?")


def flat_fields(message: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Each field by its name, such as pose.position.x; an array is one field, in JSON."""
    if dataclasses.is_dataclass(message):
        for field in dataclasses.fields(message):
            yield from flat_fields(
                getattr(message, field.name), f"{name}.{field.name}" if name else field.name
            )
    elif isinstance(message, np.ndarray | list | tuple | bytes):
        yield name, array_text(message)
    else:
        yield name, message


def field_at(message: Any, path: str) -> Any:
    """The field at a path such as pose.position.x or ranges[3].

    Raises:
        ValueError: there is none; names what is known there.
    """
    found = message
    for part in path.split("."):
        match = _PART.fullmatch(part)
        names = [field.name for field in dataclasses.fields(found)] if dataclasses.is_dataclass(found) else []
        if match is None or match["name"] not in names:
            known = f"expected one of {', '.join(names)}" if names else "the field before has none"
            raise ValueError(f"no field '{part}' in '{path}'; {known}")
        found = getattr(found, match["name"])
        if match["index"] is not None:
            try:
                found = found[int(match["index"])]
            except (IndexError, TypeError) as error:
                count = len(found) if hasattr(found, "__len__") else 0
                raise ValueError(f"no element '{part}' in '{path}'; it has {count} elements") from error
    return found


def array_text(values: Any) -> str:
    """In JSON; of many elements their number."""
    if len(values) > MOST_ELEMENTS:
        return f"{len(values)} elements"
    return json.dumps(_plain(values))


def _plain(value: Any) -> Any:
    """As JSON has it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple | bytes):
        return [_plain(one) for one in value]
    if dataclasses.is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return value
