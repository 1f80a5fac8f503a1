"""The names in conditions, held against an architecture and what is installed; the nearest one is told."""

from collections.abc import Collection, Iterator, Mapping
from difflib import get_close_matches
from math import isinf
from typing import Any

from mauve_rt.errors import Problem
from mauve_rt.file_schema.words import did_you_mean
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.schema import ResourceModel
from mauve_rt.parts.message_types import message_class
from mauve_rt.supervision.condition_table import roles
from mauve_rt.supervision.message_fields import NUMBERS, field_type
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when import When

_NEARLY = 0.85  # a topic of another node may well have a name that is something like one of ours


def name_findings(file: RulesFile, model: ArchitectureModel | None) -> list[Problem]:
    """What the conditions name that is not there; without an architecture only types and their fields."""
    return [
        problem
        for rule in file.rules.rules
        for leaf in rule.when.leaves()
        for problem in leaf_findings(file, leaf, model)
    ]


def leaf_findings(file: RulesFile, leaf: When, model: ArchitectureModel | None = None) -> Iterator[Problem]:
    """As name_findings, of one condition."""
    return _Names(file, leaf, model).findings()


class _Names:
    """The names of one condition."""

    def __init__(self, file: RulesFile, leaf: When, model: ArchitectureModel | None) -> None:
        self._file, self._leaf, self._model = file, leaf, model
        # By role: parameter and what it says.
        self._said = {
            role: (name, str(leaf.parameters[name]))
            for name, role in roles(leaf.kind).items()
            if leaf.parameters.get(name)
        }

    def findings(self) -> Iterator[Problem]:
        model = self._model
        if model is not None:
            yield from self._unknown("component", model.components)
            yield from self._unknown("resource", model.resources)
            yield from self._peer(model.peers)
        bound = self._bound()
        yield from self._other_type(bound)
        yield from self._nearly_bound(bound)
        type_name = self._type_name(bound)
        if "message_type" in self._said and message_class(type_name) is None:
            yield self._problem(
                "message_type",
                f"message type {type_name} is not installed",
                remedy="source the workspace that has it, or correct the name",
            )
        elif "field" in self._said and type_name:
            yield from self._field(type_name)

    def _unknown(self, role: str, known: Any) -> Iterator[Problem]:
        if role in self._said and (name := self._said[role][1]) not in known:
            yield self._problem(role, f"{role} '{name}' is unknown", remedy=did_you_mean(name, known))

    def _peer(self, peers: Collection[str]) -> Iterator[Problem]:
        """An executor is named by its namespace, or from there on down; peers are namespaces."""
        if "executor" not in self._said or not peers:
            return
        name = self._said["executor"][1]
        if not set(name.strip("/").split("/")) & set(peers):
            remedy = did_you_mean(name.strip("/").split("/")[0], peers)
            yield self._problem(
                "executor", f"executor '{name}' is none of the architecture's peers", remedy=remedy
            )

    def _bound(self) -> Mapping[str, ResourceModel]:
        """Resources of the architecture that are bound to topics, by the topics' full names."""
        if self._model is None:
            return {}
        space = self._model.namespace
        resources = self._model.resources.values()
        return {full_name(each.topic.name, space): each for each in resources if each.topic is not None}

    def _listened_to(self, bound: Mapping[str, ResourceModel]) -> ResourceModel | None:
        """The resource of the architecture that is named, or bound to the topic that is."""
        if self._model is None:
            return None
        if "topic" in self._said:
            return bound.get(full_name(self._said["topic"][1], self._model.namespace))
        return self._model.resources.get(self._said.get("resource", ("", ""))[1])

    def _other_type(self, bound: Mapping[str, ResourceModel]) -> Iterator[Problem]:
        resource = self._listened_to(bound)
        wanted = self._said.get("message_type", ("", ""))[1]
        if resource is not None and wanted and resource.topic_type not in ("", wanted):
            role = "topic" if "topic" in self._said else "resource"
            what = f"{role} {self._said[role][1]} is of another type in the architecture"
            yield self._problem("message_type", what, expected=resource.topic_type, found=wanted)

    def _nearly_bound(self, bound: Mapping[str, ResourceModel]) -> Iterator[Problem]:
        """A topic that nothing is bound to may be another node's; one that is nearly ours is a mistake."""
        if self._model is None or "topic" not in self._said:
            return
        said = self._said["topic"][1]
        name = full_name(said, self._model.namespace)
        if name not in bound and (near := get_close_matches(name, bound, n=1, cutoff=_NEARLY)):
            remedy = f"did you mean {near[0]}?"
            yield self._problem("topic", f"no resource is bound to topic {said}", remedy=remedy)

    def _type_name(self, bound: Mapping[str, ResourceModel]) -> str:
        if "message_type" in self._said:
            return self._said["message_type"][1]
        resource = self._listened_to(bound)
        return resource.topic_type if resource is not None else ""

    def _field(self, type_name: str) -> Iterator[Problem]:
        path = self._said["field"][1]
        found = field_type(type_name, path)
        if found is None:
            return  # a type that Python does not know
        if found.unknown:
            what = f"{found.within} has no field '{found.unknown}'"
            yield self._problem("field", what, remedy=did_you_mean(found.unknown, found.known))
        elif found.type not in NUMBERS:
            what = f"field '{path}' of {type_name} is no number"
            yield self._problem("field", what, expected="a number or a boolean", found=found.type)
        else:
            yield from self._limits(path, found.type)

    def _limits(self, path: str, type_name: str) -> Iterator[Problem]:
        """A bound that no value of the type is beyond can never be passed."""
        low, high = NUMBERS[type_name]
        for name, beyond in (("above", high), ("below", low)):
            limit = self._leaf.parameters.get(name)
            if not isinstance(limit, float | int) or isinstance(limit, bool) or isinf(limit):
                continue
            if limit >= beyond if name == "above" else limit <= beyond:
                what = f"can never hold: no {type_name} is {name} {limit:g} (field '{path}')"
                yield self._file.problem(self._place(name), what, expected=f"{low:g} to {high:g}")

    def _problem(self, role: str, what: str, **facts: str) -> Problem:
        return self._file.problem(self._place(self._said[role][0]), what, **facts)

    def _place(self, name: str) -> Location:
        return (*self._leaf.place, self._leaf.kind, name)


def full_name(name: str, namespace: str) -> str:
    """A topic's full name."""
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"
