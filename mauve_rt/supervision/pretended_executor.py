"""An executor that takes every transaction at once, for rules that are tried without one. Knows no ROS."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from mauve_rt._kernel import Overlays
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.control.wishes import spec_of, step_of
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.supervision.inventory import Inventory, ListedComponent
from mauve_rt.supervision.rule import ArchitectureView, ComponentView
from mauve_rt.supervision.rules import Rule

INSTANCE = "pretended"


@dataclass
class PretendedExecutor:
    """Its components are those that rules touch or look at; they run as what undoes the rules leaves them."""

    rules: Iterable[Rule]

    def __post_init__(self) -> None:
        self._components: dict[str, ListedComponent] = {}
        self._overlays = Overlays()
        self._resources: set[str] = set()
        self._revision = 1
        for rule in self.rules:
            for leaf in rule.when.leaves():
                if component := leaf.parameters.get("component"):
                    self._add(str(component))
            for step in rule.do:
                self._be_there(step)
            for step in rule.undo.do if rule.undo is not None else []:
                self._take(step)

    def follows(self, rule: str) -> bool:
        """Whether anything is as an active rule wants it: no rule of higher rank holds all of it."""
        found = self._overlays.find(rule)
        if found is None or not found.is_active:
            return False
        wanted = (self._overlays.wanted(step) for step in found.assigns)
        return any(each.by == "rule" and each.rule == rule for each in wanted)

    def view(self) -> ArchitectureView:
        """As ~/state."""
        shown = {name: ComponentView(each.state, each.core) for name, each in self._components.items()}
        active = frozenset(overlay.rule for overlay in self._overlays.active())
        return ArchitectureView(INSTANCE, self._revision, shown, active=active)

    def inventory(self) -> Inventory:
        """As ~/list_components."""
        return Inventory(INSTANCE, dict(self._components), frozenset(self._resources))

    def handle(self, request: Request) -> Outcome:
        """Take it; a dry run changes nothing."""
        if not request.dry_run:
            for step in self._wanted(request) if request.rule else request.steps:
                self._take(step)
            self._revision += 1
        return Outcome(code=Code.OK, message="", revision=self._revision)

    def _wanted(self, request: Request) -> list[Step]:
        """What a rule's request comes to, besides other rules."""
        overlay = self._overlays.put("", spec_of(request, self._overlays.find(request.rule)))
        steps = self._overlays.steps_if(overlay, is_active=not request.release)
        self._overlays.set_active(overlay, is_active=not request.release)
        self._overlays.settle_ended()
        return [step_of(step, request.steps) for step in steps]

    def _be_there(self, step: Step) -> None:
        """What a step needs before it can be done."""
        kind = STEP_KINDS[step.kind]
        if kind.target == "component":
            self._add(step.target)
        elif kind.target == "resource":
            self._resources.add(step.target)

    def _add(self, component: str) -> None:
        self._components.setdefault(component, ListedComponent(state="RUNNING", core="its own"))

    def _take(self, step: Step) -> None:
        kind = STEP_KINDS[step.kind]
        if kind.target == "all":
            return
        if kind.is_about_resource:
            (self._resources.discard if kind.removes else self._resources.add)(step.target)
        elif kind.removes:
            self._components.pop(step.target, None)
        elif kind.target == "new component":
            self._components[step.target] = ListedComponent(state="STOPPED", core="its own")
        else:
            self._be_there(step)
            self._components[step.target] = _after(self._components[step.target], step)


def _after(component: ListedComponent, step: Step) -> ListedComponent:
    kind = STEP_KINDS[step.kind]
    match kind.name:
        case "":
            return replace(component, state=kind.leaves[0]) if kind.leaves else component
        case "property":
            return replace(component, properties={**component.properties, step.name: step.value})
        case "port":
            value = step.value if kind.value else ""
            return replace(component, connections={**component.connections, step.name: value})
        case "core":
            return component if step.kind == "shadow" else replace(component, core=step.name)
        case "fsm":
            return replace(component, fsm=step.name)
        case "shell":
            return replace(component, shell=step.name)
