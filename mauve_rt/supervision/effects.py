"""What the steps of a transaction leave behind, so that two transactions can be held against each other."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step


class Aspect(NamedTuple):
    """Something that a step settles: the core of a component, one of its properties, whether it is there."""

    target: str
    what: str
    name: str = ""  # of a property or port

    def __str__(self) -> str:
        return " ".join(word for word in (self.what, self.name, "of", self.target) if word)


@dataclass(frozen=True)
class Disagreement:
    """Two steps that want different things of one aspect."""

    aspect: Aspect
    first: Step
    second: Step


def settled(steps: Iterable[Step]) -> Mapping[Aspect, Step]:
    """The last step of a transaction about each aspect."""
    return {_aspect(step): step for step in steps}


def disagreement(one: Iterable[Step], other: Iterable[Step]) -> Disagreement | None:
    """The first aspect of which two transactions want different things."""
    second = settled(other)
    for aspect, step in settled(one).items():
        if aspect in second and not _agree(step, second[aspect]):
            return Disagreement(aspect, step, second[aspect])
    return None


def touched(steps: Iterable[Step]) -> set[str]:
    """Components that steps are about."""
    return {step.target for step in steps if step.target and not STEP_KINDS[step.kind].is_about_resource}


def _aspect(step: Step) -> Aspect:
    kind = STEP_KINDS[step.kind]
    if kind.leaves:
        return Aspect(step.target, "state")
    if kind.removes or kind.target.startswith("new"):
        return Aspect(step.target, "presence")
    named = kind.name in ("property", "port")
    return Aspect(step.target, kind.name or step.kind, step.name if named else "")


def _agree(one: Step, other: Step) -> bool:
    first, second = STEP_KINDS[one.kind], STEP_KINDS[other.kind]
    if first.leaves and second.leaves:
        return not {*first.leaves}.isdisjoint(second.leaves)
    return (first.removes, one.name, one.value) == (second.removes, other.name, other.value)
