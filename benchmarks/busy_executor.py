"""A real executor process of the tutorial's architecture, kept busy through ROS by a process of its own."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from native import ROOT, BenchmarkError

from mauve_msgs.srv import Start, Stop
from mauve_rt.cli.client import Client, connected
from mauve_rt.errors import MauveError
from mauve_rt.model import load_architecture
from mauve_rt.trace.reader import read_bag
from mauve_rt.trace.trace import Trace

COMPONENT = "metronome"
_ARCHITECTURE = ROOT / "mauve_examples" / "architecture" / "metronome.yaml"
_START_S = 30.0
_END_S = 10.0


class BusyExecutor:
    """A context: inside it, the executor runs and is being asked.

    Raises:
        BenchmarkError: executor or load did not start.
    """

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._component = load_architecture(_ARCHITECTURE).components[COMPONENT]
        self._namespace = f"/bench_{os.getpid()}"
        self.load_report = ""

    def __enter__(self) -> Self:
        # A domain of our own where none is set: other nodes' traffic is no part of the measurement.
        os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
        with ExitStack() as stack:
            self._folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="mauve_bench_")))
            self._executor = self._spawn(
                stack,
                "executor",
                [
                    *("-m", "mauve_rt.node.executor", "--ros-args", "-r", f"__ns:={self._namespace}"),
                    *("-p", f"architecture:={_ARCHITECTURE}", "-p", f"bag:={self._folder / 'bag'}"),
                ],
            )
            self._client: Client = stack.enter_context(connected())
            program = str(Path(__file__).with_name("rclpy_load.py"))
            self._load = self._spawn(
                stack, "load", [program, f"{self._namespace}/executor", f"{self._namespace}/beat"]
            )
            self._await_load()
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stack.__exit__(kind, error, traceback)

    @property
    def priority(self) -> int:
        """The component's."""
        return self._component.priority

    @property
    def cpu(self) -> int:
        """The component's."""
        return (self._component.cpus or [0])[0]

    def start(self) -> None:
        """Start the component."""
        self._ask(Start, "start", Start.Request(component=COMPONENT))

    def stop(self) -> None:
        """Stop the component; executor and load go on."""
        self._ask(Stop, "stop", Stop.Request(component=COMPONENT))

    def finish(self) -> Trace:
        """End both processes and read the bag.

        Raises:
            BenchmarkError: a process does not end.
        """
        end(self._load)
        self.load_report = self._output("load").strip().splitlines()[-1]
        end(self._executor)
        return read_bag(self._folder / "bag")

    def _ask(self, service_type: type, name: str, request: object) -> None:
        try:
            reply = self._client.call(service_type, f"{self._namespace}/executor/{name}", request)
        except MauveError as error:
            raise BenchmarkError(f"executor: {error}; {self._output('executor')}") from None
        if not reply.success:
            raise BenchmarkError(f"executor: {name} refused: {reply.message}")

    def _spawn(self, stack: ExitStack, name: str, words: list[str]) -> "subprocess.Popen[bytes]":
        log = stack.enter_context((self._folder / f"{name}.log").open("wb"))
        process = subprocess.Popen([sys.executable, "-P", *words], stdout=log, stderr=log)
        stack.callback(process.wait)
        stack.callback(process.kill)  # first: unless it ended well by then
        return process

    def _await_load(self) -> None:
        until = time.monotonic() + _START_S
        while "busy" not in self._output("load"):
            for name, process in (("executor", self._executor), ("load", self._load)):
                if process.poll() is not None:
                    raise BenchmarkError(f"{name} ended at its start: {self._output(name)}")
            if time.monotonic() > until:
                raise BenchmarkError(f"no executor within {_START_S:g} s: {self._output('executor')}")
            time.sleep(0.1)

    def _output(self, name: str) -> str:
        return (self._folder / f"{name}.log").read_text(encoding="utf-8", errors="replace")


def end(process: "subprocess.Popen[bytes]") -> None:
    """Ask a process to end, as Ctrl-C does.

    Raises:
        BenchmarkError: it does not.
    """
    process.send_signal(signal.SIGINT)
    try:
        process.wait(_END_S)
    except subprocess.TimeoutExpired:
        raise BenchmarkError(f"process {process.pid} did not end within {_END_S:g} s of SIGINT") from None
