"""What somebody outside of an executor knows of it, and of how its rules stand with it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from mauve_rt.control.requests import BY_RULE
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.supervision.rules import Rule

NOT_THERE = "not in the architecture"


@dataclass(frozen=True)
class ComponentView:
    """A component as ~/state shows it. state: a name such as RUNNING."""

    state: str
    core: str
    authors: Mapping[str, str] = field(default_factory=dict)  # of what was changed, by element


@dataclass(frozen=True)
class ArchitectureView:
    """What ~/state said last."""

    instance_id: str
    revision: int
    components: Mapping[str, ComponentView]
    rules: frozenset[str] = frozenset()  # that the executor runs itself

    def state_of(self, component: str) -> str:
        """Its state, in words."""
        found = self.components.get(component)
        return found.state if found is not None else NOT_THERE

    def is_by_rules(self, steps: Iterable[Step]) -> bool:
        """Whether rules did what the steps ask for, as far as ~/state tells: it has no resources."""
        told = [step for step in steps if step.target in self.components]
        return all(self._author_of(step).startswith(BY_RULE) for step in told)

    def _author_of(self, step: Step) -> str:
        element = STEP_KINDS[step.kind].element(step.name)
        return self.components[step.target].authors.get(element, "")

    def shows(self, steps: Iterable[Step]) -> bool | None:
        """Whether the steps' effect is in place; None: ~/state does not tell of all of them."""
        shown = [self._shows_step(step) for step in steps]
        if False in shown:
            return False
        return None if None in shown or not shown else True

    def _shows_step(self, step: Step) -> bool | None:
        component = self.components.get(step.target)
        if step.kind == "replace_core":
            return component is not None and component.core == step.name
        if step.kind == "start":
            return component is not None and component.state == "RUNNING"
        if step.kind == "stop":
            return component is not None and component.state == "STOPPED"
        return None

    def describe(self, steps: Iterable[Step]) -> str:
        """What the steps' targets are now, for a reason."""
        texts = []
        for name in dict.fromkeys(step.target for step in steps if step.target in self.components):
            view = self.components[name]
            state = "runs" if view.state == "RUNNING" else f"is {view.state} with"
            texts.append(f"{name} {state} {view.core}")
        return ", ".join(texts)


@dataclass
class WatchedRule:
    """One rule, as its supervisor stands with it. `number`: of the engine's."""

    number: int
    rule: Rule
    unobservable: str = ""  # why it cannot be heard outside of the executor
    left: bool = False  # to the executor, which runs it itself
    told_unobservable: bool = False
    checked: bool = False  # the executor was asked about it, or is being asked
    untouched: bool = True  # nothing was done for it yet since the executor's start
    standing: str = ""  # of what it is about, in words

    def forget(self) -> None:
        """The executor was started anew, or runs the rule itself: nothing of before counts."""
        self.left = self.told_unobservable = self.checked = False
        self.untouched = True

    def absent(self, view: ArchitectureView) -> str:
        """A component that it is about and that does not run; empty: all do."""
        return min((name for name in self.rule.targets() if view.state_of(name) != "RUNNING"), default="")
