"""Drawings of architecture files, with rules, steps and models; and of the fsms of their components."""

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from mauve_rt._kernel import Architecture
from mauve_rt.errors import ArchitectureFileError, ParameterError
from mauve_rt.file_schema.words import did_you_mean
from mauve_rt.graph.components import architecture_drawing, component_key, resource_key
from mauve_rt.graph.drawing import Drawing, Edge, Node, compared, merged
from mauve_rt.graph.fsms import fsm_drawing
from mauve_rt.model import (
    ArchitectureModel,
    build,
    configure,
    load_architecture,
    previewed_states,
)
from mauve_rt.model.fragment import fragment
from mauve_rt.model.modelled_parts import modelled_parts
from mauve_rt.model.schema import ResourceModel
from mauve_rt.model.steps import Change, Step, load_change
from mauve_rt.modelling.package_model import PackageModel
from mauve_rt.supervision.condition_table import roles
from mauve_rt.supervision.rehearsal import Described, before_and_after
from mauve_rt.supervision.rule_names import full_name
from mauve_rt.supervision.rules import Rule, RulesFile
from mauve_rt.supervision.when import When


@dataclass(frozen=True)
class Topics:
    """The resource into which the messages of each topic are written."""

    namespace: str
    resources: Mapping[str, str]

    def resource(self, topic: str) -> str:
        """Empty: none."""
        return self.resources.get(full_name(topic, self.namespace), "")


def drawing_of_file(path: Path, models: Sequence[PackageModel], steps: Path | None) -> tuple[Drawing, Topics]:
    """The drawing of an architecture file, or of a change of it.

    Raises:
        ArchitectureFileError: a file is wrong; of steps also where the executor would refuse them.
    """
    model = load_architecture(path)
    topics = {
        full_name(one.topic.name, model.namespace): name
        for name, one in model.resources.items()
        if one.topic is not None and one.topic.direction == "subscribe"
    }
    found = Topics(model.namespace, topics)
    if steps is None:
        return _drawing(path.name, model, _described(model, models)), found
    change = load_change(steps)
    model.parts = modelled_parts(models)
    before, after = before_and_after(steps, change, model)
    more = _added_resources(model, change)
    drawn = compared(_drawing(path.name, model, before), _drawing(path.name, model, after, more))
    return replace(drawn, title=f"{path.name}, changed by {steps.name}"), found


def fsm_of_file(path: Path, component: str, models: Sequence[PackageModel]) -> Drawing:
    """The drawing of the fsm of a component.

    Raises:
        ArchitectureFileError: the file is wrong, or a part of it is not installed.
        ParameterError: there is no such component.
    """
    model = load_architecture(path)
    require(component, model.components, f"{path}: component")
    states = previewed_states(model, _built(model, models))
    return fsm_drawing(f"{component}: {model.components[component].fsm}", states[component])


def require(name: str, known: Iterable[str], what: str) -> None:
    """Raises: ParameterError: the name is unknown."""
    known = list(known)
    if name not in known:
        raise ParameterError(f"{what} '{name}' is unknown; {did_you_mean(name, known)}")


def with_rules(drawing: Drawing, path: Path, topics: Topics) -> Drawing:
    """The drawing with the rules of a file: dashed arrows from what they watch, and to what they change."""
    keys = {node.key for node in drawing.nodes}
    for rule in RulesFile(path).rules.rules:
        node = _rule_node(rule)
        edges = [
            edge
            for edge in _rule_edges(rule, node.key, topics)
            if {edge.start, edge.end} <= keys | {node.key}
        ]
        drawing = drawing.with_more([node], merged(edges))
    return drawing


def _built(model: ArchitectureModel, models: Sequence[PackageModel]) -> Architecture:
    parts = model.parts = modelled_parts(models)
    return build(model, parts.registry, index=parts.index)


def _described(model: ArchitectureModel, models: Sequence[PackageModel]) -> Described:
    """As the executor would have it; where parts are missing, as the file alone says."""
    try:
        architecture = _built(model, models)
        configure(model, architecture)
        found = Described(architecture.components(), architecture.resources())
        architecture.cleanup()
    except ArchitectureFileError as error:
        print(f"{error}; so rates and ports without a connection are not shown", file=sys.stderr)
        return Described([*_components(model)], [])
    return found


def _components(model: ArchitectureModel) -> Iterator[Any]:
    for name, one in model.components.items():
        ports = [
            SimpleNamespace(
                name=link.port, kind="port", type="", resource=link.resource, service=link.service
            )
            for link in model.connections
            if link.component == name
        ]
        yield SimpleNamespace(
            name=name,
            shell=one.shell,
            core=one.core,
            fsm=one.fsm,
            period_ns=one.period_ns or None,
            priority=one.priority,
            cpus=one.cpus or (),
            ports=ports,
        )


def _drawing(
    title: str,
    model: ArchitectureModel,
    described: Described,
    more: Mapping[str, ResourceModel] | None = None,
) -> Drawing:
    resources = {**model.resources, **(more or {})}
    present = [one.name for one in described.resources] or list(model.resources)
    return architecture_drawing(
        title, described.components, [_resource(name, resources[name], model) for name in present]
    )


def _resource(name: str, one: ResourceModel, model: ArchitectureModel) -> Any:
    namespace = model.namespace
    frame, child_frame = model.frames_of(one, ("resources", name))
    found = SimpleNamespace(name=name, kind=one.kind, type=one.type, frame=frame, child_frame=child_frame)
    for side, ros_name in one.ros_names.items():
        setattr(found, side, full_name(ros_name, namespace))
    return found


def _added_resources(model: ArchitectureModel, change: Change) -> dict[str, ResourceModel]:
    return {
        step.target: fragment(model, step.value, section="resources", name=step.target).resources[step.target]
        for step in change.steps
        if step.kind == "add_resource"
    }


def _rule_node(rule: Rule) -> Node:
    condition = " ".join([rule.when.kind, *_said(rule.when).values()])
    return Node(
        key=f"rule {rule.name}",
        kind="rule",
        lines=(rule.name, f"when {condition}"),
        tip="\n".join([f"rule {rule.name}", *(f"do {step}" for step in rule.do)]),
    )


def _said(leaf: When) -> dict[str, str]:
    """What a condition names: a topic, a component or a resource."""
    named = roles(leaf.kind).items() if leaf.parameters else ()
    return {
        role: str(leaf.parameters[name])
        for name, role in named
        if role in ("topic", "component", "resource") and leaf.parameters.get(name)
    }


def _rule_edges(rule: Rule, key: str, topics: Topics) -> Iterator[Edge]:
    for leaf in rule.when.leaves():
        for role, name in _said(leaf).items():
            resource = topics.resource(name) if role == "topic" else name
            watched = component_key(name) if role == "component" else resource_key(resource)
            yield Edge(start=watched, end=key, kind="rule", tip=f"rule {rule.name} watches {role} {name}")
    for step in rule.do:
        for target in (component_key(step.target), resource_key(step.target)):
            yield Edge(start=key, end=target, kind="rule", lines=_step_lines(step), tip=f"do {step}")


def _step_lines(step: Step) -> tuple[str, ...]:
    return tuple(filter(None, (step.kind, step.name.rpartition("/")[2])))
