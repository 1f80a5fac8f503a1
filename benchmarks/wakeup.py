"""Wake-up latency of a 1 kHz component in the executor process, beside a bare loop and cyclictest."""

import time
from collections.abc import Iterator

import cyclictest
import native
import numpy as np
from busy_executor import COMPONENT, BusyExecutor
from ratios import percentile
from rows import Row, compared, not_available
from settings import Settings

from mauve_rt.trace.records import Kind
from mauve_rt.trace.trace import Trace

_NS_PER_US = 1000
_SETTLE_S = 0.02  # left out on both sides: caches are cold


def wakeup_rows(settings: Settings) -> Iterator[Row]:
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
            duration_ms = round((_SETTLE_S + settings.wakeup_s) * 1000)
            found = native.run("bench_wakeup", **place, duration_ms=duration_ms)
            latencies: list[float] = found["latencies_ns"][round(_SETTLE_S * 1000) :]
            return latencies

        def cyclic(_: int) -> list[float]:
            return cyclictest.latencies_ns(**place, duration_s=settings.wakeup_s)

        measures = [component, bare] if no_cyclictest else [component, bare, cyclic]
        rounds = native.interleaved(settings.rounds, *measures)
        trace = executor.finish()
        note = executor.load_report
    lost = trace.losses[COMPONENT].lost
    note += f"; {lost} trace records were lost" if lost else ""
    samples = [[_latencies_ns(trace, *found[0]), *found[1:]] for found in rounds]
    for percent, limit in ((50, 1.1), (99, 1.2)):
        pairs = _pairs(samples, percent, 1)
        beside = "bare clock_nanosleep loop"
        yield compared(f"{what}, p{percent}", pairs, unit="us", beside=beside, ratio_limit=limit, note=note)
    for percent in (50, 99):
        row = f"{what}, p{percent}, against cyclictest"
        if no_cyclictest:
            yield not_available(row, no_cyclictest)
        else:
            yield compared(row, _pairs(samples, percent, 2), unit="us", beside="cyclictest", note=note)


def _latencies_ns(trace: Trace, begin_ns: int, end_ns: int) -> list[float]:
    """Actual minus nominal instant of the releases in a window."""
    releases = trace.of(COMPONENT, Kind.RELEASE)
    chosen = releases[(releases["a"] >= begin_ns) & (releases["a"] < end_ns)]
    latencies: list[float] = np.asarray(chosen["b"] - chosen["a"], np.float64).tolist()
    return latencies


def _pairs(samples: list[list[list[float]]], percent: float, other: int) -> list[tuple[float, float]]:
    """(component, other) of each round, in us."""
    return [
        (percentile(found[0], percent) / _NS_PER_US, percentile(found[other], percent) / _NS_PER_US)
        for found in samples
    ]
