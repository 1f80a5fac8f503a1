"""The life of one rule of a supervisor, without ROS and with injected time.

A rule does (`do`) once its condition has held for `for_s`, and undoes (`undo`) once it has not held for
`undo.for_s`. It never fights a person: what it wants and finds already done is not done again, and what
somebody changes while the rule is in effect stays as it is until the condition ends.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from mauve_rt.model.step_kinds import PRESENT
from mauve_rt.model.steps import Step
from mauve_rt.supervision.conditions import Condition, Look
from mauve_rt.supervision.rules import Rule

FIRST_RETRY_S = 0.5
LONGEST_RETRY_S = 30.0
REVISION_RETRY_S = 0.05  # somebody else changed the architecture meanwhile: look again soon


Kind = Literal["do", "undo"]


@dataclass(frozen=True)
class ComponentView:
    """A component as ~/state shows it. state: a name such as RUNNING."""

    state: str
    core: str


@dataclass(frozen=True)
class ArchitectureView:
    """What ~/state said last."""

    instance_id: str
    revision: int
    components: Mapping[str, ComponentView]

    def shows(self, steps: Iterable[Step], *, unknown: bool) -> bool:
        """Whether the steps' effect is in place; `unknown` stands for steps that ~/state does not show."""
        return all(self._shows_step(step, unknown=unknown) for step in steps)

    def _shows_step(self, step: Step, *, unknown: bool) -> bool:
        component = self.components.get(step.target)
        if step.kind == "replace_core":
            return component is not None and component.core == step.name
        if step.kind == "start":
            return component is not None and component.state in PRESENT
        if step.kind == "stop":
            return component is not None and component.state == "STOPPED"
        return unknown

    def describe(self, steps: Iterable[Step]) -> str:
        """What the steps' targets are now, for a reason."""
        texts = []
        for name in dict.fromkeys(step.target for step in steps if step.target in self.components):
            view = self.components[name]
            state = "runs" if view.state in PRESENT else f"is {view.state} with"
            texts.append(f"{name} {state} {view.core}")
        return ", ".join(texts)


class RuleLife:
    """One rule. Called by the engine's thread only; times in seconds of one steady clock."""

    def __init__(self, rule: Rule, condition: Condition) -> None:
        self.rule = rule
        self.condition = condition
        self.last_look = Look(holds=False, reason="")
        self.armed = False
        self.in_effect = False
        self.left_alone = False
        self.checked = False  # the executor was asked about it, or is being asked
        self.untouched = True  # nothing was done for it yet since the executor's start
        self.not_before_s = 0.0
        self.revision_floor = 0  # the view must have reached it before the next action
        self.failures = 0
        self.excused = ""  # the last reason given for not acting, so that it is given once
        self._since_s = 0.0

    def arm(self, now_s: float) -> None:
        """Start watching; what is in effect stays so, until the condition is seen to be false."""
        self.armed = True
        self.condition.arm(now_s)
        if self.in_effect:
            self.condition.assume()
        self.last_look = Look(holds=False, reason="")
        self._since_s = now_s

    def adopt(self, now_s: float) -> None:
        """What it does was done before it was armed: undo it once the condition has been seen to be false."""
        self.in_effect = True
        self.condition.assume()
        self._since_s = now_s

    def forget(self) -> None:
        """The executor was started anew: nothing of before counts."""
        self.armed = self.in_effect = self.left_alone = self.checked = False
        self.untouched = True
        self.not_before_s, self.revision_floor, self.failures, self.excused = 0.0, 0, 0, ""

    def watch(self, now_s: float) -> bool:
        """Look at the condition; True when it changed."""
        before = self.last_look.holds
        self.last_look = self.condition.look(now_s)
        if self.last_look.holds == before:
            return False
        self._since_s = now_s
        self.failures = 0
        self.excused = ""
        return True

    def wants(self, now_s: float) -> Kind | None:
        """What the dwell times ask for now, whether it may be done or not."""
        lasted_s = now_s - self._since_s
        if self.last_look.holds:
            due = not self.in_effect and not self.left_alone and lasted_s >= self.rule.for_s
            return "do" if due else None
        undo = self.rule.undo
        if lasted_s < (undo.for_s if undo else 0.0):
            return None
        self.left_alone = False
        if self.in_effect and undo is None:
            self.in_effect = False
        return "undo" if self.in_effect else None

    def steps(self, kind: Kind) -> list[Step]:
        """The transaction of `do` or `undo`."""
        if kind == "do":
            return self.rule.do
        return self.rule.undo.do if self.rule.undo else []

    def max_missed(self, kind: Kind) -> int:
        """How many releases each component may miss for it."""
        if kind == "do":
            return self.rule.max_missed
        return self.rule.undo.max_missed if self.rule.undo else 0

    def cause(self, kind: Kind, now_s: float) -> str:
        """Why, in words for the executor's record."""
        lasted = f" for {now_s - self._since_s:.2f} s" if kind == "undo" else ""
        return f"{self.rule.name}: {self.last_look.reason}{lasted}"

    def settle(self, kind: Kind, now_s: float) -> None:
        """An action is in place."""
        self.in_effect = kind == "do"
        self.untouched = False
        self.failures = 0
        self.excused = ""
        self.not_before_s = now_s + self.rule.cooldown_s

    def fail(self, now_s: float, *, wrong_revision: bool) -> float:
        """An action failed; returns the delay before the next one, s, doubled with every failure in a row."""
        first_s = REVISION_RETRY_S if wrong_revision else max(self.rule.cooldown_s, FIRST_RETRY_S)
        delay_s = min(first_s * 2.0**self.failures, max(LONGEST_RETRY_S, self.rule.cooldown_s))
        self.failures = min(self.failures + 1, 16)
        self.excused = ""
        self.not_before_s = now_s + delay_s
        return delay_s
