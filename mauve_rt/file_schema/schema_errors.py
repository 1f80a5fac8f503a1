"""What is wrong with the form of a file, in words."""

from collections.abc import Mapping
from typing import TypeVar

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.kinds import Fault, Faults
from mauve_rt.file_schema.section import Section
from mauve_rt.file_schema.words import did_you_mean, listed, shown
from mauve_rt.file_schema.yaml_file import Location, YamlFile

_Read = TypeVar("_Read", bound=Section)

_EXPECTED: Mapping[str, str] = {
    "flag": "true or false",
    "whole": "a whole number",
    "number": "a number",
    "finite": "a finite number",
    "text": "text",
    "list": "a list",
    "mapping": "a mapping",
    "more": "more than {limit}",
    "least": "at least {limit}",
    "most": "at most {limit}",
    "few": "at least {limit} of them",
    "many": "at most {limit} of them",
}


_NAMED: Mapping[str, str] = {
    "components": "component",
    "resources": "resource",
    "types": "type",
    "shells": "shell",
    "cores": "core",
    "fsms": "fsm",
}
"""Sections of files whose entries have names, and what an entry is."""


def read_content(model: type[_Read], file: YamlFile, *, what: str = "an architecture file") -> _Read:
    """The content of a file, which should be `what`.

    Raises:
        ArchitectureFileError: it breaks the schema, with every problem.
    """
    faults: Faults = []
    if not isinstance(file.data, dict):
        found = "an empty file" if file.data is None else shown(file.data)
        keys = listed(model.settings, last="and")
        raise file.error(f"not {what}", expected=f"the keys {keys}", found=found)
    content = model.read(file.data, (), faults)
    if faults:
        raise ArchitectureFileError(file.path, [fault_problem(file, fault) for fault in faults])
    return content


def expected(fault: Fault) -> str:
    """What a value should be, in words that follow `expected`."""
    limit = f"{fault.limit:g}" if isinstance(fault.limit, float) else fault.limit
    return _EXPECTED.get(fault.what, "{limit}").format(limit=limit)


def fault_problem(file: YamlFile, fault: Fault) -> Problem:
    """One fault, in words."""
    location = fault.place
    component, element = owner(location)
    facts = {"component": component, "element": element}
    name = str(location[-1]) if location else "file"
    within = _words(location[:-1])
    if fault.what == "unknown":
        remedy = did_you_mean(name, fault.known)
        return file.key_problem(location, f"unknown key '{name}'{within}", remedy=remedy, **facts)
    if fault.what == "foreign":
        what = f"{_subject(location[:-1])} of kind {fault.limit} has no {name}"
        remedy = f"only a {listed(fault.known)} has one"
        return file.key_problem(location, what, remedy=remedy, **facts)
    if fault.what == "lacks":
        what = f"{_subject(location)} has no {fault.limit.partition(':')[0]}"
        return file.problem(location, what, expected=fault.limit, **facts)
    if fault.what == "missing":
        what = f"{_subject(location)} has no '{fault.limit}'"
        is_version = fault.limit.startswith("mauve")
        remedy = f"write `{fault.limit}: 1` at its top" if is_version else "add it"
        return file.problem(location, what, remedy=remedy, **facts)
    if fault.what == "name":
        what = f"bad name '{name}'{within}"
        return file.key_problem(location, what, expected=expected(fault), **facts)
    is_element = bool(location) and isinstance(location[-1], int)
    what = f"bad {_subject(location)}" if is_element else f"bad {name}{within}"
    remedy = fault.hint
    if location[:1] == ("connections",):
        remedy = "a connection is [component.port, resource.service]"
    found = shown(fault.found)
    return file.problem(location, what, expected=expected(fault), found=found, remedy=remedy, **facts)


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
        case (str(section), name) if section in _NAMED:
            return f" of {_NAMED[section]} '{name}'"
        case (*before, int(index)):
            return f" {index + 1}{_words(tuple(before))}"
        case (str(section), name, *rest) if section in _NAMED:
            return f" in {'.'.join(str(part) for part in rest)} of {_NAMED[section]} '{name}'"
        case _:
            return f" in '{'.'.join(str(part) for part in location)}'"


def _subject(location: Location) -> str:
    match location:
        case ():
            return "the file"
        case ("connections", int(index), *_):
            return f"connection {index + 1}"
        case (str(section), name) if section in _NAMED:
            return f"{_NAMED[section]} '{name}'"
        case (*before, key, int(index)):
            return f"element {index + 1} of {key}{_words(tuple(before))}"
        case _:
            return f"'{location[-1]}'{_words(location[:-1])}"
