"""The cycle of `mauve dev`: build, test, reload, probation. Knows neither a terminal nor ROS."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from mauve_rt.cli.dev_command import Command
from mauve_rt.cli.dev_sources import Save
from mauve_rt.counts import counted

_TAIL = 40
_MOST_NAMES = 3


class Executor(Protocol):
    """As DevExecutor."""

    @property
    def is_there(self) -> bool:
        """Whether it has answered lately."""

    @property
    def instance_id(self) -> str:
        """New at each start."""

    def look(self) -> None:
        """Take replies."""

    def reload(self, *, back: bool) -> Any:
        """Begin a reload; returns as ReloadRun."""


@dataclass
class Cycle:
    """One save, from the build to the verdict; or one way back."""

    number: int
    why: str
    saved_s: float
    build_s: float | None = None
    test_s: float | None = None
    reload_s: float | None = None
    total_s: float | None = None
    """From the save to the first release of the new code."""
    outcome: str = ""
    """Empty: not decided yet."""
    is_good: bool = False
    message: str = ""
    lines: Sequence[str] = ()
    """The end of the output of the command that failed."""
    steps: Sequence[Any] = ()
    """As OutputStep."""
    is_settled: bool = False
    """Whether its first release and its steps are noted."""


@dataclass(frozen=True)
class Plan:
    """What each cycle does."""

    build: str
    test: str = ""
    probation_s: float = 0.0


class Development:
    """Runs one cycle at a time; polled by look(). For one thread."""

    def __init__(
        self,
        plan: Plan,
        executor: Executor,
        *,
        tell: Callable[[str], None],
        run: Callable[[str], Command] = Command,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`tell` gets one line for each event; `run` starts a command."""
        self.cycles: list[Cycle] = []
        """The last of them is the newest."""
        self._plan = plan
        self._executor = executor
        self._tell = tell
        self._run = run
        self._clock = clock
        self._command: Command | None = None
        self._begun_s = 0.0
        self._is_test = False
        self._asked: tuple[Cycle, Any] | None = None
        """A reload without a reply."""
        self._tried: tuple[Cycle, Any] | None = None
        """A reload whose code runs, without a verdict."""
        self._save: Save | None = None
        self._wants_back = False
        self._instance_id = ""
        self._was_there: bool | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a command runs, a reply is pending, or a verdict."""
        return self._command is not None or self._asked is not None or self._tried is not None

    @property
    def state(self) -> str:
        """In words."""
        if self._command is not None:
            return f"{'testing' if self._is_test else 'building'} {self._clock() - self._begun_s:.1f} s"
        if self._asked is not None:
            return f"reloading {self._clock() - self._begun_s:.1f} s"
        if self._tried is not None:
            verdict = self._tried[1].verdict()
            if self._plan.probation_s and verdict.name == "running":
                return f"on probation, {verdict.left_s:.1f} s left"
            return "waits for the first release of the new code"
        return "watching"

    @property
    def output(self) -> list[str]:
        """The last line of the running command."""
        return self._command.last_lines(1) if self._command is not None else []

    def save(self, save: Save) -> None:
        """Build the newest sources. A running build or test ends; a pending reload is awaited."""
        if self._asked is not None:
            self._save = save
            return
        self._stop("superseded", "sources were saved again")
        self._begin(_names(save.files), save.saved_s)
        self._start(self._plan.build, is_test=False)

    def again(self) -> None:
        """As after a save, without one."""
        self.save(Save((), self._clock()))

    def back(self) -> None:
        """Put the code of before in force again; a running build or test ends."""
        if self._asked is not None:
            self._wants_back = True
            return
        self._stop("stopped", "the user goes back")
        self._reload(self._begin("go back", self._clock()), back=True)

    def end(self) -> None:
        """Leave no command behind."""
        self._stop("stopped", "mauve dev ends")

    def look(self) -> None:
        """Go on with what is due."""
        self._executor.look()
        self._look_at_presence()
        if self._command is not None:
            self._look_at_command(self._command)
        if self._asked is not None:
            self._look_at_reply(*self._asked)
        if self._tried is not None:
            self._look_at_trial(*self._tried)
        if self._asked is None and self._wants_back:
            self._wants_back = False
            self.back()
        elif self._asked is None and self._save is not None:
            save, self._save = self._save, None
            self.save(save)

    def _begin(self, why: str, saved_s: float) -> Cycle:
        self.cycles.append(Cycle(len(self.cycles) + 1, why, saved_s))
        self._note(self.cycles[-1], why)
        return self.cycles[-1]

    def _start(self, line: str, *, is_test: bool) -> None:
        self._command, self._begun_s, self._is_test = self._run(line), self._clock(), is_test
        self._note(self.cycles[-1], "testing" if is_test else "building")

    def _stop(self, outcome: str, why: str) -> None:
        if self._command is not None:
            self._command.stop()
            self._command = None
            self._finish(self.cycles[-1], outcome, message=why)

    def _look_at_command(self, command: Command) -> None:
        status = command.poll()
        if status is None:
            return
        self._command, cycle, took_s = None, self.cycles[-1], self._clock() - self._begun_s
        what = "test" if self._is_test else "build"
        if self._is_test:
            cycle.test_s = took_s
        else:
            cycle.build_s = took_s
        if status:
            cycle.lines = command.last_lines(_TAIL)
            self._finish(cycle, f"{what} failed", message=f"exit status {status}; the old code runs on")
            return
        self._note(cycle, f"{'tested' if self._is_test else 'built'} in {took_s:.2f} s")
        if self._plan.test and not self._is_test:
            self._start(self._plan.test, is_test=True)
        else:
            self._reload(cycle, back=False)

    def _reload(self, cycle: Cycle, *, back: bool) -> None:
        if not self._executor.is_there:
            why = "the executor does not answer; an executor that starts loads the newest code"
            self._finish(cycle, "not loaded", message=why)
            return
        self._begun_s = self._clock()
        self._instance_id = self._executor.instance_id
        self._asked = cycle, self._executor.reload(back=back)
        self._note(cycle, "reloading")

    def _look_at_reply(self, cycle: Cycle, run: Any) -> None:
        run.look()
        answer = run.answer
        if answer is None:
            if self._is_gone():
                self._asked = None
                self._finish(cycle, "lost", message="the executor ended before it replied")
            return
        self._asked = None
        cycle.reload_s = self._clock() - self._begun_s
        cycle.message = answer.message
        if not answer.success:
            self._finish(cycle, "refused", message=answer.message)
        elif not answer.is_changed:
            self._finish(cycle, "nothing changed", message=answer.message, is_good=True)
        else:
            if self._tried is not None:
                self._finish(self._tried[0], "superseded", message="other code is in force")
            self._tried = cycle, run
            self._note(cycle, f"reloaded in {cycle.reload_s:.2f} s: {answer.message}")

    def _look_at_trial(self, cycle: Cycle, run: Any) -> None:
        run.look()
        if self._is_gone():
            self._tried = None
            self._finish(cycle, "lost", message="the executor ended while the new code was tried")
            return
        if run.is_settled and not cycle.is_settled:
            self._note_steps(cycle, run)
        if not run.is_settled:
            return
        is_back = run.request.back
        if is_back or not self._plan.probation_s:
            self._tried = None
            self._finish(cycle, "went back" if is_back else "in force", message=cycle.message, is_good=True)
            return
        verdict = run.verdict()
        if verdict.name == "running":
            return
        self._tried = None
        outcome = "in force" if verdict.name == "none" else verdict.name
        message = verdict.reason if verdict.name != "none" else "the executor reports no probation"
        self._finish(cycle, outcome, message=message, is_good=verdict.name in ("passed", "none"))

    def _note_steps(self, cycle: Cycle, run: Any) -> None:
        cycle.steps, cycle.is_settled = run.steps, True
        if run.release_s is not None:
            cycle.total_s = run.release_s - cycle.saved_s
            self._note(cycle, f"first release {cycle.total_s:.2f} s after the save")
        for each in run.steps:
            if each.step is not None:
                words = f"{each.name} {each.before:.6g} -> {each.after:.6g}, step {each.step:.6g}"
                self._note(cycle, f"output {words}")

    def _look_at_presence(self) -> None:
        is_there = self._executor.is_there
        if self._was_there is None and is_there:
            self._tell("the executor answers")
        elif self._was_there is not None and is_there != self._was_there:
            self._tell("the executor is back" if is_there else "the executor does not answer")
        if is_there or self._was_there is not None:
            self._was_there = is_there

    def _is_gone(self) -> bool:
        return not self._executor.is_there or self._executor.instance_id != self._instance_id

    def _note(self, cycle: Cycle, text: str) -> None:
        self._tell(f"cycle {cycle.number}: {text}")

    def _finish(self, cycle: Cycle, outcome: str, *, message: str = "", is_good: bool = False) -> None:
        cycle.outcome, cycle.message, cycle.is_good = outcome, message, is_good
        self._note(cycle, f"{outcome}: {message}" if message else outcome)
        for line in cycle.lines:
            self._note(cycle, f"| {line}")


def _names(files: Sequence[Path]) -> str:
    if not files:
        return "build the present sources"
    names = [path.name for path in files[:_MOST_NAMES]]
    rest = len(files) - len(names)
    return f"saved {', '.join(names)}" + (f" and {counted(rest, 'more file')}" if rest else "")
