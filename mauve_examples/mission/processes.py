"""The processes of a mission: started each in a session of its own, watched, ended together."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

CHILD_MODULE = "mauve_examples.mission.processes_child"
POLL_S = 0.02


@dataclass(frozen=True)
class Ended:
    """A process that ended though nobody asked it to."""

    name: str
    status: int  # negative: the signal that ended it
    last_line: str  # of its log

    def describe(self) -> str:
        """One line: who, how and its last words."""
        how = f"exit status {self.status}" if self.status >= 0 else signal.Signals(-self.status).name
        return f"{self.name} ended ({how})" + (f": {self.last_line}" if self.last_line else "")


@dataclass
class _Child:
    name: str
    popen: subprocess.Popen[bytes]
    log: Path


class Processes:
    """Python modules run as processes that end with this one, whatever ends it. For one thread."""

    def __init__(self, log_folder: Path, *, inherited: Sequence[int] = ()) -> None:
        """Every process logs to log_folder/NAME.log and inherits the file descriptors `inherited`."""
        self._log_folder = log_folder
        self._inherited = tuple(inherited)
        self._children: list[_Child] = []

    def start(self, name: str, module: str, *arguments: str, wrapper: Sequence[str] = ()) -> None:
        """Run `python -m module arguments...` in a session of its own: Ctrl-C reaches only the demo.

        `wrapper` is a command that becomes the one behind it, such as one that enters another machine.
        """
        self._log_folder.mkdir(parents=True, exist_ok=True)
        log = self._log_folder / f"{name}.log"
        with log.open("wb") as output:
            popen = subprocess.Popen(
                [*wrapper, sys.executable, "-m", CHILD_MODULE, str(os.getpid()), module, *arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=self._inherited,
            )
        self._children.append(_Child(name, popen, log))

    def pid(self, name: str) -> int:
        """The process id of a started process."""
        return next(child.popen.pid for child in self._children if child.name == name)

    def ended(self) -> Ended | None:
        """The first process that has ended, None while all run."""
        for child in self._children:
            status = child.popen.poll()
            if status is not None:
                return Ended(child.name, status, _last_line(child.log))
        return None

    def stop(self, patience_s: Callable[[], float]) -> list[str]:
        """Interrupt every process group, later kill the rest; returns the names of those killed.

        `patience_s` says how long after the interrupt that is; it is asked again and again and may shrink.
        """
        self._signal(signal.SIGINT)
        start_s = time.monotonic()
        while self._running() and time.monotonic() < start_s + patience_s():
            time.sleep(POLL_S)
        killed = [child.name for child in self._running()]
        self._signal(signal.SIGKILL)
        for child in self._children:
            child.popen.wait()
        self._children.clear()
        return killed

    def _running(self) -> list[_Child]:
        return [child for child in self._children if child.popen.poll() is None]

    def _signal(self, number: signal.Signals) -> None:
        for child in self._running():
            try:
                os.killpg(child.popen.pid, number)
            except ProcessLookupError:  # it is not the leader of its session yet, or gone just now
                child.popen.send_signal(number)


def _last_line(log: Path) -> str:
    """The last line of a log that says something; a traceback's is its error."""
    lines = [line.strip() for line in log.read_text(encoding="utf-8", errors="replace").splitlines()]
    return next((line for line in reversed(lines) if line), "")
