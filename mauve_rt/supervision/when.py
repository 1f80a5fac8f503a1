"""What a rule waits for: a tree of conditions.

    when: {silence: {topic: radio/in, longer_than_s: 1.0}}
    when: {all: [{boolean: {topic: armed}}, {not: {late: {component: control}}}], for_s: 0.5}
    when: {at_least: {count: 2, of: [{...}, {...}, {...}]}}

A node is one condition, or `all`, `any`, `not`, `at_least` of others; with `for_s` it must have held so long
without a break, with `within_s` it need have held only at some instant of the last so many seconds, with both
the former within the latter. Which conditions there are, and what each may be told:
supervision/condition_table.py.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from mauve_rt.file_schema.json_schema import Definitions, JsonSchema, defined, mapping
from mauve_rt.file_schema.kinds import Fault, Faults, Kind, ListOf, Real, Whole
from mauve_rt.file_schema.setting_words import described, sentence
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.supervision.condition_table import condition_schema, conditions, parameter_kind, parameters_of

ALL, ANY, NOT, AT_LEAST = "all", "any", "not", "at_least"
COMBINATIONS: Mapping[str, str] = {
    ALL: "each of the listed conditions holds",
    ANY: "at least one of the listed conditions holds",
    NOT: "the condition does not hold",
    AT_LEAST: "at least `count` of the conditions of the list `of` hold",
}
"""The combinations of conditions, and when each holds."""
SILENCES = ("silence", "link_silence")
"""Conditions that say for how long nothing came."""
MOST_PARTS = 64  # of one combination
_SECONDS = Real(above=0)
TIMES: Mapping[str, str] = {
    "for_s": "the condition has held for so long without a break",
    "within_s": "the condition has held at an instant of the last so many seconds",
}
"""The keys for times in seconds beside a condition, and when the condition holds with each."""


@dataclass(frozen=True)
class When:
    """A node of the tree. `kind`: a condition of the table, or one of COMBINATIONS."""

    kind: str
    parameters: Mapping[str, Any] = field(default_factory=dict)  # of a condition
    parts: tuple["When", ...] = ()
    count: int = 0  # of at_least
    for_s: float = 0.0  # 0: as soon as it holds
    within_s: float = 0.0  # 0: now
    place: Location = field(default=(), compare=False)  # in the file

    def leaves(self) -> Iterator["When"]:
        """The conditions of the tree, from left to right."""
        if self.kind not in COMBINATIONS:
            yield self
        for part in self.parts:
            yield from part.leaves()

    def nodes(self) -> Iterator["When"]:
        """Every node of the tree, a node before its parts."""
        yield self
        for part in self.parts:
            yield from part.nodes()


class WhenPart(Kind):
    """A tree within a section."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if isinstance(value, When):
            return value
        if not isinstance(value, dict):
            faults.append(Fault(place, "mapping", found=value))
            return value
        before = len(faults)
        known = (*conditions(), *COMBINATIONS)
        for key in value:
            if key not in known and key not in TIMES:
                faults.append(Fault((*place, key), "condition", known=known))
        named = [key for key in value if key in known]
        if len(named) != 1 and len(faults) == before:
            found = value if not named else " and ".join(named)
            faults.append(Fault(place, "form", limit="exactly one kind of condition", found=found))
        times = {key: _SECONDS.read(value[key], (*place, key), faults) for key in TIMES if key in value}
        if len(faults) > before:
            return value
        node = self._node(named[0], value[named[0]], (*place, named[0]), faults)
        return When(**node, **times, place=place) if len(faults) == before else value

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return defined("Condition", definitions, self._json_definition)

    def _json_definition(self, definitions: Definitions) -> JsonSchema:
        one, several = self.json_schema(definitions), _parts(self).json_schema(definitions)
        count = Whole(1, MOST_PARTS).json_schema(definitions)
        at_least = mapping({"count": count, "of": several}, required=("count", "of"))
        nodes = {ALL: several, ANY: several, NOT: one, AT_LEAST: at_least}
        keys = {name: condition_schema(name) for name in conditions()}
        for name, what in COMBINATIONS.items():
            keys[name] = {**nodes[name], "description": sentence(f"holds while {what}")}
        for name, what in TIMES.items():
            keys[name] = {**_SECONDS.json_schema(definitions), "description": described(what, _SECONDS, "s")}
        kinds = [{"required": [name]} for name in (*conditions(), *COMBINATIONS)]
        return {**mapping(keys, description="One condition, or one combination of them."), "oneOf": kinds}

    def _node(self, kind: str, value: Any, place: Location, faults: Faults) -> dict[str, Any]:
        if kind == NOT:
            return {"kind": kind, "parts": (self.read(value, place, faults),)}
        if kind in (ALL, ANY):
            return {"kind": kind, "parts": tuple(_elements(self, value, place, faults))}
        if kind == AT_LEAST:
            return self._at_least(value, place, faults)
        return {"kind": kind, "parameters": read_condition(kind, value, place, faults)}

    def _at_least(self, value: Any, place: Location, faults: Faults) -> dict[str, Any]:
        before = len(faults)
        if not isinstance(value, dict):
            faults.append(Fault(place, "mapping", found=value))
            return {"kind": AT_LEAST}
        for key in value:
            if key not in ("count", "of"):
                faults.append(Fault((*place, key), "unknown", known=("count", "of")))
        for key in ("count", "of"):
            if key not in value:
                faults.append(Fault(place, "missing", limit=key))
        if len(faults) > before:
            return {"kind": AT_LEAST}
        parts = _elements(self, value["of"], (*place, "of"), faults)
        count = Whole(1, max(len(parts), 1)).read(value["count"], (*place, "count"), faults)
        return {"kind": AT_LEAST, "parts": tuple(parts), "count": count}


def _elements(kind: Kind, value: Any, place: Location, faults: Faults) -> list[Any]:
    read = _parts(kind).read(value, place, faults)
    return read if isinstance(read, list) else []


def _parts(kind: Kind) -> ListOf:
    return ListOf(kind, few=1, many=MOST_PARTS)


def read_condition(kind: str, value: Any, place: Location, faults: Faults) -> dict[str, Any]:
    """The parameters of one condition, with their defaults; what is wrong is added to `faults`."""
    if not isinstance(value, dict):
        faults.append(Fault(place, "mapping", found=value))
        return {}
    known = parameters_of(kind)
    read = {}
    for key, each in value.items():
        if key in known:
            read[key] = parameter_kind(known[key]).read(each, (*place, key), faults)
        else:
            faults.append(Fault((*place, key), "unknown", known=tuple(known)))
    is_misspelt = any(key not in known for key in value)  # then that is the key which is missing
    for key, parameter in known.items():
        if key in value or (parameter.required and is_misspelt):
            continue
        if parameter.required:
            faults.append(Fault(place, "missing", limit=key))
        else:
            read[key] = parameter.initial
    return read
