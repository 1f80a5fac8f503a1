"""What the kinds of trace records are called, and their fields: a table that every bag brings along.

It is the list of constants of mauve_msgs/msg/TraceRecord.msg, whose text is in the bag:

    uint16 RELEASE=5    # name: wait, a: nominal_ns, b: actual_ns, c: place_ns (of a within a period)

So a reader names kinds that are newer than itself; `Kind` has those that it knows more of.
"""

import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from mauve_rt.trace.format.records import Kind

_MARK = "# The kinds are a table"
_KIND = re.compile(
    r"^uint16 (?P<name>[A-Z][A-Z0-9_]*)=(?P<number>\d+)[ \t]*(?:#(?P<fields>.*))?$", re.MULTILINE
)
_FIELD = re.compile(r"\b(name|a|b|c): (\w+)")
_VALUES = re.compile(r"\b(a|b|c): \w+ \((?=\d+ )([^)]*)\)")
_VALUE = re.compile(r"(\d+) ([^,]+)")
_IN_BRACKETS = re.compile(r"\([^)]*\)")


class RecordKind(NamedTuple):
    """A kind of records."""

    name: str
    """In small letters, e.g. release."""
    fields: Mapping[str, str]
    """What those of `name`, `a`, `b`, `c` mean that it uses, e.g. {"name": "wait", "a": "nominal_ns"}."""

    words: Mapping[str, Mapping[int, str]] = MappingProxyType({})
    """Of those whose values are listed, e.g. {"a": {1: "adopt", 2: "take"}}."""

    @property
    def figures(self) -> dict[str, str]:
        """`fields` without `name`: those that are numbers."""
        return {field: meaning for field, meaning in self.fields.items() if field != "name"}


def kinds_told(definition: str) -> dict[int, RecordKind]:
    """Return the kinds that the text of TraceRecord.msg tells of, by their numbers.

    Bags from before it was a table have prose there: their fields are called as they are.
    """
    if _MARK not in definition:
        return kinds_known()
    return {
        int(told["number"]): RecordKind(
            told["name"].lower(),
            dict(_FIELD.findall(_IN_BRACKETS.sub("", told["fields"] or ""))),
            _words_told(told["fields"] or ""),
        )
        for told in _KIND.finditer(definition)
    }


def _words_told(fields: str) -> dict[str, dict[int, str]]:
    """Return of each field whose values are listed in brackets behind it what they mean."""
    return {
        field: {int(number): word.strip() for number, word in _VALUE.findall(values)}
        for field, values in _VALUES.findall(fields)
    }


def kinds_known() -> dict[int, RecordKind]:
    """Return the kinds that this reader knows, of a trace without a table."""
    fields = {field: field for field in ("name", "a", "b", "c")}
    return {kind: RecordKind(kind.name.lower(), fields) for kind in Kind}
