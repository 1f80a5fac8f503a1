"""How soon after a signal an executor's outputs are safe."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import native
import rclpy
from busy_executor import ARCHITECTURE
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rows import Row, alone, compared
from settings import Settings
from std_msgs.msg import Float64

_LIMIT_US = 5000.0  # and the longest state that runs: here it lasts microseconds
_DISCOVERY_S = 20.0
_SAFE_S = 5.0
_BEATS = 5  # at 10 Hz


def safe_stop_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of a 1 kHz component's executor that is signalled: busy with requests, and idle."""
    rounds = native.interleaved(
        settings.rounds, lambda _: _signal_once(requests=True), lambda _: _signal_once(requests=False)
    )
    what = "SIGTERM to safe outputs of a 1 kHz component"
    yield alone(what, [idle for _, idle in rounds], unit="us", limit=_LIMIT_US)
    yield compared(
        f"{what}, while requests keep the interpreter busy",
        rounds,
        unit="us",
        beside="the same alone",
        limit=_LIMIT_US,
    )


def _signal_once(*, requests: bool) -> float:
    """Microseconds from the signal until the type's zero is sent, by its source time stamp."""
    with ExitStack() as stack:
        processes = stack.enter_context(Processes())
        executor = ExecutorProcess(processes, ARCHITECTURE)
        beats = stack.enter_context(_Beats(f"{executor.namespace}/beat"))
        beats.await_some()
        if requests:
            program = str(Path(__file__).with_name("rclpy_load.py"))
            processes.spawn("load", program, f"{executor.namespace}/executor", f"{executor.namespace}/beat")
            processes.await_output("load", "busy")
        signalled_ns = time.time_ns()
        os.kill(executor.pid, signal.SIGTERM)
        return (beats.await_zero() - signalled_ns) / 1e3


class _Beats:
    """A context: hears a topic, with source time stamps."""

    def __init__(self, topic: str) -> None:
        self._context = Context()
        rclpy.init(context=self._context, args=[])
        self._node = rclpy.create_node("bench_beats", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._heard: list[tuple[float, int]] = []
        self._node.create_subscription(Float64, topic, self._hear, 1000)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown(timeout_sec=0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def _hear(self, message: Any, info: Any) -> None:
        self._heard.append((message.data, info["source_timestamp"]))

    def await_some(self) -> None:
        """Until it beats.

        Raises:
            BenchmarkError: it does not.
        """
        self._spin_until(lambda: len(self._heard) >= _BEATS, _DISCOVERY_S, "no beats")

    def await_zero(self) -> int:
        """When the zero of its stop was sent, ns since 1970.

        Raises:
            BenchmarkError: it was not.
        """
        self._spin_until(lambda: self._heard[-1][0] == 0.0, _SAFE_S, "no safe output")
        return self._heard[-1][1]

    def _spin_until(self, condition: Any, patience_s: float, otherwise: str) -> None:
        until = time.monotonic() + patience_s
        while not condition():
            if time.monotonic() > until:
                raise BenchmarkError(f"{otherwise} within {patience_s:g} s")
            self._executor.spin_once(timeout_sec=0.1)
