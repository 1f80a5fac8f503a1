"""What a supervisor asks the executor about a rule before it needs it, without ROS and with injected time.

Once for each start of the executor, when a rule is armed for the first time: would the executor take what it
does and undoes (dry runs)? What would be refused is reported then, not when the link is lost.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from mauve_rt._kernel import RuleStatus
from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.model.steps import Step
from mauve_rt.supervision.inventory import Inventory
from mauve_rt.supervision.requests import ANSWER_TIMEOUT_NS
from mauve_rt.supervision.rule import WatchedRule

ASK_AGAIN_NS = 1_000_000_000
NEVER_NS = 2**63 - 1

Tell = Callable[
    [WatchedRule, str, str, int, str], None
]  # rule, decision, reason, when, the executor's message


@dataclass(frozen=True)
class _Trial:
    each: WatchedRule
    act: str


class Arming:
    """The questions about rules that were armed, one at a time. For the thread of the rules."""

    def __init__(
        self,
        *,
        look: Callable[[], None],
        act: Callable[[Request], None],
        ids: Iterator[str],
        tell: Tell,
        status: Callable[[int], RuleStatus],
    ) -> None:
        """`look` asks for an inventory, `act` for a dry run; `ids` has one for each request."""
        self._look = look
        self._act = act
        self._ids = ids
        self._tell = tell
        self._status = status
        self.forget()

    def forget(self) -> None:
        """The executor was started anew: what was asked of it before counts no longer."""
        self._unlisted: list[WatchedRule] = []
        self._trials: deque[_Trial] = deque()
        self._flight: tuple[str, _Trial] | None = None
        self._look_again_ns = self._try_again_ns = 0
        self._waits_for_state = False

    def begin(self, each: WatchedRule, now_ns: int) -> None:
        """A rule was armed; asks about it, the first time."""
        if each.checked:
            return
        each.checked = True
        self._unlisted.append(each)
        self._ask(now_ns)

    def on_state(self) -> None:
        """~/state changed: what was no question to an executor that was not active may be one now."""
        self._waits_for_state = False

    def due_ns(self) -> int:
        """When tick() has something to do at the latest."""
        due_ns = self._look_again_ns if self._unlisted else NEVER_NS
        return due_ns if self._next_trial() is None else min(due_ns, self._try_again_ns)

    def tick(self, now_ns: int) -> None:
        """Ask what is due: again, where no answer came."""
        if self._unlisted and now_ns >= self._look_again_ns:
            self._ask(now_ns)
        trial = self._next_trial()
        if trial is None or now_ns < self._try_again_ns:
            return
        self._flight = None  # no answer came
        if trial.act == "do" and self._in_effect(trial):  # done meanwhile
            self._next(trial)
            return
        request = Request(
            request_id=next(self._ids),
            steps=tuple(self._steps(trial)),
            cause=_cause(trial),
            rule=trial.each.rule.name,
            dry_run=True,
        )
        self._flight = (request.request_id, trial)
        self._try_again_ns = now_ns + ANSWER_TIMEOUT_NS
        self._act(request)

    def on_inventory(self, now_ns: int, inventory: Inventory) -> None:
        """Line up what is to be tried: not what is so."""
        del now_ns
        unlisted, self._unlisted = self._unlisted, []
        for each in unlisted:
            undo = each.rule.steps("undo")
            if not inventory.shows(each.rule.do):
                self._trials.append(_Trial(each, "do"))
            elif undo and not inventory.shows(undo):
                self._trials.append(_Trial(each, "undo"))

    def on_outcome(self, now_ns: int, request_id: str, outcome: Outcome | None) -> bool:
        """The reply to a dry run, None: it was not sent; False when it is about something else."""
        if self._flight is None or self._flight[0] != request_id:
            return False
        _, trial = self._flight
        self._flight, self._try_again_ns = None, 0
        if outcome is None:
            self._try_again_ns = now_ns + ASK_AGAIN_NS
        elif outcome.code is Code.NOT_ACTIVE:
            self._waits_for_state = True
        elif outcome.success:
            self._next(trial)
        else:
            self._trials.remove(trial)
            what = f"the executor would refuse to {trial.act}: {_words(trial)}"
            reason = f"{what}; mend the rules or the architecture"
            self._tell(trial.each, "refused", reason, now_ns, outcome.message)
        return True

    def _ask(self, now_ns: int) -> None:
        self._look_again_ns = now_ns + ASK_AGAIN_NS
        self._look()

    def _next_trial(self) -> _Trial | None:
        if self._waits_for_state:
            return None
        return next((trial for trial in self._trials if self._status(trial.each.number).armed), None)

    def _next(self, trial: _Trial) -> None:
        self._trials.remove(trial)
        if trial.act == "do" and trial.each.rule.steps("undo"):
            self._trials.appendleft(_Trial(trial.each, "undo"))

    def _in_effect(self, trial: _Trial) -> bool:
        return self._status(trial.each.number).in_effect

    def _steps(self, trial: _Trial) -> list[Step]:
        """What to try: an undo makes sense only after its do, together or because that is in effect."""
        rule = trial.each.rule
        if trial.act == "do" or self._in_effect(trial):
            return rule.steps(trial.act)
        return [*rule.steps("do"), *rule.steps("undo")]


def _cause(trial: _Trial) -> str:
    return f"{trial.each.rule.name}: would {trial.act} be accepted?"


def _words(trial: _Trial) -> str:
    return ", ".join(
        f"{step.kind} {step.target} {step.name}".rstrip() for step in trial.each.rule.steps(trial.act)
    )
