"""Steps of a transaction as files have them: rules of a supervisor, and `mauve reconfigure`.

- {kind: add_resource, target: goal, value: {kind: shared_data, type: geometry_msgs/msg/Point}}
- {kind: connect, target: guidance, name: goal, value: goal.read}
- {kind: set_property, target: guidance, name: path_step, value: 0.5}
- {kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}

Or, where components whose state does not end are given up for it: {force: true, steps: [...]}.
With `idle: true` the change is made while no job of a participant is pending.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.json_schema import Definitions, JsonSchema, document, has, when
from mauve_rt.file_schema.kinds import Choice, Fault, Faults, Flag, Kind, ListOf, Real, Text
from mauve_rt.file_schema.schema_errors import expected
from mauve_rt.file_schema.section import Section, setting
from mauve_rt.file_schema.setting_words import sentence
from mauve_rt.file_schema.words import cut, did_you_mean, nearest, shown
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.model.schema import IDENTIFIER_OR_NONE, ComponentModel, ResourceModel
from mauve_rt.model.step_kinds import STEP_KINDS, StepKind

_SHOWN_VALUE = 60
SHOWN_STEP = 300
LONGEST_IDLE_S = 10.0


@dataclass(frozen=True)
class Step:
    """One step of a transaction, as mauve_msgs/msg/ReconfigurationStep."""

    kind: str
    target: str = ""
    name: str = ""
    value: str = ""  # YAML text

    def __str__(self) -> str:
        short = cut(" ".join(self.value.split()), _SHOWN_VALUE)
        return cut(" ".join(word for word in (self.kind, self.target, self.name, short) if word), SHOWN_STEP)


class _YamlText(Text):
    """YAML text; what is written as a value becomes text."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        is_value = isinstance(value, bool | int | float | dict)
        return super().read(json.dumps(value) if is_value else value, place, faults)

    def json_schema(self, definitions: Definitions) -> JsonSchema:  # noqa: ARG002
        """As Kind."""
        return {"type": ["string", "boolean", "number", "object"]}


class StepForm(Section):
    """A step as files have it."""

    kind: str = setting(Choice(*STEP_KINDS), "kind of the step")
    target: str = setting(IDENTIFIER_OR_NONE, "component or resource that the step changes", default="")
    name: str = setting(
        Text(), "part, property or port of the target, as the kind of the step says", default=""
    )
    value: str = setting(_YamlText(), "YAML value, as the kind of the step says", default="")

    def misfit(self) -> Fault | None:
        """Most kinds need a target, some a name, some a value."""
        kind = STEP_KINDS[self.kind]
        if kind.target == "all" and self.target:
            return Fault((), "rule", limit=f"a step of kind '{self.kind}' takes no target")
        if kind.target != "all" and not self.target:
            return Fault((), "missing", limit="target")
        for key, is_needed in (("name", kind.name), ("value", kind.needs_value)):
            if is_needed and not getattr(self, key):
                return Fault((), "rule", limit=f"a step of kind '{self.kind}' needs a {key}")
        return None

    @classmethod
    def json_rules(cls, definitions: Definitions) -> JsonSchema:
        """As misfit(), and the section of a new component or resource."""
        return {
            "allOf": [
                when(has("kind", name), _step_schema(kind, definitions)) for name, kind in STEP_KINDS.items()
            ]
        }


def _step_schema(kind: StepKind, definitions: Definitions) -> JsonSchema:
    is_needed = {"target": kind.target != "all", "name": bool(kind.name), "value": kind.needs_value}
    keys: JsonSchema = {key: {"not": {"const": ""}} for key, needed in is_needed.items() if needed}
    if kind.target == "all":
        keys["target"] = {"const": ""}
    if kind.value == "section":
        section = ResourceModel if kind.is_about_resource else ComponentModel
        keys["value"] = when({"type": "object"}, section.json_schema(definitions)) | keys["value"]
    needed = [key for key, needed in is_needed.items() if needed]
    return {"description": sentence(kind.what), "properties": keys, "required": needed}


class _StepPart(Kind):
    """A step within a section."""

    def read(self, value: Any, place: Location, faults: Faults) -> Any:
        """As Kind."""
        if isinstance(value, Step):
            return value
        before = len(faults)
        form = StepForm.read(value, place, faults)
        return Step(form.kind, form.target, form.name, form.value) if len(faults) == before else form

    def json_schema(self, definitions: Definitions) -> JsonSchema:
        """As Kind."""
        return StepForm.json_schema(definitions)


STEPS = ListOf(_StepPart(), few=1)
ANY_STEPS = ListOf(_StepPart())  # or none


class Change(Section):
    """A transaction: its steps, and how it is made."""

    force: bool = setting(Flag(), "give up components whose state does not end in time", default=False)
    idle: bool = setting(Flag(), "make the change while no job of a participant is pending", default=False)
    idle_within_s: float = setting(
        Real(above=0, most=LONGEST_IDLE_S),
        "with `idle`: time for such an instant to come, once all components have agreed",
        default=1.0,
    )
    steps: list[Step] = setting(STEPS, "the steps; all of them take effect, or none")


_SHOULD: Mapping[str, str] = {
    "rule": "{limit}",
    "list": "input should be a valid list",
    "few": "list should have at least {limit} item",
    "more": "input should be greater than {limit}",
    "least": "input should be greater than or equal to {limit}",
}


def load_change(path: str | Path, *, text: str | None = None) -> Change:
    """The transaction of a file, or of `text` in its place.

    Raises:
        ArchitectureFileError: it cannot be read, is no YAML or no list of steps.
    """
    file = YamlFile(path, text=text)
    faults: Faults = []
    if _has_settings(file):
        change = Change.read(file.data, (), faults)
        if not faults:
            return change
    else:
        steps: list[Step] = STEPS.read(file.data, (), faults)
        if not faults:
            return Change(steps=steps)
    raise form_error(file, faults)


def steps_schema() -> JsonSchema:
    """The JSON Schema of a steps file: a list, or a transaction."""
    definitions: Definitions = {}
    steps, change = STEPS.json_schema(definitions), Change.json_schema(definitions)
    return document({"if": {"type": "array"}, "then": steps, "else": change}, definitions, name="steps")


def place_of_step(file: YamlFile, index: int) -> Location:
    """Where in a file of steps one of them stands."""
    return ("steps", index) if _has_settings(file) else (index,)


def _has_settings(file: YamlFile) -> bool:
    return isinstance(file.data, dict) and "steps" in file.data


def form_error(file: YamlFile, faults: Faults) -> ArchitectureFileError:
    """What is wrong with a file of steps, in words for who wrote it."""
    return ArchitectureFileError(file.path, [_problem(file, fault) for fault in faults])


def _problem(file: YamlFile, fault: Fault) -> Problem:
    location = fault.place
    element = dotted(location)
    if fault.what == "condition":
        remedy = did_you_mean(str(location[-1]), fault.known)
        return file.key_problem(location, f"{element} is no known condition", remedy=remedy)
    if fault.what == "missing":
        remedy = "write `mauve: 1` at its top" if fault.limit == "mauve" else ""
        return file.problem(location, f"{dotted((*location, fault.limit))} is missing", remedy=remedy)
    if fault.what == "unknown":
        remedy = did_you_mean(str(location[-1]), fault.known)
        return file.key_problem(location, f"{element} is no known key", remedy=remedy)
    found = shown(fault.found)
    if fault.what == "form":
        return file.problem(location, f"bad {element}", expected=expected(fault), found=found)
    text = _SHOULD.get(fault.what, f"input should be {expected(fault)}").format(limit=fault.limit)
    near = nearest(fault.found, fault.known) if isinstance(fault.found, str) else ""
    remedy = f"did you mean {near}?" if near else ""
    return file.problem(location, f"{element or 'the file'}: {text}", found=found, remedy=remedy)


def dotted(location: Location) -> str:
    """`rules[0].when.silence`."""
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location)
    return text.removeprefix(".")
