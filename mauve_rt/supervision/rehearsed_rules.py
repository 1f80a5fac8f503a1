"""The rules of a file at work on a simulated executor, as they are on a real one. Knows no ROS.

The executor's rules run in the native runner; the supervisor's send their requests to the executor's Control.
A script, or a bag, tells their conditions what they hear.
"""

from collections.abc import Callable, Collection
from dataclasses import replace
from itertools import count

from mauve_rt._kernel import (
    ComponentDescription,
    RuleRunner,
    RuleStatus,
    Simulation,
    ToldDecision,
    Transaction,
)
from mauve_rt.control.control import Control
from mauve_rt.control.no_ros import NoRos
from mauve_rt.control.requests import Request
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.wishes import step_of
from mauve_rt.model.steps import Step
from mauve_rt.supervision.decisions import Decision, decision_of
from mauve_rt.supervision.engine_rules import rule_specs
from mauve_rt.supervision.inventory import Inventory, ListedComponent
from mauve_rt.supervision.remote_rules import RemoteRules
from mauve_rt.supervision.rule import ArchitectureView, ComponentView
from mauve_rt.supervision.rule_actions import own_rules, rule_actions
from mauve_rt.supervision.rules import Rule, RulesFile
from mauve_rt.supervision.stand_ins import is_stand_in
from mauve_rt.supervision.view_signals import ViewSignals

_SUPERVISOR = "supervisor"
_LONGEST_BLIND_NS = 50_000_000  # what happens to components is noticed so much later at most


class RehearsedRules:
    """At work from the start on. The architecture is active."""

    def __init__(
        self,
        simulation: Simulation,
        runtime: Runtime,
        file: RulesFile,
        decide: Callable[[Decision], None],
        *,
        left_out: Collection[str] = (),
        hears_states: bool = True,
    ) -> None:
        """`decide` takes each decision; rules that are `left_out` do not run.

        `hears_states`: rules of the executor hear the states and changes of its components.

        Raises:
            ArchitectureFileError: at a step that the executor would refuse.
            MauveError: the rules cannot be used.
        """
        self._simulation = simulation
        self._runtime = runtime
        self._decide = decide
        self._own = own_rules(file, left_out=left_out)
        self._others = [
            rule for rule in file.rules.rules if rule.where == "supervisor" and rule.name not in left_out
        ]
        self._control = Control(runtime, outside=NoRos())
        actions = rule_actions(file, runtime, left_out=left_out)
        self._runner = RuleRunner(runtime.host, rule_specs(self._own, with_reserve=True), actions, told=True)
        self._requests: list[Request] = []
        self._remote = RemoteRules(
            self._others,
            act=self._requests.append,
            decide=decide,
            look=self._look,
            ids=map(str, count(1)),
        )
        self._inside = len(self._runner.signals)
        self.signals = [*self._runner.signals, *self._remote.signals]
        self._view: ArchitectureView | None = None
        self._states: dict[str, str] = {}  # of components that do not run, as they are said to be
        self._own_states = ViewSignals(self._runner) if hears_states else None
        self._is_stirred = False
        self._due_ns = 0
        self.looks = 0  # how often the rules have looked: until the next time they stand as they do
        self._runner.start()
        for number, signal in enumerate(self.signals):
            if signal.kind == "goal":  # no goal has come yet: the executor knows that
                self.tell(number, 0.0)
        self.look()

    def tell(self, signal: int, value: float) -> None:
        """One of `signals` reports a value, now; look() decides."""
        now_ns = self._simulation.now_ns()
        if signal < self._inside:
            self._is_stirred |= self._runner.tell(signal, now_ns, value)
        else:
            self._remote.hear(signal - self._inside, now_ns, value)

    def set_state(self, component: str, state: str) -> None:
        """A component that is there runs from now on, or does not; a supervisor sees it in this state."""
        self._states[component] = state
        for part in self._runtime.components():
            runs = part.state == "RUNNING"
            if part.name == component and runs != (state == "RUNNING"):
                (self._runtime.host.stop if runs else self._runtime.host.start)(component)
        self._is_stirred = True

    def adopt(self, rule: str) -> None:
        """A rule is active since before, and what it wants is in force."""
        overlays = self._runtime.architecture.overlays
        for number, each in enumerate(self._own):
            overlay = overlays.find(rule)
            if each.name != rule or overlay is None or overlay.is_active:
                continue
            self._runtime.architecture.follow()
            steps = overlays.steps_if(overlay, True, self._runtime.architecture.describe())
            overlays.set_engaged(overlay, is_engaged=True)
            overlays.set_active(overlay, is_active=True)
            transaction = Transaction()
            for step in steps:
                transaction.add(step.kind, step.target, step.name, step.value)
            self._runtime.host.make(transaction)
            self._runner.adopt(number)
        for each in self._others:
            if each.name == rule:
                self._control.handle(
                    Request(rule=rule, steps=tuple(each.do), priority=each.priority, requested_by=_SUPERVISOR)
                )
        self._is_stirred = True

    def run_until(self, instant_ns: int) -> None:
        """Let time pass; the rules act when they have to, at the instant not yet."""
        while (now_ns := self._simulation.now_ns()) < instant_ns:
            until_ns = min(instant_ns, max(self._due_ns, now_ns + 1), now_ns + _LONGEST_BLIND_NS)
            revision = self._runtime.kernel_revision()
            self._simulation.run_until(until_ns)
            self._is_stirred |= self._runtime.kernel_revision() != revision
            if until_ns < instant_ns:
                self.look()

    def look(self) -> None:
        """Decide and act on what is due, and on what was told."""
        if not (self._is_stirred or self._remote.is_stirred or self._simulation.now_ns() >= self._due_ns):
            return
        self.looks += 1
        is_news = True
        while is_news:
            self._is_stirred = False
            due_ns = self._runner.advance()
            for told in self._runner.wait_told(0):
                self._decide(self._decision(told))
            is_news = self._show()
            self._due_ns = min(due_ns, self._remote.tick(self._simulation.now_ns()))
            is_news = self._carry_out() or is_news

    def status(self, rule: str) -> RuleStatus:
        """How it fares."""
        for number, each in enumerate(self._others):
            if each.name == rule:
                return self._remote.status(number)
        return next(facts.status for facts in self._runner.facts() if facts.name == rule)

    def is_so(self, rule: str) -> bool:
        """Whether the architecture is as an active rule wants it; not where others have taken all of that."""
        overlays = self._runtime.architecture.overlays
        found = overlays.find(rule)
        if found is None or not found.is_active:
            return False
        if overlays.steps_if(found, True, self._runtime.architecture.describe()):
            return False
        wanted = (overlays.wanted(step) for step in found.assigns)
        return any(each.by == "rule" and each.rule == rule for each in wanted)

    # ---- the executor's rules

    def _decision(self, told: ToldDecision) -> Decision:
        made = told.decision
        rule = self._own[made.rule]
        return decision_of(
            made,
            self._own,
            failure=told.failure,
            reason=_what_was_done(rule, told),
            revision=self._runtime.revision,
            message=self._problem(rule.name) if made.decision == "suppressed" else "",
        )

    def _problem(self, rule: str) -> str:
        return next(facts.problem for facts in self._runner.facts() if facts.name == rule)

    # ---- the supervisor's

    def _carry_out(self) -> bool:
        """Whether there was something to carry out."""
        requests, self._requests[:] = list(self._requests), []
        for request in requests:
            outcome = self._control.handle(replace(request, requested_by=_SUPERVISOR))
            self._remote.on_outcome(self._simulation.now_ns(), request.request_id, outcome)
        return bool(requests)

    def _show(self) -> bool:
        """As ~/state; whether it has changed."""
        self._runtime.host.settle_probations()
        observed = self._runtime.observe()
        shown = {part.name: ComponentView(self._state_of(part), part.core) for part in observed.components}
        active = frozenset(overlay.rule for overlay in self._runtime.architecture.overlays.active())
        names = frozenset(rule.name for rule in self._own)
        view = ArchitectureView(
            self._runtime.instance_id, observed.revision, shown, rules=names, active=active
        )
        before, self._view = self._view, view
        if view == before:
            return False
        now_ns = self._simulation.now_ns()
        if self._own_states is not None:
            self._own_states.tell(now_ns, before, view)
        self._remote.on_state(now_ns, view)
        return True

    def _state_of(self, part: ComponentDescription) -> str:
        said = self._states.get(part.name, "RUNNING")
        return part.state if "RUNNING" in (part.state, said) else said

    def _look(self) -> None:
        """As ~/list_components."""
        listed = {part.name: _listed(part) for part in self._runtime.components()}
        inventory = Inventory(self._runtime.instance_id, listed, frozenset(self._runtime.resources()))
        self._remote.on_inventory(self._simulation.now_ns(), inventory)


def _what_was_done(rule: Rule, told: ToldDecision) -> str:
    """As the executor says it; empty: in the words of the rule."""
    made = told.decision
    if made.decision != "done" or made.act == "otherwise":
        return ""
    known = (*rule.do, *rule.steps("undo"))
    steps: list[Step] = [step_of(step, known) for step in told.steps]
    return "" if any(map(is_stand_in, steps)) else f"{made.act}: {', '.join(map(str, steps))}"


def _listed(part: ComponentDescription) -> ListedComponent:
    return ListedComponent(
        state=part.state,
        shell=part.shell,
        core=part.core,
        fsm=part.fsm,
        properties={item.name: str(item.value) for item in part.properties},
        connections={
            port.name: f"{port.resource}.{port.service}" if port.resource else "" for port in part.ports
        },
    )
