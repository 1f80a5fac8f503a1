"""What it costs a component that somebody looks at its value: nothing that is larger than chance."""

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager

import native
import numpy as np
from busy_executor import ARCHITECTURE
from executor_process import ExecutorProcess
from processes import Processes
from rows import Row, compared
from settings import Settings
from wakeup_executor import latencies_ns

from mauve_rt.trace.reading.reader import open_trace

_RATE_HZ = 100
_SETTLE_S = 0.2
_RATIO_LIMIT = 1.2


def echo_rows(settings: Settings) -> Iterator[Row]:
    """Rounds with `mauve echo` polling a value that a 1 kHz component's fsm writes, and without."""
    what = "wake-up latency of a 1 kHz component, its value read 100 times a second"
    with Processes() as processes:
        bag = processes.folder / "bag"
        executor = ExecutorProcess(processes, ARCHITECTURE, f"bag:={bag}")
        executor.wait()
        words = ("-m", "mauve_rt.cli", "echo", f"{executor.namespace}/executor", "beat", "--csv")
        echo = processes.spawn("echo", *words, "--rate", str(_RATE_HZ))
        processes.await_output("echo", "writes")

        def window() -> tuple[int, int]:
            time.sleep(_SETTLE_S)
            begin_ns = time.monotonic_ns()
            time.sleep(settings.wakeup_s)
            return begin_ns, time.monotonic_ns()

        def alone(_: int) -> tuple[int, int]:
            with _stopped(echo):
                return window()

        rounds = native.interleaved(settings.rounds, lambda _: window(), alone)
        processes.end("echo")
        executor.end()
        trace = open_trace(bag)
    for percentile in (50, 99):
        pairs = [
            tuple(float(np.percentile(latencies_ns(trace, *each), percentile)) / 1e3 for each in pair)
            for pair in rounds
        ]
        yield compared(
            f"{what}, p{percentile}", pairs, unit="us", beside="nobody reads it", ratio_limit=_RATIO_LIMIT
        )


@contextmanager
def _stopped(pid: int) -> Iterator[None]:
    """A process that does nothing meanwhile."""
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(pid, signal.SIGCONT)
