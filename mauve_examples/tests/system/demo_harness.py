"""Whole missions as processes, on a ROS domain of this test run's own: what the fixture `start` starts."""

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
import uuid
from dataclasses import dataclass, field
from pathlib import Path

import pytest

DOMAIN = random.randint(51, 100)  # noqa: S311 - the stage `ros`, which may run meanwhile, has 1 to 50
MARK = "MAUVE_SYSTEM_TEST"
PATIENCE_S = 300.0  # a busy machine's; longer than any mission here


@dataclass
class Demo:
    """A demo that was started, and what became of it."""

    out: Path
    mark: str
    process: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    errors: str = ""

    @property
    def status(self) -> int | None:
        return self.process.returncode

    def wait_for(self, words: str, *, timeout_s: float = PATIENCE_S) -> str:
        """Read on until a line has these words."""
        assert self.process.stdout is not None
        deadline_s = time.monotonic() + timeout_s
        for line in self.process.stdout:
            self.lines.append(line.rstrip())
            if words in line:
                return line
            assert time.monotonic() < deadline_s, f"no line with {words!r} in time"
        self.process.wait()
        pytest.fail(f"the demo ended without a line with {words!r}: {self.lines[-5:]} {self._errors()}")

    def finish(self, *, timeout_s: float = PATIENCE_S) -> int:
        """Read to the end; returns the exit status."""
        output, self.errors = self.process.communicate(timeout=timeout_s)
        self.lines += output.splitlines()
        return self.process.returncode

    def interrupt(self) -> int:
        """Ctrl-C; returns the exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.finish()

    def interrupt_until_heard(self) -> int:
        """Ctrl-C, and again where it was lost, as one may be while the interpreter itself loads."""
        while self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(10)
        return self.finish()

    def handles_signals(self) -> bool:
        """Whether it catches SIGTERM, which a bare interpreter does not."""
        status = Path(f"/proc/{self.process.pid}/status").read_text("ascii")
        caught = int(status.partition("SigCgt:")[2].split()[0], 16)
        return bool(caught & 1 << (signal.SIGTERM - 1))

    def processes(self) -> dict[int, str]:
        """Process ids and command lines of what lives of this demo, itself included."""
        found = {}
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                if f"{MARK}={self.mark}".encode() in (folder / "environ").read_bytes():
                    command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                    found[int(folder.name)] = command
        return found

    def pid_of(self, words: str) -> int:
        """The process whose command line has these words."""
        [pid] = [pid for pid, command in self.processes().items() if words in command]
        return pid

    def _errors(self) -> str:
        return self.process.stderr.read() if self.process.stderr is not None else ""


class Starter:
    """Starts demos and ends what a test left."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._demos: list[Demo] = []

    def __call__(self, *arguments: str, out: Path | None = None, prefix: tuple[str, ...] = ()) -> Demo:
        mark = uuid.uuid4().hex
        out = out or self.folder / "mission"
        command = [*prefix, sys.executable, "-P", "-m", "mauve_examples.mission.demo", *arguments]
        process = subprocess.Popen(
            [*command, "--out", str(out)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=self.folder,
            env=os.environ | {"ROS_DOMAIN_ID": str(DOMAIN), MARK: mark},
        )
        demo = Demo(out=out, mark=mark, process=process)
        self._demos.append(demo)
        return demo

    def close(self) -> None:
        for demo in self._demos:
            for pid in demo.processes():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
            demo.process.wait()
