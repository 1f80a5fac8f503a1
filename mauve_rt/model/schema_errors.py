"""What is wrong with the form of an architecture file, in words."""

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from mauve_rt.errors import Problem
from mauve_rt.model.schema import (
    ComponentModel,
    DiagnosticsModel,
    ExecutorModel,
    FileModel,
    QosModel,
    ResourceModel,
    SenderModel,
    ServiceModel,
    ThresholdModel,
    TopicModel,
)
from mauve_rt.model.words import did_you_mean, listed, shown
from mauve_rt.model.yaml_file import Location, YamlFile

_HINTS: Mapping[str, str] = {
    "priority": "1 is the lowest, 98 the highest; 99 is kept for the conductor",
    "mauve": "this program reads version 1 of the schema",
    "offset_ms": "milliseconds after the epoch",
    "stack_bytes": "the default of 524288 does for most components",
    "cpus": "leave the key out to allow every CPU",
}


def schema_problems(file: YamlFile, error: ValidationError) -> list[Problem]:
    """Every error of the schema as a problem with its place in the file."""
    if not isinstance(file.data, dict):
        found = "an empty file" if file.data is None else shown(file.data)
        keys = listed(FileModel.model_fields, last="and")
        return [file.problem((), "not an architecture file", expected=f"the keys {keys}", found=found)]
    by_place: dict[Location, Problem] = {}
    for details in error.errors(include_url=False):
        if str(details["loc"][-1]).startswith("literal[") and isinstance(details["input"], list):
            continue  # the other member of a union, which the list does not mean to be
        location = _in_file(details["loc"], file.data)
        by_place.setdefault(location, _problem(file, location, details))
    return list(by_place.values())


def _problem(file: YamlFile, location: Location, details: ErrorDetails) -> Problem:
    component, element = owner(location)
    facts = {"component": component, "element": element}
    kind = details["type"]
    name = str(location[-1]) if location else "file"
    within = _words(location[:-1])
    if kind == "extra_forbidden":
        remedy = did_you_mean(name, _section(location).model_fields)
        return file.key_problem(location, f"unknown key '{name}'{within}", remedy=remedy, **facts)
    if kind == "missing":
        missing = str(details["loc"][-1])
        return file.problem(location, f"{_subject(location)} has no '{missing}'", remedy="add it", **facts)
    if location and _is_key(details):
        what = f"bad name '{name}'{within}"
        return file.key_problem(location, what, expected=_expected(details), **facts)
    what = (
        f"bad {_subject(location)}" if location and isinstance(location[-1], int) else f"bad {name}{within}"
    )
    remedy = next((_HINTS[str(part)] for part in reversed(location[-2:]) if str(part) in _HINTS), "")
    if location[:1] == ("connections",):
        remedy = "a connection is [component.port, resource.service]"
    found = shown(details["input"])
    return file.problem(location, what, expected=_expected(details), found=found, remedy=remedy, **facts)


_PLAIN_WORDS: Mapping[str, str] = {
    "bool_type": "true or false",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "finite_number": "a finite number",
    "string_type": "text",
    "string_too_short": "text that is not empty",
    "list_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
}


_CONTEXT_WORDS: Mapping[str, str] = {
    "expected": "{text}",  # our own validators
    "literal_error": "{expected}",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "at least {ge:g}",
    "less_than_equal": "at most {le:g}",
    "too_short": "at least {min_length} of them",
    "too_long": "at most {max_length} of them",
}


def _expected(details: ErrorDetails) -> str:
    kind = details["type"]
    if kind in _CONTEXT_WORDS:
        return _CONTEXT_WORDS[kind].format(**details.get("ctx", {})).replace("'", "")
    return _PLAIN_WORDS.get(kind, str(details["msg"]).removeprefix("Input should be "))


def _in_file(location: tuple[int | str, ...], data: Any) -> Location:
    """The part of pydantic's location that stands in the file: it adds the names of a union's members."""
    found: list[int | str] = []
    node = data
    for part in location:
        is_key = isinstance(node, dict) and part in node
        is_index = isinstance(node, list) and isinstance(part, int) and part < len(node)
        if is_key or is_index:
            node = node[part]
            found.append(part)
    return tuple(found)


def _is_key(details: ErrorDetails) -> bool:
    return details["loc"][-1] == "[key]"


_RESOURCE_SECTIONS: Sequence[type[BaseModel]] = (ResourceModel, TopicModel, QosModel)  # resource, topic, qos


def _section(location: Location) -> type[BaseModel]:
    """The schema of the section that `location` is a key of."""
    found: type[BaseModel] = FileModel
    match location[:-1]:
        case (*_, "diagnostics"):
            found = DiagnosticsModel
        case (*_, "diagnostics", _):
            found = ThresholdModel
        case ("executor", *rest):
            found = (ExecutorModel, SenderModel)[len(rest)]
        case ("components", _):
            found = ComponentModel
        case ("resources", _, "service"):
            found = ServiceModel
        case ("resources", _, *rest):
            found = _RESOURCE_SECTIONS[len(rest)]
    return found


def owner(location: Location) -> tuple[str, str]:
    """Name of the component (or resource) that a place belongs to, and of its element there."""
    if len(location) > 1 and location[0] in ("components", "resources"):
        return str(location[1]), ".".join(str(part) for part in location[2:])
    return "", ".".join(str(part) for part in location)


def _words(location: Location) -> str:
    """Where something is, as the end of a phrase; empty for the file itself."""
    match location:
        case ():
            return ""
        case ("connections", int(index), *_):
            return f" of connection {index + 1}"
        case ("components" | "resources" as section, name):
            return f" of {section[:-1]} '{name}'"
        case (*before, int(index)):
            return f" {index + 1}{_words(tuple(before))}"
        case ("components" | "resources" as section, name, *rest):
            return f" in {'.'.join(str(part) for part in rest)} of {section[:-1]} '{name}'"
        case _:
            return f" in '{'.'.join(str(part) for part in location)}'"


def _subject(location: Location) -> str:
    match location:
        case ():
            return "the file"
        case ("connections", int(index), *_):
            return f"connection {index + 1}"
        case ("components" | "resources" as section, name):
            return f"{section[:-1]} '{name}'"
        case (*before, key, int(index)):
            return f"element {index + 1} of {key}{_words(tuple(before))}"
        case _:
            return f"'{location[-1]}'{_words(location[:-1])}"
