"""Limits of silence that a writer exceeds though nothing is wrong: shorter than two of its periods."""

from collections.abc import Iterator, Mapping

from mauve_rt.errors import Problem
from mauve_rt.model import ArchitectureModel
from mauve_rt.model.schema import ResourceModel
from mauve_rt.supervision.rule_names import full_name
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when import SILENCES, When

JITTER_S = 0.010
"""Assumed: threads of a busy machine are late by no more."""


def limit_warnings(
    file: RulesFile, model: ArchitectureModel, periods_s: Mapping[str, float]
) -> Iterator[Problem]:
    """Warn of limits below two periods and jitter: one lost or late message is silence then.

    `periods_s`: of components. The period of a topic is known where its resource asks for a deadline.
    """
    for rule in file.rules.rules:
        for leaf in rule.when.leaves():
            if leaf.kind not in SILENCES:
                continue
            limit_s = float(leaf.parameters["longer_than_s"])
            for writer, period_s in _writers(leaf, model, periods_s):
                least_s = 2 * period_s + JITTER_S
                if period_s > 0 and limit_s < least_s:
                    what = f"rule '{rule.name}': one lost or late message of {writer} is silence already"
                    facts = (
                        f"{least_s:g} s or more: two periods of {period_s:g} s, and {JITTER_S:g} s of jitter"
                    )
                    yield file.problem(
                        (*leaf.place, leaf.kind, "longer_than_s"),
                        what,
                        expected=facts,
                        found=f"{limit_s:g} s",
                    )


def _writers(
    leaf: When, model: ArchitectureModel, periods_s: Mapping[str, float]
) -> Iterator[tuple[str, float]]:
    """The quickest component that writes what is listened to, or the topic's deadline, and the period."""
    name, resource = listened_to(leaf, model)
    if resource is not None and resource.topic is not None and resource.topic.qos.deadline_ms:
        yield f"topic {resource.topic.name}", resource.topic.qos.deadline_ms / 1e3
    writing = writers_of(name, model)
    if writing and writing <= periods_s.keys():
        quickest = min(writing, key=lambda one: periods_s[one])
        yield quickest, periods_s[quickest]


def writers_of(resource: str, model: ArchitectureModel) -> set[str]:
    """Components that write a resource."""
    return {
        link.component
        for link in model.connections
        if link.resource == resource and not link.service.startswith(("read", "get"))
    }


def listened_to(leaf: When, model: ArchitectureModel) -> tuple[str, ResourceModel | None]:
    """The resource that a condition names, or the one that its topic is bound to; '', None: there is none."""
    if name := str(leaf.parameters.get("resource") or ""):
        return name, model.resources.get(name)
    topic = full_name(str(leaf.parameters.get("topic") or ""), model.namespace)
    for name, resource in model.resources.items():
        if resource.topic is not None and full_name(resource.topic.name, model.namespace) == topic:
            return name, resource
    return "", None
