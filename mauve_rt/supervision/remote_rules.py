"""Rules at work on an executor of another process: the native engine decides, ~/state tells, requests act.

Without ROS and with injected time, ns of any steady clock. Whoever hosts them calls `tick` at the instant
that the last one returned and whenever something of interest was heard, `on_state` with every ~/state,
`on_outcome` with the reply to a request and `on_inventory` with that of ~/list_components, all from one
thread. What the rules want goes to three callables. One action at a time is in flight: the executor
carries out requests one after the other.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from mauve_rt._kernel import PendingAction, RuleEngine, RuleStatus
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.supervision.arming import ASK_AGAIN_NS, NEVER_NS, Arming
from mauve_rt.supervision.decision_words import Name
from mauve_rt.supervision.decisions import Decision, decision_of
from mauve_rt.supervision.engine_rules import rule_specs
from mauve_rt.supervision.inventory import Inventory
from mauve_rt.supervision.outside import inside_only
from mauve_rt.supervision.requests import ANSWER_TIMEOUT_NS, STATE_TIMEOUT_NS
from mauve_rt.supervision.rule import ArchitectureView, WatchedRule
from mauve_rt.supervision.rules import Rule
from mauve_rt.supervision.view_signals import ViewSignals

LEFT_TO_EXECUTOR = "the executor runs it itself: left to it while it does"


@dataclass
class _Flight:
    each: WatchedRule
    act: str
    request: Request
    deadline_ns: int
    outcome: Outcome | None = field(default=None)
    behind: set[int] = field(default_factory=set)  # rules that were told to wait for it


class RemoteRules:
    """Rules, and what is in flight."""

    def __init__(
        self,
        rules: Sequence[Rule],
        *,
        act: Callable[[Request], None],
        decide: Callable[[Decision], None],
        look: Callable[[], None],
        ids: Iterator[str],
        name: Name = str,
        release_on_loss: bool = False,
    ) -> None:
        """`act` asks for a transaction or its dry run, `look` for an inventory, `decide` tells.

        `ids` has one for each request, which the executor has never seen; `name`: the full name of a topic;
        `release_on_loss`: as of Request.
        """
        self._rules = list(rules)
        self._engine = RuleEngine(rule_specs(rules))
        self.signals = self._engine.signals
        self._watched = [
            WatchedRule(number, rule, unobservable=_unobservable(rule)) for number, rule in enumerate(rules)
        ]
        self._act = act
        self._decide = decide
        self._name = name
        self._release_on_loss = release_on_loss
        self._ids = ids
        self._view: ArchitectureView | None = None
        self._view_signals = ViewSignals(self._engine)
        self._flight: _Flight | None = None
        self._failure = self._message = ""  # of the flight that has just ended
        self._due_ns: int | None = None
        self._word = self._engine.word()
        self._arming = Arming(look=look, act=act, ids=ids, tell=self._say, status=self.status)

    def hear(self, signal: int, now_ns: int, value: float = 0.0) -> None:
        """Something that a condition listens to: one of `signals`."""
        self._engine.tell(signal, now_ns, value)

    @property
    def is_stirred(self) -> bool:
        """Whether something of interest was heard since the last tick()."""
        return self._engine.word() != self._word

    def tick(self, now_ns: int) -> int:
        """Decide and act on what is due; when to do it again at the latest."""
        self._word = self._engine.word()
        self._check_flight(now_ns)
        next_ns = self._engine.step(now_ns)
        while (pending := self._engine.pending) is not None and self._flight is None:
            self._send(pending, now_ns)
            next_ns = self._engine.step(now_ns)
        if pending is not None:
            self._let_wait(pending, now_ns)
        self._tell()
        next_ns = min(next_ns, self._let_go(now_ns))
        self._arming.tick(now_ns)
        if self._flight is not None:
            next_ns = min(next_ns, self._flight.deadline_ns)
        self._due_ns = min(next_ns, self._arming.due_ns())
        return self._due_ns

    def on_state(self, now_ns: int, view: ArchitectureView) -> None:
        """~/state changed."""
        restarted = self._view is not None and self._view.instance_id != view.instance_id
        before, self._view = self._view, view
        if restarted:
            if self._flight is not None:
                self._fail("the executor was started again before the reply", now_ns, how="timed_out")
            self._engine.forget()
            for each in self._watched:
                each.forget()
            self._arming.forget()
        self._view_signals.tell(now_ns, before, view)
        self._arming.on_state()
        self._verify(now_ns)
        self._follow(now_ns)

    def on_outcome(self, now_ns: int, request_id: str, outcome: Outcome | None, message: str = "") -> None:
        """The reply to a request; one that is not in flight any more is ignored.

        No outcome: it did not reach the executor; `message` says why.
        """
        if self._arming.on_outcome(now_ns, request_id, outcome):
            return
        for each in self._watched:
            if each.releasing == request_id and (outcome is None or not outcome.success):
                each.release_ns = now_ns + ASK_AGAIN_NS
        flight = self._flight
        if flight is None or flight.request.request_id != request_id or flight.outcome is not None:
            return
        if outcome is None:
            self._fail("not sent", now_ns, message=message)
        elif not outcome.success and outcome.code is not Code.WRONG_REVISION:
            self._fail("refused", now_ns, message=outcome.message)
        else:  # in force, or decided upon what ~/state has not told yet
            flight.outcome = outcome
            flight.deadline_ns = now_ns + STATE_TIMEOUT_NS
            self._verify(now_ns)

    def on_inventory(self, now_ns: int, inventory: Inventory) -> None:
        """What ~/list_components says; of another start of the executor than ~/state it is ignored."""
        if self._view is not None and inventory.instance_id == self._view.instance_id:
            self._arming.on_inventory(now_ns, inventory)
            self._tell()

    def standings(self) -> Iterator[tuple[str, RuleStatus, str]]:
        """Name and status of each rule, and why it does not act; empty: nothing prevents it."""
        for each in self._watched:
            why = each.unobservable or (LEFT_TO_EXECUTOR if each.left else "")
            yield each.rule.name, self.status(each.number), why

    def status(self, number: int) -> RuleStatus:
        """How a rule fares."""
        return self._engine.status(number)

    # ---- following the state

    def _follow(self, now_ns: int) -> None:
        """Nothing is what it seems while an action is in flight: it is looked at when that has ended."""
        if self._view is None or self._flight is not None:
            return
        for each in self._watched:
            self._follow_one(each, self._view, now_ns)
        self._tell()

    def _follow_one(self, each: WatchedRule, view: ArchitectureView, now_ns: int) -> None:
        is_active = each.rule.name in view.active
        if not is_active:
            each.own, each.releasing, each.release_ns = False, "", 0
        if each.rule.where == "executor" and each.rule.name in view.rules:
            if not each.left:
                self._engine.forget(each.number)
                each.forget()
                each.left = True
                self._say(each, "suppressed", LEFT_TO_EXECUTOR, now_ns)
            return
        each.left = False
        if each.unobservable:
            if not each.told_unobservable:
                each.told_unobservable = True
                self._say(each, "suppressed", each.unobservable, now_ns)
            return
        if absent := each.absent(view):
            each.standing = f"{absent} is {view.state_of(absent)}: watching again once it runs"
            self._engine.set_present(each.number, False, now_ns)
            self._tell()
            return
        was_armed = self.status(each.number).armed
        running = ", ".join(f"{name} is RUNNING" for name in sorted(each.rule.targets()))
        each.standing = running or "the executor is there"
        self._engine.set_present(each.number, True, now_ns)
        self._tell()
        if not was_armed:
            self._arming.begin(each, now_ns)
        if is_active and not each.own and not self.status(each.number).in_effect:
            each.own = True  # of a supervisor before this one
            self._engine.adopt(each.number, is_active=True, now_ns=now_ns)
            self._tell()
        self._engine.set_in_place(each.number, "do", is_active and not each.releasing)

    # ---- acting

    def _send(self, pending: PendingAction, now_ns: int) -> None:
        each = self._watched[pending.rule]
        self._engine.begun(now_ns)
        each.releasing = ""
        stays = pending.act == "undo" and each.rule.undo is None  # it ended before its `do` was done
        cause = f"{each.rule.name}: {self._tell()}"
        request = Request(
            request_id=next(self._ids),
            steps=tuple(each.rule.do if stays else each.rule.steps(pending.act)),
            expected_revision=self._revision(),
            cause=cause,
            rule=each.rule.name,
            release=pending.act == "undo",
            priority=each.rule.priority,
            release_on_loss=self._release_on_loss,
        )
        self._flight = _Flight(each, pending.act, request, now_ns + ANSWER_TIMEOUT_NS)
        self._act(request)

    def _let_go(self, now_ns: int) -> int:
        """End at the executor what has ended here, until ~/state shows it; when to ask again at the latest.

        What a rule without `undo` did stays.
        """
        next_ns = NEVER_NS
        for each in self._watched:
            status = self.status(each.number)
            if self._flight is not None or not each.own or status.active or status.in_effect:
                continue
            if now_ns >= each.release_ns:
                each.releasing = next(self._ids)
                each.release_ns = now_ns + ANSWER_TIMEOUT_NS
                self._act(
                    Request(
                        request_id=each.releasing,
                        steps=tuple(each.rule.do),
                        cause=f"{each.rule.name}: its condition has ended",
                        rule=each.rule.name,
                        release=True,
                    )
                )
            if each.own:
                next_ns = min(next_ns, each.release_ns)
        return next_ns

    def _let_wait(self, pending: PendingAction, now_ns: int) -> None:
        flight = self._flight
        if flight is None or pending.rule in flight.behind:
            return
        flight.behind.add(pending.rule)
        reason = f"no {pending.act}: the action of rule {flight.each.rule.name} is under way"
        self._say(self._watched[pending.rule], "suppressed", reason, now_ns)

    def _check_flight(self, now_ns: int) -> None:
        flight = self._flight
        if flight is None or now_ns < flight.deadline_ns:
            return
        if flight.outcome is None:
            self._fail(f"no answer within {ANSWER_TIMEOUT_NS / 1e9:.0f} s", now_ns, how="timed_out")
        else:
            reason = f"~/state did not confirm within {STATE_TIMEOUT_NS / 1e9:.0f} s"
            self._fail(reason, now_ns, how="timed_out", message=flight.outcome.message)

    def _verify(self, now_ns: int) -> None:
        flight, view = self._flight, self._view
        if flight is None or view is None or flight.outcome is None:
            return
        if view.revision < flight.outcome.revision:
            return
        if not flight.outcome.success:
            self._fail("refused", now_ns, how="stale", message=flight.outcome.message)
            return
        # At a later revision somebody else may have changed it again: that is no failure of ours.
        is_active = flight.each.rule.name in view.active
        if view.revision == flight.outcome.revision and is_active != (flight.act == "do"):
            is_so = "active" if is_active else "not active"
            self._fail(f"~/state shows that it is {is_so}", now_ns, message=flight.outcome.message)
            return
        flight.each.own = is_active and flight.act == "do"
        self._end(now_ns, "done", message=flight.outcome.message)

    def _fail(self, reason: str, now_ns: int, *, how: str = "refused", message: str = "") -> None:
        self._end(now_ns, how, failure=reason, message=message)

    def _end(self, now_ns: int, how: str, *, failure: str = "", message: str = "") -> None:
        flight, self._flight = self._flight, None
        if flight is None:
            return
        self._failure, self._message = failure, message
        self._engine.ended(flight.each.number, flight.act, how, now_ns)
        self._tell()
        self._failure = self._message = ""
        self._follow(now_ns)

    # ---- telling

    def _tell(self) -> str:
        """What the engine has decided by now; returns the last reason."""
        reason = ""
        while (made := self._engine.take()) is not None:
            each = self._watched[made.rule]
            has_ended = made.decision in ("done", "failed")
            is_presence = made.decision == "armed" or (made.decision == "suppressed" and not made.why)
            decision = decision_of(
                made,
                self._rules,
                name=self._name,
                failure=self._failure,
                reason=each.standing if is_presence else "",
                revision=self._revision(),
                message=self._message if has_ended else "",
            )
            self._decide(decision)
            reason = decision.reason
        return reason

    def _say(self, each: WatchedRule, decision: str, reason: str, now_ns: int, message: str = "") -> None:
        """What is no decision of the engine, after those that were made before."""
        self._tell()
        told = Decision(
            time_ns=now_ns,
            rule=each.rule.name,
            decision=decision,
            reason=reason,
            revision=self._revision(),
            message=message,
        )
        self._decide(told)

    def _revision(self) -> int:
        return self._view.revision if self._view is not None else 0


def _unobservable(rule: Rule) -> str:
    """Why a rule cannot be run outside of its executor; mostly nothing."""
    unobservable = next(filter(None, map(inside_only, rule.when.leaves())), "")
    return f"the executor does not run it, and only there {unobservable}" if unobservable else ""
