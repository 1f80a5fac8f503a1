"""A command of the shell that runs in the background: a build or a test."""

import contextlib
import os
import signal
import subprocess
import time

_END_S = 2.0  # a compiler removes its unfinished files after SIGTERM; then SIGKILL
_TAIL_BYTES = 65536


class Command:
    """A running command in a process group of its own; all its output goes into a file in memory."""

    def __init__(self, line: str) -> None:
        self.begun_s = time.monotonic()
        # In memory: no folder may be writable.
        self._output = os.fdopen(os.memfd_create("output"), "w+b")
        self._process = subprocess.Popen(  # noqa: S602 - the user's own command line
            line,
            shell=True,
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

    def poll(self) -> int | None:
        """Exit status; None while the command runs."""
        return self._process.poll()

    def last_lines(self, count: int) -> list[str]:
        """The end of the output, without control characters."""
        size = self._output.seek(0, os.SEEK_END)
        text = os.pread(self._output.fileno(), _TAIL_BYTES, max(size - _TAIL_BYTES, 0)).decode(
            errors="replace"
        )
        lines = [line.rstrip() for line in text.splitlines() if line.strip()][-count:]
        return ["".join(each if each.isprintable() else " " for each in line) for line in lines]

    def stop(self) -> None:
        """End the command and all processes that it started."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_END_S)
        with contextlib.suppress(ProcessLookupError):  # the rest of the group, too
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
