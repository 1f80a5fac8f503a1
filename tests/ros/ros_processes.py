"""Processes of the tests: an executor, and when any of ours has begun."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

PATIENCE_S = 100.0
RELAY = """\
mauve: 1
components:
  relay: {shell: mauve_rt/Float64RelayShell, core: mauve_rt/Float64Relay, fsm: mauve_rt/Float64RelayFsm}
resources:
  given: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: given, direction: subscribe}}
  passed: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [relay.input, given.read]
  - [relay.output, passed.write]
"""


def wait_for_signals(process_id: int) -> None:
    """Until a process of ours handles signals: a thread blocks SIGINT and SIGTERM, and not SIGCHLD.

    Threads of libraries that block every signal come sooner than that.
    """
    deadline = time.monotonic() + PATIENCE_S
    ours, others = (_mask(signal.SIGINT) | _mask(signal.SIGTERM)), _mask(signal.SIGCHLD)
    while not any(blocked & (ours | others) == ours for blocked in _blocked_signals(process_id)):
        assert time.monotonic() < deadline, "it never did"
        time.sleep(0.002)


def _mask(number: signal.Signals) -> int:
    return 1 << (number - 1)


def _blocked_signals(process_id: int) -> set[int]:
    blocked = set()
    for status in Path(f"/proc/{process_id}/task").glob("*/status"):
        with contextlib.suppress(OSError):  # a thread that has just ended
            blocked.add(int(status.read_text("ascii").partition("SigBlk:")[2].split()[0], 16))
    return blocked


def keep_interpreter(executor: "ExecutorProcess", how: str = "5") -> Path:
    """Let the executor's core PyKeeping keep the interpreter; returns a file, to be removed, that says so.

    For `how` seconds, or until the pipe of that path is opened to write.
    """
    file = Path(tempfile.gettempdir()) / f"mauve_keeping_{executor.process.pid}"
    new = file.with_suffix(".new")
    new.write_text(how, encoding="utf-8")
    return new.replace(file)


class ExecutorProcess:
    """`ros2 run mauve_rt executor --ros-args ...`, as a process of its own."""

    def __init__(
        self,
        folder: Path,
        environment: dict[str, str],
        arguments: Sequence[str],
        *,
        wrapper: Sequence[str] = (),
        console: int | None = None,
    ) -> None:
        """`console`: a file descriptor for what it prints, in place of `output`."""
        self._log = folder / f"executor_{time.monotonic_ns()}.log"
        with self._log.open("w", encoding="utf-8") as log:
            self.process = subprocess.Popen(
                [*wrapper, sys.executable, "-m", "mauve_rt.node.executor.main", "--ros-args", *arguments],
                env={**os.environ, **environment},
                stdout=log if console is None else console,
                stderr=subprocess.STDOUT,
            )

    @property
    def output(self) -> str:
        """Everything it printed."""
        return self._log.read_text(encoding="utf-8")

    def await_output(self, words: str) -> None:
        """Until it has printed that: a thread of its own writes the log, after what is told elsewhere."""
        deadline = time.monotonic() + PATIENCE_S
        while words not in self.output:
            assert time.monotonic() < deadline, f"it never printed: {words}\n{self.output}"
            time.sleep(0.01)

    def wait_begun(self) -> None:
        """Until it handles signals: loading takes a while."""
        wait_for_signals(self.process.pid)

    def wait(self, timeout_s: float = PATIENCE_S) -> int:
        """Its exit status."""
        return self.process.wait(timeout_s)

    def end(self, number: signal.Signals) -> tuple[int, float]:
        """Send a signal; exit status and the seconds it took to go."""
        began = time.monotonic()
        self.process.send_signal(number)
        return self.wait(), time.monotonic() - began
