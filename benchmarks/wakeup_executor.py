"""Wake-up latency of a 1 kHz component in an executor process that ROS keeps busy."""

import time
from collections.abc import Iterator

import cyclictest
import native
import numpy as np
from busy_executor import COMPONENT, BusyExecutor
from rows import Row
from settings import Settings
from wakeup import bare_latencies_ns, percentile_rows

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.trace import Trace

_SETTLE_S = 0.02  # left out on both sides: caches are cold


def executor_wakeup_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of component, bare loop and cyclictest, while the executor is busy in all three.

    The component is stopped through its service while the others run: they have its priority for themselves.
    """
    what = "wake-up latency of a 1 kHz component in the executor, rclpy busy"
    no_cyclictest = cyclictest.available()
    with BusyExecutor() as executor:
        place = {"priority": executor.priority, "cpu": executor.cpu}
        executor.stop()

        def component(_: int) -> tuple[int, int]:
            executor.start()
            time.sleep(_SETTLE_S)
            begin_ns = time.monotonic_ns()
            time.sleep(settings.wakeup_s)
            end_ns = time.monotonic_ns()
            executor.stop()
            return begin_ns, end_ns

        def bare(_: int) -> list[float]:
            return bare_latencies_ns(**place, duration_s=settings.wakeup_s)

        def cyclic(_: int) -> list[float]:
            return cyclictest.latencies_ns(**place, duration_s=settings.wakeup_s)

        measures = [component, bare] if no_cyclictest else [component, bare, cyclic]
        rounds = native.interleaved(settings.rounds, *measures)
        trace = executor.finish()
        note = executor.load_report
    lost = trace.losses[COMPONENT].lost
    note += f"; {lost} trace records were lost" if lost else ""
    samples = [[latencies_ns(trace, *found[0]), *found[1:]] for found in rounds]
    yield from percentile_rows(what, samples, no_cyclictest=no_cyclictest, note=note)


def latencies_ns(trace: Trace, begin_ns: int, end_ns: int) -> list[float]:
    """Actual minus nominal instant of the releases in a window."""
    releases = trace.of(COMPONENT, Kind.RELEASE)
    chosen = releases[(releases["a"] >= begin_ns) & (releases["a"] < end_ns)]
    latencies: list[float] = np.asarray(chosen["b"] - chosen["a"], np.float64).tolist()
    return latencies
