"""A world for the rule engine: a model of an executor, in virtual time."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import count

from mauve_rt._kernel import ActionStep, Overlays
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.control.wishes import spec_of
from mauve_rt.supervision.decisions import Decision
from mauve_rt.supervision.inventory import Inventory, ListedComponent
from mauve_rt.supervision.remote_rules import RemoteRules
from mauve_rt.supervision.rule import ArchitectureView, ComponentView
from mauve_rt.supervision.rules import Rule

TICK_S = 0.05
LOCAL = "mauve_examples/LocalExploration"
USUAL = "mauve_examples/Exploration"


def rule(
    name: str = "link_lost",
    *,
    target: str = "exploration",
    undo: bool | list[dict[str, object]] = True,
    undo_for_s: float = 3.0,
    usual: str = USUAL,
    **changes: object,
) -> Rule:
    """`undo`: True puts the usual core in again, [] leaves that to the executor, False: there is none."""
    content: dict[str, object] = {
        "name": name,
        "when": {"silence": {"topic": "in", "type": "mauve_msgs/msg/PeerMessage", "longer_than_s": 1.0}},
        "do": [{"kind": "replace_core", "target": target, "name": LOCAL}],
    }
    if undo is not False:
        back = [{"kind": "replace_core", "target": target, "name": usual}] if undo is True else undo
        content["undo"] = {"for_s": undo_for_s} | ({"do": back} if back else {})
    return Rule(**content | changes)


@dataclass
class World:
    """Virtual time, a peer that speaks every 0.2 s while `talking`, and an executor that answers at once.

    The executor decides as the real one does what rules come to, by the kernel's Overlays.
    """

    rules: list[Rule]
    now_s: float = 100.0
    talking: bool = True
    answering: bool = True
    telling: bool = True  # the executor publishes ~/state
    listing: bool = True  # the executor answers ~/list_components
    inactive: bool = False
    own_rules: frozenset[str] = frozenset()  # that the executor runs itself
    value: float = 0.0  # of every field
    quiet: set[str] = field(default_factory=set)  # topics on which nobody speaks
    properties: dict[str, str] = field(default_factory=dict)  # of every component
    known: set[str] = field(default_factory=lambda: {LOCAL, USUAL})  # cores it would take
    trials: list[Request] = field(default_factory=list)  # dry runs
    refusals: list[Outcome] = field(default_factory=list)  # one for each of the next requests
    decisions: list[Decision] = field(default_factory=list)
    requests: list[Request] = field(default_factory=list)
    asked_at_s: list[float] = field(default_factory=list)
    ran: list[str] = field(default_factory=list)  # cores that were put in, one after the other
    revision: int = 5
    instance_id: str = "first"
    components: dict[str, ComponentView] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.engine = RemoteRules(
            self.rules,
            act=self._act,
            decide=self.decisions.append,
            look=self._look,
            ids=map(str, count(1)),
            name=lambda topic: f"/{topic}",
        )
        self._begin()
        self._last_word_s = self.now_s

    def restart(self, instance_id: str = "second") -> None:
        """Another start of the executor, which knows nothing of the one before and publishes its state."""
        self.instance_id = instance_id
        self._begin()
        self.tell()

    def _begin(self) -> None:
        self._overlays = Overlays()
        self.components = {name: ComponentView("RUNNING", USUAL) for name in ("exploration", "mapping")}
        for name, view in self.components.items():
            self._overlays.set_base(_core(name, view), "")  # by the file: by no person

    @property
    def active(self) -> frozenset[str]:
        """Rules, as the executor says."""
        return frozenset(overlay.rule for overlay in self._overlays.active())

    def tell(self, components: Mapping[str, ComponentView] | None = None) -> None:
        """The executor publishes its state, changed: by a person, unless a view names another author."""
        for name, view in (components or {}).items():
            if name not in self.components or self.components[name].core != view.core:
                self._overlays.note(_core(name, view), view.authors.get("core", "operator"))
            self.components[name] = view
        self.revision += 1
        if self.telling:
            view = ArchitectureView(
                self.instance_id,
                self.revision,
                dict(self.components),
                rules=self.own_rules,
                active=self.active,
            )
            self.engine.on_state(self.now_ns, view)

    def run(self, seconds: float) -> None:
        end_s = self.now_s + seconds - TICK_S / 2
        while self.now_s < end_s:
            next_s = self.now_s + TICK_S
            while (due_s := self.engine.tick(self.now_ns) / 1e9) < next_s:
                self.now_s = due_s
            self.now_s = next_s
            if self.talking and self.now_s - self._last_word_s >= 0.2:
                self._last_word_s = self.now_s
                self.hear()
            self.engine.tick(self.now_ns)

    @property
    def now_ns(self) -> int:
        return round(self.now_s * 1e9)

    def hear(self) -> None:
        """A sample on every topic that is not quiet."""
        for number, signal in enumerate(self.engine.signals):
            if signal.target not in self.quiet and signal.kind in ("message", "field"):
                self.engine.hear(number, self.now_ns, self.value)

    def _look(self) -> None:
        if not self.listing:
            return
        components = {
            name: ListedComponent(state=view.state, core=view.core, properties=self.properties)
            for name, view in self.components.items()
        }
        self.engine.on_inventory(self.now_ns, Inventory(self.instance_id, components))

    def _try(self, request: Request) -> None:
        self.trials.append(request)
        cores = [step.name for step in request.steps if step.kind == "replace_core"]
        strange = [core for core in cores if core not in self.known]
        words = "not active" if self.inactive else f"no core {strange[0]}" if strange else ""
        code = Code.NOT_ACTIVE if self.inactive else Code.UNKNOWN_CORE if words else Code.OK
        outcome = Outcome(code=code, message=words)
        self.engine.on_outcome(self.now_ns, request.request_id, outcome)

    def _act(self, request: Request) -> None:
        if request.dry_run:
            self._try(request)
            return
        self.requests.append(request)
        self.asked_at_s.append(self.now_s)
        if not self.answering:
            return
        if self.refusals:
            self.engine.on_outcome(self.now_ns, request.request_id, self.refusals.pop(0))
            return
        self.take(request)
        self.tell()
        outcome = Outcome(code=Code.OK, message="done", revision=self.revision)
        self.engine.on_outcome(self.now_ns, request.request_id, outcome)

    def take(self, request: Request) -> None:
        """The executor carries out a rule's request; tell() publishes it."""
        found = self._overlays.find(request.rule)
        if request.release and found is None:
            return
        overlay = self._overlays.put("", spec_of(request, found))
        steps = self._overlays.steps_if(overlay, not request.release)
        self._overlays.set_active(overlay, not request.release)
        self._overlays.settle_ended()
        for step in steps:
            self._do(step)
            if not request.release:
                self._overlays.note(step, f"rule {request.rule}")

    def set_already(self, rule: Rule) -> None:
        """A supervisor before this one has set the rule, or another supervisor."""
        self.take(Request(rule=rule.name, steps=tuple(rule.do), priority=rule.priority))

    def drop(self, rule: str) -> None:
        """Somebody else ends the rule at the executor."""
        self.take(Request(rule=rule, release=True))

    def _do(self, step: ActionStep) -> None:
        view = self.components.get(step.target)
        if view is None:
            return
        if step.kind == "replace_core":
            if view.core != step.name:
                self.ran.append(step.name)
            view = replace(view, core=step.name)
        elif step.kind in ("start", "stop"):
            view = replace(view, state="RUNNING" if step.kind == "start" else "STOPPED")
        self.components[step.target] = view

    def said(self) -> list[str]:
        return [decision.decision for decision in self.decisions]

    def cores(self) -> list[str]:
        """Of the first step of each request; empty: it has none."""
        return [request.steps[0].name if request.steps else "" for request in self.requests]

    def asked(self) -> list[str]:
        """What was asked for, in words."""
        return [f"{'release' if each.release else 'set'} {each.rule}" for each in self.requests]


def _core(component: str, view: ComponentView) -> ActionStep:
    return ActionStep("replace_core", component, view.core)


def started(*rules: Rule) -> World:
    world = World(list(rules) or [rule()])
    world.tell()
    return world
