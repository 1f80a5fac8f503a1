"""Fields of values by their paths, and values as JSON: one reader and one writer.

A value is a ROS message, a message that was decoded (a dataclass), an array, a number or a text. A path is
`pose.position.x`, `ranges[3]`, `joints[2].position` or, for a list, `ranges.length`.
"""

import dataclasses
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

_PART = re.compile(r"(?P<name>\w+)(?:\[(?P<index>\d{1,9})\])?")
LENGTH = "length"
"""Behind a list without an index: how many elements the list has."""


def split_path(path: str) -> list[tuple[str, int | None]]:
    """The names of a path, each with the index of an element or None.

    Raises:
        ValueError: a part of the path is no name and no `name[index]`.
    """
    parts = []
    for part in path.split("."):
        match = _PART.fullmatch(part)
        if match is None:
            raise ValueError(f"no field '{part}' in '{path}'; expected a name, or name[index]")
        parts.append((match["name"], None if match["index"] is None else int(match["index"])))
    return parts


def field_names(value: Any) -> Sequence[str]:
    """The names of a message's fields; none of another value."""
    if hasattr(value, "get_fields_and_field_types"):
        return tuple(value.get_fields_and_field_types())
    return tuple(field.name for field in dataclasses.fields(value)) if dataclasses.is_dataclass(value) else ()


def field_at(value: Any, path: str) -> Any:
    """The field of a value at a path.

    Raises:
        ValueError: the value has no such field; names the fields that it has.
    """
    found = value
    for name, index in split_path(path):
        if name == LENGTH and index is None and _is_list(found):
            found = len(found)
            continue
        names = field_names(found)
        if name not in names:
            has = f"has {len(found)} elements, choose one as in ranges[0]" if _is_list(found) else "has none"
            known = f"expected one of {', '.join(names)}" if names else f"the field before {has}"
            raise ValueError(f"no field '{name}' in '{path}'; {known}")
        found = getattr(found, name)
        if index is not None:
            if not _is_list(found):
                raise ValueError(f"no element '{name}[{index}]' in '{path}'; '{name}' is no list")
            if index >= len(found):
                text = f"it has {len(found)} element{'' if len(found) == 1 else 's'}"
                raise ValueError(f"no element '{name}[{index}]' in '{path}'; {text}")
            found = found[index]
    return found


def number_at(value: Any, path: str) -> float:
    """The number at a path of a value; NaN where there is none, such as beyond an array's end."""
    try:
        found = field_at(value, path)
        return float(found[0] if isinstance(found, bytes) else found)
    except (IndexError, TypeError, ValueError):
        return math.nan


def flat_fields(value: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Each field that is no message, by its path; an array is one field, as JSON has it."""
    if names := field_names(value):
        for each in names:
            yield from flat_fields(getattr(value, each), f"{name}.{each}" if name else each)
    elif not dataclasses.is_dataclass(value):
        yield name, json_value(value) if _is_list(value) else value


def json_value(value: Any) -> Any:
    """A value in the types of JSON: an object for a message, null for NaN, "Infinity" and "-Infinity"."""
    if isinstance(value, float):
        return _json_number(float(value))
    if dataclasses.is_dataclass(value) or hasattr(value, "get_fields_and_field_types"):
        return {name: json_value(getattr(value, name)) for name in field_names(value)}
    if hasattr(value, "tolist"):
        are_whole = hasattr(value, "dtype") and value.dtype.kind in "biu"  # as an image's, which are many
        return value.tolist() if are_whole else json_value(value.tolist())
    if isinstance(value, dict):
        return {name: json_value(each) for name, each in value.items()}
    return [json_value(each) for each in value] if _is_list(value) else value


def _json_number(number: float) -> float | str | None:
    if math.isfinite(number):
        return number
    return None if math.isnan(number) else "Infinity" if number > 0 else "-Infinity"


def _is_list(value: Any) -> bool:
    is_array = hasattr(value, "tolist") and hasattr(value, "__len__") and getattr(value, "ndim", 1) > 0
    return is_array or (isinstance(value, Sequence | bytes) and not isinstance(value, str))
