"""What has happened in a mission so far: the lines people read, and the picture of now. For one thread."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mauve_examples.mission.progress import MissionPicture, RobotPicture
from mauve_msgs.msg import ComponentInfo, StepReport

COMPONENT = "exploration"
DONE_LASTS_S = 1.5  # before its first scan, or while a peer's map arrives, a robot may think so for a moment
TOLD_DECISIONS = ("adopted", "condition_true", "failed", "suppressed")


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
    """Fed with messages as they arrive; `clock` gives the mission time, s, negative before the start."""

    def __init__(self, robots: list[str], *, clock: Callable[[], float]) -> None:
        self.robots = {robot: RobotStory() for robot in robots}
        self.link_up = True
        self.link_changes: list[tuple[float, bool]] = []
        self.events: list[tuple[float, str]] = []  # as they became known; mission time in s
        self._clock = clock

    def tell(self, text: str, *, at_s: float | None = None) -> None:
        """Add to the story what happened at a mission time, now by default."""
        self.events.append((self._clock() if at_s is None else at_s, text))

    def lines(self, *, by_time: bool = False) -> list[str]:
        """The story so far, with mission times, in the order in which it became known or by time."""
        events = sorted(self.events) if by_time else self.events
        return [f"{time_s:6.1f} s  {text}" for time_s, text in events]

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
        who = f" (asked by {event.requested_by})" if event.requested_by else ""
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
        if decision.decision in TOLD_DECISIONS:
            message = f": {decision.message}" if decision.message else ""
            self.tell(f"{robot}: {decision.rule}: {decision.reason}{message}")

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

    def picture(self, *, duration_s: float, explored: dict[str, float], together: float) -> MissionPicture:
        """What to show now. `explored`: share per robot, 0 to 1."""
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
            events=self.lines(),
        )


def describe(swap: Swap) -> str:
    """One swap in words: what, and what it cost."""
    blackout = "blackout not measured"
    if swap.blackout_ns != StepReport.NOT_MEASURED:
        blackout = f"blackout {swap.blackout_ns / 1e3:.0f} us"
    missed = f"{swap.missed_releases} releases missed" if swap.missed_releases else "no release missed"
    if swap.missed_releases == StepReport.NOT_MEASURED:
        missed = "releases missed not measured"
    return f"{swap.component}: {swap.from_core} -> {swap.to_core}, {blackout}, {missed}"


def _remark(story: RobotStory) -> str:
    if story.faults:
        return f"{', '.join(sorted(story.faults))} FAULTED"
    return "done" if story.done else ""
