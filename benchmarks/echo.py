"""What it costs a component that its value is read, and an executor that it is watched."""

import os
import signal
import sys
import time
from collections.abc import Iterator

import native
import numpy as np
from busy_executor import ARCHITECTURE
from executor_process import ExecutorProcess
from processes import Processes
from recording_kept import cpu_s
from rows import Row, alone, compared
from settings import Settings
from wakeup_executor import latencies_ns

from mauve_rt.trace.reading.reader import open_trace

_RATE_HZ = 100
_SETTLE_S = 0.2
_RATIO_LIMIT = 1.2
_WATCH_S = 3.0
_CPU_LIMIT = 2.0
_IN_A_TERMINAL = "import pty, sys; pty.spawn(sys.argv[1:])"


def echo_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of a 1 kHz component: its value polled, the value of another executor polled, and none.

    A poll is work for two processes, which takes caches and a CPU from a component, whomever they look at.
    """
    what = "wake-up latency of a 1 kHz component, its value read 100 times a second"
    with Processes() as processes:
        bag = processes.folder / "bag"
        executor = ExecutorProcess(processes, ARCHITECTURE, f"bag:={bag}")
        slow = ("metronome.period_us:=100000", "metronome.ticks_per_beat:=1")  # its component disturbs less
        other = ExecutorProcess(processes, ARCHITECTURE, *slow, name="other")
        echoes = {}
        for each in (executor, other):
            each.wait()
            words = ("-m", "mauve_rt.cli", "echo", f"{each.namespace}/executor", "beat", "--csv")
            name = f"echo_of{each.namespace.replace('/', '_')}"
            echoes[each] = processes.spawn(name, *words, "--rate", str(_RATE_HZ))
            processes.await_output(name, "writes")

        def window(*stopped: int) -> tuple[int, int]:
            for pid in stopped:
                os.kill(pid, signal.SIGSTOP)
            time.sleep(_SETTLE_S)
            begin_ns = time.monotonic_ns()
            time.sleep(settings.wakeup_s)
            end_ns = time.monotonic_ns()
            for pid in stopped:
                os.kill(pid, signal.SIGCONT)
            return begin_ns, end_ns

        rounds = native.interleaved(
            settings.rounds,
            lambda _: window(echoes[other]),
            lambda _: window(echoes[executor]),
            lambda _: window(*echoes.values()),
        )
        executor.end()
        trace = open_trace(bag)
    for percentile in (50, 99):

        def latency_us(window: tuple[int, int], share: int = percentile) -> float:
            return float(np.percentile(latencies_ns(trace, *window), share)) / 1e3

        told = [[latency_us(each) for each in windows] for windows in rounds]
        yield compared(
            f"{what}, p{percentile}",
            [(read, elsewhere) for read, elsewhere, _ in told],
            unit="us",
            beside="another executor's value is read",
            ratio_limit=_RATIO_LIMIT,
        )
        yield compared(
            f"{what}, against an idle machine, p{percentile}",
            [(read, idle) for read, _, idle in told],
            unit="us",
            beside="no reader",
        )


def watch_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of an executor that `mauve watch` shows in a terminal, and of the same executor alone."""
    with Processes() as processes:
        executor = ExecutorProcess(processes, ARCHITECTURE)
        executor.wait()

        def percent() -> float:
            before_s, began_s = cpu_s(executor.pid), time.monotonic()
            time.sleep(_WATCH_S)
            return 100 * (cpu_s(executor.pid) - before_s) / (time.monotonic() - began_s)

        def watched(number: int) -> float:
            words = ("-m", "mauve_rt.cli", "watch", f"{executor.namespace}/executor", "--value", "beat")
            name = f"watch_{number}"
            processes.spawn(name, "-c", _IN_A_TERMINAL, sys.executable, *words, TERM="xterm")
            processes.await_output(name, "RUNNING")
            cost = percent()
            processes.kill(name)
            return cost

        rounds = native.interleaved(settings.rounds, watched, lambda _: percent())
        executor.end()
    yield alone(
        "CPU that watching an executor costs it",
        [of_watched - of_alone for of_watched, of_alone in rounds],
        unit="%",
        limit=_CPU_LIMIT,
        note=f"of one CPU; the executor alone takes {np.median([pair[1] for pair in rounds]):.1f} %",
    )
