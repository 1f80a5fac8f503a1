"""Showing how a mission goes: a live table on a terminal, plain lines elsewhere."""

import sys
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol, Self, TextIO

from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from mauve_examples.mission.plan import Plan, colour

PLAIN_PERIOD_S = 5.0
REFRESH_HZ = 5.0


@dataclass(frozen=True)
class RobotPicture:
    """One robot as it is shown. `explored`: share of the reachable free cells, 0 to 1."""

    name: str
    explored: float
    core: str  # of its exploration component
    remark: str = ""  # done, a fault


@dataclass(frozen=True)
class MissionPicture:
    """The mission at one instant. Times in seconds of mission time."""

    time_s: float
    duration_s: float
    link_up: bool
    robots: list[RobotPicture]
    together: float
    events: list[str] = field(default_factory=list)  # all so far, oldest first
    plan: Plan | None = None


class Progress(Protocol):
    """Where the picture goes. For one thread."""

    def __enter__(self) -> Self:
        """Begin to show."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""

    def say(self, text: str) -> None:
        """One line about what is going on before the mission starts or after it ended."""

    def show(self, picture: MissionPicture) -> None:
        """The mission now; may be called as often as one likes."""


def open_progress(stream: TextIO | None = None) -> Progress:
    """The display that fits the stream (standard output by default)."""
    stream = stream or sys.stdout
    return LiveProgress(stream) if stream.isatty() else PlainProgress(stream)


class PlainProgress:
    """A line for every event as it happens, and one about everybody every five seconds."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._told = 0
        self._next_s = 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_exception: object) -> None:
        """Nothing to tidy up."""

    def say(self, text: str) -> None:
        """Print it."""
        print(text, file=self._stream, flush=True)

    def show(self, picture: MissionPicture) -> None:
        """Print what is new."""
        for event in picture.events[self._told :]:
            self.say(event)
        self._told = len(picture.events)
        if picture.time_s >= self._next_s:
            self._next_s = PLAIN_PERIOD_S * (picture.time_s // PLAIN_PERIOD_S + 1)
            robots = "".join(f" | {_in_words(robot)}" for robot in picture.robots)
            link = "link up  " if picture.link_up else "link DOWN"
            self.say(f"{picture.time_s:6.1f} s  {link}{robots} | together {picture.together:4.0%}")


class LiveProgress:
    """A map of what each robot knows and a table, redrawn in place; events scroll by above it."""

    def __init__(self, stream: TextIO) -> None:
        self._console = Console(file=stream, highlight=False)
        self._live = Live(console=self._console, refresh_per_second=REFRESH_HZ, transient=True)
        self._told = 0
        self._next_s = 0.0

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(self, *_exception: object) -> None:
        self._live.stop()

    def say(self, text: str) -> None:
        """Print it above the table."""
        self._console.print(text, markup=False)

    def show(self, picture: MissionPicture) -> None:
        """Redraw the table, at most five times a second."""
        for event in picture.events[self._told :]:
            self.say(event)
        self._told = len(picture.events)
        if picture.time_s >= self._next_s:
            self._next_s = picture.time_s + 1.0 / REFRESH_HZ
            self._live.update(_table(picture))


def _in_words(robot: RobotPicture) -> str:
    remark = f" ({robot.remark})" if robot.remark else ""
    return f"{robot.name} {robot.explored:4.0%} {robot.core or '-'}{remark}"


def _table(picture: MissionPicture) -> Group:
    link = Text("link up", "green") if picture.link_up else Text("link down", "bold red")
    head = Text.assemble(f"{picture.time_s:5.1f} s of at most {picture.duration_s:g} s   ", link)
    table = Table("robot", "explored", "", "exploration runs", "", box=None, pad_edge=False)
    for index, robot in enumerate(picture.robots):
        bar = ProgressBar(total=1.0, completed=robot.explored, width=30)
        table.add_row(
            Text(robot.name, colour(index)), bar, f"{robot.explored:.0%}", robot.core or "-", robot.remark
        )
    bar = ProgressBar(total=1.0, completed=picture.together, width=30)
    table.add_row("together", bar, f"{picture.together:.0%}", "", "")
    return Group(Text(), *([picture.plan.drawn()] if picture.plan is not None else []), head, table)
