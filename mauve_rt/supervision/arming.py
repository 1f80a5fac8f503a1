"""What a supervisor asks the executor about a rule before it needs it, without ROS and with injected time.

Once for each start of the executor, when a rule is armed for the first time: is what it does in effect (a
supervisor before this one did it: the rule takes it as its own, to undo it), and would the executor take what
it does and undoes (dry runs)? What would be refused is told then, not when the link is lost.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from mauve_rt.control.requests import Code, Outcome, Request
from mauve_rt.model.steps import Step
from mauve_rt.supervision.inventory import Inventory
from mauve_rt.supervision.requests import ANSWER_TIMEOUT_S
from mauve_rt.supervision.rule import Kind, RuleLife

ASK_AGAIN_S = 1.0

Tell = Callable[[RuleLife, str, str, str], None]  # rule, decision, reason, the executor's message


@dataclass(frozen=True)
class _Trial:
    life: RuleLife
    kind: Kind

    def steps(self) -> list[Step]:
        """What to try: an undo makes sense only after its do, together or because that is in effect."""
        if self.kind == "do" or self.life.in_effect:
            return self.life.steps(self.kind)
        return [*self.life.steps("do"), *self.life.steps("undo")]


class Arming:
    """The questions about rules that were armed, one at a time. For the engine's thread."""

    def __init__(
        self,
        *,
        look: Callable[[], None],
        act: Callable[[Request], None],
        ids: Iterator[str],
        tell: Tell,
    ) -> None:
        """`look` asks for an inventory, `act` for a dry run; `ids` has one for each request."""
        self._look = look
        self._act = act
        self._ids = ids
        self._tell = tell
        self.forget()

    def forget(self) -> None:
        """The executor was started anew: what was asked of it before counts no longer."""
        self._unlisted: list[RuleLife] = []
        self._trials: deque[_Trial] = deque()
        self._flight: tuple[str, _Trial] | None = None
        self._look_again_s = self._try_again_s = 0.0
        self._waits_for_state = False

    def begin(self, life: RuleLife, now_s: float) -> None:
        """A rule was armed; asks about it, the first time."""
        if life.checked:
            return
        life.checked = True
        self._unlisted.append(life)
        self._ask(now_s)

    def on_state(self) -> None:
        """~/state changed: what was no question to an executor that was not active may be one now."""
        self._waits_for_state = False

    def tick(self, now_s: float) -> None:
        """Ask what is due: again, where no answer came."""
        if self._unlisted and now_s >= self._look_again_s:
            self._ask(now_s)
        if now_s < self._try_again_s or self._waits_for_state:
            return
        self._flight = None  # no answer came
        trial = next((trial for trial in self._trials if trial.life.armed), None)
        if trial is None:
            return
        if trial.kind == "do" and trial.life.in_effect:  # done meanwhile
            self._next(trial)
            return
        request = Request(
            request_id=next(self._ids), steps=tuple(trial.steps()), cause=_cause(trial), dry_run=True
        )
        self._flight = (request.request_id, trial)
        self._try_again_s = now_s + ANSWER_TIMEOUT_S
        self._act(request)

    def on_inventory(self, now_s: float, inventory: Inventory) -> None:
        """Take rules whose do is in effect as done by this supervisor, and line up what is to be tried."""
        unlisted, self._unlisted = self._unlisted, []
        for life in unlisted:
            undo = life.steps("undo")
            if not inventory.shows(life.rule.do):
                self._trials.append(_Trial(life, "do"))
            elif undo and not inventory.shows(undo):
                if life.untouched:
                    life.adopt(now_s)
                    self._tell(
                        life, "adopted", "what it does is in effect already: undone when it is time", ""
                    )
                self._trials.append(_Trial(life, "undo"))

    def on_outcome(self, now_s: float, request_id: str, outcome: Outcome | None) -> bool:
        """The reply to a dry run, None: it was not sent; False when it is about something else."""
        if self._flight is None or self._flight[0] != request_id:
            return False
        _, trial = self._flight
        self._flight, self._try_again_s = None, 0.0
        if outcome is None:
            self._try_again_s = now_s + ASK_AGAIN_S
        elif outcome.code is Code.NOT_ACTIVE:
            self._waits_for_state = True
        elif outcome.success:
            self._next(trial)
        else:
            self._trials.remove(trial)
            what = f"the executor would refuse to {trial.kind}: {_words(trial)}"
            self._tell(trial.life, "refused", f"{what}; mend the rules or the architecture", outcome.message)
        return True

    def _ask(self, now_s: float) -> None:
        self._look_again_s = now_s + ASK_AGAIN_S
        self._look()

    def _next(self, trial: _Trial) -> None:
        self._trials.remove(trial)
        if trial.kind == "do" and trial.life.rule.undo is not None:
            self._trials.appendleft(_Trial(trial.life, "undo"))


def _cause(trial: _Trial) -> str:
    return f"{trial.life.rule.name}: would {trial.kind} be accepted?"


def _words(trial: _Trial) -> str:
    return ", ".join(
        f"{step.kind} {step.target} {step.name}".rstrip() for step in trial.life.steps(trial.kind)
    )
