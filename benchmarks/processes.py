"""Processes that a measurement needs beside it: started, watched and ended, their output in files."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

from native import BenchmarkError
from scope import Scope

_START_S = 30.0
_END_S = 10.0


class Processes(Scope):
    """A context: whatever was spawned inside it is gone after it."""

    def __init__(self) -> None:
        super().__init__()
        self._running: dict[str, subprocess.Popen[bytes]] = {}

    def _enter(self, stack: ExitStack) -> None:
        # A domain of our own where none is set: other nodes' traffic is no part of the measurement.
        os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
        self.folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="mauve_bench_")))

    def spawn(self, name: str, *words: str, **environment: str) -> int:
        """Start a Python program: a file, or -m and a module, and its arguments; its process id."""
        log = self._stack.enter_context((self.folder / f"{name}.log").open("wb"))
        process = subprocess.Popen(
            [sys.executable, "-P", *words],
            stdin=subprocess.PIPE,
            stdout=log,
            stderr=log,
            env=os.environ | environment,
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)  # first: unless it ended well by then
        self._running[name] = process
        return process.pid

    def tell(self, name: str, line: str) -> None:
        """Write a line to a process's standard input.

        Raises:
            BenchmarkError: it has ended.
        """
        pipe = self._running[name].stdin
        assert pipe is not None  # noqa: S101 - spawned with one
        try:
            pipe.write(f"{line}\n".encode())
            pipe.flush()
        except OSError:
            raise BenchmarkError(f"{name} ended: {self.output(name)}") from None

    def output(self, name: str) -> str:
        """Everything that a process printed."""
        return (self.folder / f"{name}.log").read_text(encoding="utf-8", errors="replace")

    def await_output(self, name: str, word: str) -> None:
        """Until a process has printed a word.

        Raises:
            BenchmarkError: it does not; it ended, or another process failed.
        """
        until = time.monotonic() + _START_S
        while word not in self.output(name):
            ended = [
                other
                for other, process in self._running.items()
                if process.poll() not in ((None,) if other == name else (None, 0))
            ]
            if word in self.output(name):  # its last one
                return
            if ended:
                raise BenchmarkError(f"{ended[0]} ended too early: {self.output(ended[0])}")
            if time.monotonic() > until:
                raise BenchmarkError(f"no '{word}' of {name} within {_START_S:g} s: {self.output(name)}")
            time.sleep(0.1)

    def kill(self, name: str) -> None:
        """End a process at once, as a crash does."""
        process = self._running.pop(name)
        process.kill()
        process.wait()

    def end(self, name: str) -> None:
        """Ask a process to end, as Ctrl-C does.

        Raises:
            BenchmarkError: it does not.
        """
        process = self._running.pop(name)
        process.send_signal(signal.SIGINT)
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            raise BenchmarkError(f"{name} did not end within {_END_S:g} s of SIGINT") from None
