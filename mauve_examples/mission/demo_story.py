"""What has happened in a mission so far: the lines people read, and the picture of now. For one thread."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mauve_examples.mission.plan import Plan
from mauve_examples.mission.progress import MissionPicture, RobotPicture
from mauve_msgs.msg import ComponentInfo, StepReport
from mauve_rt.supervision.remote_rules import LEFT_TO_EXECUTOR
from mauve_rt.trace.report.units import counted

COMPONENT = "exploration"
DONE_LASTS_S = 1.5  # before its first scan, or while a peer's map arrives, a robot may think so for a moment
TOLD_DECISIONS = ("adopted", "condition_true", "failed", "suppressed")
SETTLE_S = 1.0  # so much later nothing comes any more that happened before
DRY_RUN = " (dry run)"


class Happening(NamedTuple):
    """What happened; of two at the same time the cause comes first."""

    time_s: float
    """Mission time."""
    is_effect: bool
    text: str


@dataclass
class Swap:
    """A core that was replaced."""

    component: str
    from_core: str
    to_core: str
    blackout_ns: int
    missed_releases: int


@dataclass
class RobotStory:
    """What is known of one robot."""

    core: str = ""
    core_since_s: float = 0.0  # mission time
    done: bool = False  # has said so for DONE_LASTS_S
    done_since_s: float | None = None  # mission time; None: says that it is not
    faults: dict[str, str] = field(default_factory=dict)  # by component
    swaps: list[Swap] = field(default_factory=list)
    realtime_granted: bool = False
    realtime_missing: list[str] = field(default_factory=list)


class MissionStory:
    """Fed with messages as they arrive.

    Events are reported in the order of their times. A message may come half a second late, so each line
    waits for SETTLE_S.
    """

    def __init__(
        self, robots: list[str], *, clock: Callable[[], float], age_s: Callable[[Any], float] = lambda _: 0.0
    ) -> None:
        """`clock`: the mission time, s, negative before the start; `age_s`: of a message's stamp, s."""
        self.robots = {robot: RobotStory() for robot in robots}
        self.link_up = True
        self.link_changes: list[tuple[float, bool]] = []
        self._waiting: list[Happening] = []
        self._lines: list[str] = []
        self._clock = clock
        self._age_s = age_s

    def tell(self, text: str, *, at_s: float | None = None, is_effect: bool = True) -> None:
        """Add to the story what happened at a mission time, now by default."""
        self._waiting.append(Happening(self._clock() if at_s is None else at_s, is_effect, text))

    def lines(self, *, to_the_end: bool = False) -> list[str]:
        """The story so far, by mission time; `to_the_end`: with what has not settled."""
        until_s = math.inf if to_the_end else self._clock() - SETTLE_S
        due = sorted(one for one in self._waiting if one.time_s <= until_s)
        self._waiting = [one for one in self._waiting if one.time_s > until_s]
        self._lines += [f"{one.time_s:6.1f} s  {one.text}" for one in due]
        return [*self._lines]

    def on_state(self, robot: str, state: Any) -> None:
        """mauve_msgs/msg/ArchitectureState."""
        story = self.robots[robot]
        story.realtime_granted = state.realtime.granted
        story.realtime_missing = list(state.realtime.missing)
        for status in state.components:
            if status.name == COMPONENT:
                core = status.core.rsplit("/", 1)[-1]
                if core != story.core:
                    story.core, story.core_since_s = core, self._clock()
            if status.state == ComponentInfo.FAULTED and status.name not in story.faults:
                story.faults[status.name] = status.fault
                self.tell(f"{robot}: {status.name} FAULTED: {status.fault}")

    def on_event(self, robot: str, event: Any) -> None:
        """mauve_msgs/msg/ReconfigurationEvent."""
        if event.success and event.request.endswith(DRY_RUN):
            return  # a rule asks beforehand whether its action would be taken
        own = (f"/{robot}/executor", f"/{robot}/supervisor")
        who = f" (asked by {event.requested_by})" if event.requested_by not in ("", *own) else ""
        if not event.success:
            self.tell(f"{robot}: refused: {event.request}: {event.message}{who}")
            return
        changes = [report for report in event.report if report.to_core]
        if not changes:
            self.tell(f"{robot}: {event.request}{who}")
            return
        story = self.robots[robot]
        for report in changes:
            swap = Swap(
                component=report.component,
                from_core=report.from_core.rsplit("/", 1)[-1],
                to_core=report.to_core.rsplit("/", 1)[-1],
                blackout_ns=report.blackout_ns,
                missed_releases=report.missed_releases,
            )
            story.swaps.append(swap)
            # The event waits for the next release, to tell its phase; ~/state told of the swap at once.
            known = swap.component == COMPONENT and swap.to_core == story.core
            self.tell(f"{robot}: {describe(swap)}{who}", at_s=story.core_since_s if known else None)

    def on_decision(self, robot: str, decision: Any) -> None:
        """mauve_msgs/msg/SupervisorDecision; what the executor's events tell better is left out."""
        if decision.decision not in TOLD_DECISIONS or decision.reason == LEFT_TO_EXECUTOR:
            return
        message = f": {decision.message}" if decision.message else ""
        at_s = self._clock() - self._age_s(decision.stamp)
        self.tell(f"{robot}: {decision.rule}: {decision.reason}{message}", at_s=at_s, is_effect=False)

    def on_done(self, robot: str, done: bool) -> None:  # noqa: FBT001 - the message's one field
        """The robot has nothing left that it can explore, or has again; believed when it stays so."""
        story = self.robots[robot]
        if not done:
            story.done, story.done_since_s = False, None
            return
        now_s = self._clock()
        if story.done_since_s is None:
            story.done_since_s = now_s
        if not story.done and now_s - story.done_since_s >= DONE_LASTS_S:
            story.done = True
            self.tell(f"{robot}: has explored all it can reach", at_s=story.done_since_s)

    def on_link(self, up: bool) -> None:  # noqa: FBT001 - the message's one field
        """The radio's link changed."""
        if up == self.link_up:
            return
        self.link_up = up
        self.link_changes.append((self._clock(), up))
        self.tell("the radio link is back" if up else "the radio link is LOST")

    def link_gaps(self) -> list[tuple[float, float | None]]:
        """When the link was down, in mission time; None: to the end."""
        gaps: list[tuple[float, float | None]] = []
        for time_s, up in self.link_changes:
            if up:
                gaps[-1] = (gaps[-1][0], time_s)
            else:
                gaps.append((time_s, None))
        return gaps

    def picture(
        self,
        *,
        duration_s: float,
        explored: dict[str, float],
        together: float,
        plan: Plan | None = None,
        at_the_end: bool = False,
    ) -> MissionPicture:
        """What to show now. `explored`: share per robot, 0 to 1; `at_the_end`: nothing more will happen."""
        robots = [
            RobotPicture(name=name, explored=explored[name], core=story.core, remark=_remark(story))
            for name, story in self.robots.items()
        ]
        return MissionPicture(
            time_s=self._clock(),
            duration_s=duration_s,
            link_up=self.link_up,
            robots=robots,
            together=together,
            events=self.lines(to_the_end=at_the_end),
            plan=plan,
        )


def describe(swap: Swap) -> str:
    """One swap in words: what, and what it cost."""
    words = [f"{swap.component}: {swap.from_core} -> {swap.to_core}"]
    if swap.blackout_ns not in (StepReport.NOT_MEASURED, 0):  # simulated time measures nothing
        words.append(f"blackout {swap.blackout_ns / 1e3:.0f} us")
    if swap.missed_releases != StepReport.NOT_MEASURED:
        words.append(f"{counted(swap.missed_releases, 'release')} missed")
    return ", ".join(words)


def _remark(story: RobotStory) -> str:
    if story.faults:
        return f"{', '.join(sorted(story.faults))} FAULTED"
    return "done" if story.done else ""
