"""The rule engine of a supervisor, without ROS and with injected time: one action in flight.

The node calls `tick` every CHECK_PERIOD_S, `on_state` with every ~/state, `on_outcome` with the reply to a
request and `on_inventory` with that of ~/list_components, all from one thread. What the engine wants goes to
three callables.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.model.step_kinds import PRESENT
from mauve_rt.supervision.arming import Arming
from mauve_rt.supervision.conditions import Condition
from mauve_rt.supervision.effects import disagreement
from mauve_rt.supervision.inventory import Inventory
from mauve_rt.supervision.requests import ANSWER_TIMEOUT_S
from mauve_rt.supervision.rule import ArchitectureView, Kind, RuleLife
from mauve_rt.supervision.rules import Rule

STATE_TIMEOUT_S = 2.0
CHECK_PERIOD_S = 0.02  # at most between two ticks


Standing = Literal["not armed", "false", "true", "in effect"]


@dataclass(frozen=True)
class Decision:
    """Fields as mauve_msgs/msg/SupervisorDecision."""

    rule: str
    decision: str
    reason: str
    silence_s: float
    revision: int
    message: str = ""


@dataclass
class _Flight:
    life: RuleLife
    kind: Kind
    request: Request
    deadline_s: float
    outcome: Outcome | None = field(default=None)


class RuleEngine:
    """Rules, their conditions (by position) and what is in flight."""

    def __init__(
        self,
        rules: Sequence[tuple[Rule, Condition]],
        *,
        act: Callable[[Request], None],
        decide: Callable[[Decision], None],
        look: Callable[[], None],
        ids: Iterator[str],
    ) -> None:
        """`act` asks for a transaction or its dry run, `look` for an inventory, `decide` tells.

        `ids` has one for each request, which the executor has never seen.
        """
        lives = [RuleLife(rule, condition) for rule, condition in rules]
        self._lives = sorted(lives, key=lambda life: -life.rule.priority)
        self._act = act
        self._decide = decide
        self._view: ArchitectureView | None = None
        self._flight: _Flight | None = None
        self._ids = ids
        self._arming = Arming(look=look, act=act, ids=self._ids, tell=self._say)

    def tick(self, now_s: float) -> None:
        """Check every condition and act on what is due."""
        self._check_flight(now_s)
        for life in self._lives:
            if not life.armed:
                continue
            if life.watch(now_s):
                edge = "condition_true" if life.last_look.holds else "condition_false"
                self._say(life, edge, life.last_look.reason)
            kind = life.wants(now_s)
            if kind is not None:
                self._consider(life, kind, now_s)
        self._arming.tick(now_s)

    def on_state(self, now_s: float, view: ArchitectureView) -> None:
        """~/state changed."""
        restarted = self._view is not None and self._view.instance_id != view.instance_id
        self._view = view
        if restarted:
            if self._flight is not None:
                self._fail(self._flight, "the executor was started anew meanwhile", now_s)
            for life in self._lives:
                life.forget()
            self._arming.forget()
        self._arming.on_state()
        self._verify(now_s)
        for life in self._lives:
            self._follow(life, view, now_s)

    def on_outcome(self, now_s: float, request_id: str, outcome: Outcome | None, message: str = "") -> None:
        """The reply to a request; one that is not in flight any more is ignored.

        No outcome: it did not reach the executor; `message` says why.
        """
        if self._arming.on_outcome(now_s, request_id, outcome):
            return
        flight = self._flight
        if flight is None or flight.request.request_id != request_id or flight.outcome is not None:
            return
        flight.life.revision_floor = outcome.revision if outcome is not None else 0
        if outcome is None:
            self._fail(flight, "not sent", now_s, message=message)
            return
        if not outcome.success:
            self._fail(flight, "refused", now_s, outcome)
            return
        flight.outcome = outcome
        flight.deadline_s = now_s + STATE_TIMEOUT_S
        self._verify(now_s)

    def on_inventory(self, now_s: float, inventory: Inventory) -> None:
        """What ~/list_components says; of another start of the executor than ~/state it is ignored."""
        if self._view is not None and inventory.instance_id == self._view.instance_id:
            self._arming.on_inventory(now_s, inventory)

    def standing(self) -> Mapping[str, Standing]:
        """How each rule stands, by name."""
        return {life.rule.name: _standing(life) for life in self._lives}

    # ---- arming and following the state

    def _follow(self, life: RuleLife, view: ArchitectureView, now_s: float) -> None:
        if self._in_flight(life):
            return
        absent = sorted(name for name in life.rule.targets() if self._state_of(view, name) not in PRESENT)
        if absent and life.armed:
            life.armed = False
            state = self._state_of(view, absent[0])
            self._say(life, "suppressed", f"{absent[0]} is {state}: watching again once it runs")
        elif not absent and not life.armed:
            life.arm(now_s)
            running = ", ".join(f"{name} is RUNNING" for name in sorted(life.rule.targets()))
            self._say(life, "armed", running or "the executor is there")
            self._arming.begin(life, now_s)
        elif life.in_effect and not view.shows(life.rule.do, unknown=True):
            if self._superior(life, "do", now_s) is not None:
                return  # its doing: settled with its outcome
            life.in_effect = False
            life.left_alone = True
            present = view.describe(life.rule.do)
            self._say(life, "suppressed", f"{present} by another hand: left alone until the condition ends")

    @staticmethod
    def _state_of(view: ArchitectureView, name: str) -> str:
        component = view.components.get(name)
        return component.state if component is not None else "not in the architecture"

    # ---- acting

    def _consider(self, life: RuleLife, kind: Kind, now_s: float) -> None:
        view = self._view
        if view is None or view.revision < life.revision_floor or self._in_flight(life):
            return
        steps = life.steps(kind)
        if view.shows(steps, unknown=False):
            present = view.describe(steps)
            reason = f"nothing to {kind}: {present} already; {life.last_look.reason}"
            self._say(life, "suppressed", reason)
            life.settle(kind, now_s)
        elif (superior := self._superior(life, kind, now_s)) is not None:
            self._excuse(life, kind, _outranked(kind, superior))
        elif now_s < life.not_before_s:
            if life.failures == 0:
                self._excuse(life, kind, f"{kind} waits {life.not_before_s - now_s:.2f} s: cooldown")
        elif self._flight is not None:
            other = self._flight.life.rule.name
            self._excuse(life, kind, f"{kind} waits: the action of rule {other} is in flight")
        else:
            self._send(life, kind, now_s, view)

    def _send(self, life: RuleLife, kind: Kind, now_s: float, view: ArchitectureView) -> None:
        cause = life.cause(kind, now_s)
        request = Request(
            request_id=next(self._ids),
            steps=tuple(life.steps(kind)),
            expected_revision=view.revision,
            cause=cause,
            max_missed=life.max_missed(kind),
        )
        life.untouched = False
        self._flight = _Flight(life, kind, request, now_s + ANSWER_TIMEOUT_S)
        self._say(life, kind, cause.removeprefix(f"{life.rule.name}: "))
        self._act(request)

    # ---- priorities

    def _superior(self, life: RuleLife, kind: Kind, now_s: float) -> RuleLife | None:
        """A rule of higher priority that has done or is to do something else than this one wants.

        One whose action fails does not count: the next one's is better than none.
        """
        for other in self._lives:
            if other.rule.priority <= life.rule.priority:
                return None
            flying = self._flight is not None and self._flight.life is other and self._flight.kind == "do"
            wants = other.armed and other.failures == 0 and other.wants(now_s) == "do"
            if (other.in_effect or flying or wants) and disagreement(life.steps(kind), other.rule.do):
                return other
        return None

    def _supersede(self, flight: _Flight) -> None:
        """What an action replaced of rules below it is in effect no longer; they may do it again later."""
        for life in self._lives:
            lower = life.rule.priority < flight.life.rule.priority
            if lower and life.in_effect and disagreement(life.rule.do, flight.life.steps(flight.kind)):
                life.in_effect = False
                life.excused = "do"
                self._say(life, "suppressed", _outranked("do", flight.life))

    def _excuse(self, life: RuleLife, kind: Kind, reason: str) -> None:
        if life.excused != kind:
            life.excused = kind
            self._say(life, "suppressed", reason)

    # ---- outcomes

    def _in_flight(self, life: RuleLife) -> bool:
        return self._flight is not None and self._flight.life is life

    def _check_flight(self, now_s: float) -> None:
        flight = self._flight
        if flight is None or now_s < flight.deadline_s:
            return
        if flight.outcome is None:
            self._fail(flight, f"no answer within {ANSWER_TIMEOUT_S:.0f} s", now_s)
        else:
            reason = f"~/state did not confirm within {STATE_TIMEOUT_S:.0f} s"
            self._fail(flight, reason, now_s, flight.outcome)

    def _verify(self, now_s: float) -> None:
        flight, view = self._flight, self._view
        if (
            flight is None
            or view is None
            or flight.outcome is None
            or view.revision < flight.outcome.revision
        ):
            return
        steps = flight.life.steps(flight.kind)
        present = view.describe(steps)
        # At a later revision somebody else may have changed it again: that is no failure of ours.
        if view.revision == flight.outcome.revision and not view.shows(steps, unknown=True):
            self._fail(flight, f"~/state shows otherwise: {present}", now_s, flight.outcome)
            return
        self._flight = None
        flight.life.settle(flight.kind, now_s)
        self._supersede(flight)
        self._say(flight.life, "done", f"{flight.kind}: {present}", flight.outcome.message)
        self._follow(flight.life, view, now_s)

    def _fail(
        self, flight: _Flight, reason: str, now_s: float, outcome: Outcome | None = None, message: str = ""
    ) -> None:
        self._flight = None
        wrong_revision = outcome is not None and outcome.code is Code.WRONG_REVISION
        delay_s = flight.life.fail(now_s, wrong_revision=wrong_revision)
        reason = f"{flight.kind} failed: {reason}; next try in {delay_s:.2f} s if still needed"
        self._say(flight.life, "failed", reason, outcome.message if outcome else message)

    def _say(self, life: RuleLife, decision: str, reason: str, message: str = "") -> None:
        revision = self._view.revision if self._view is not None else 0
        self._decide(Decision(life.rule.name, decision, reason, life.last_look.silence_s, revision, message))


def _outranked(kind: Kind, superior: RuleLife) -> str:
    return f"{kind} waits: outranked by rule {superior.rule.name} (priority {superior.rule.priority})"


def _standing(life: RuleLife) -> Standing:
    if life.in_effect:
        return "in effect"
    if not life.armed:
        return "not armed"
    return "true" if life.last_look.holds else "false"
