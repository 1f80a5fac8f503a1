"""Wake-up latency of a 1 kHz component, idle and under stress, beside a bare loop and cyclictest."""

from collections.abc import Iterator
from contextlib import nullcontext

import cyclictest
import native
import stress
from ratios import percentile
from rows import Row, compared, not_available, pooled
from settings import Settings

_NS_PER_US = 1000
_SETTLE_MS = 20  # left out on both sides: caches are cold
_LIMITS = ((50, 1.1), (99, 1.2))


def wakeup_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of component, bare loop and cyclictest, each alone on its CPU."""
    yield from _rows("wake-up latency of a 1 kHz component, machine idle", settings)
    what = "wake-up latency of a 1 kHz component, stress-ng"
    missing = stress.available()
    if missing:
        yield not_available(what, missing)
    else:
        yield from _rows(what, settings, under_stress=True)


def percentile_rows(
    what: str, rounds: list[list[list[float]]], *, no_cyclictest: str, note: str = ""
) -> Iterator[Row]:
    """Rows of rounds of [component, bare loop, cyclictest if there is one], latencies in nanoseconds."""
    for percent, limit in _LIMITS:
        beside = "bare clock_nanosleep loop"
        pairs = _pairs(rounds, percent, 1)
        yield compared(f"{what}, p{percent}", pairs, unit="us", beside=beside, ratio_limit=limit, note=note)
    component, bare = ([ns / _NS_PER_US for one in rounds for ns in one[side]] for side in (0, 1))
    yield pooled(
        f"{what}, p99.9", component, 99.9, unit="us", reference=bare, beside="bare clock_nanosleep loop"
    )
    for percent, _ in _LIMITS:
        row = f"{what}, p{percent}, against cyclictest"
        if no_cyclictest:
            yield not_available(row, no_cyclictest)
        else:
            yield compared(row, _pairs(rounds, percent, 2), unit="us", beside="cyclictest", note=note)


def bare_latencies_ns(*, priority: int, cpu: int, duration_s: float) -> list[float]:
    """Of the bare loop."""
    return _native("bare", priority=priority, cpu=cpu, duration_s=duration_s)


def _rows(what: str, settings: Settings, *, under_stress: bool = False) -> Iterator[Row]:
    place = {"priority": settings.priority, "cpu": settings.cpu}
    no_cyclictest = cyclictest.available()
    measures = [
        lambda _: _native("component", **place, duration_s=settings.wakeup_s),
        lambda _: _native("bare", **place, duration_s=settings.wakeup_s),
    ]
    if not no_cyclictest:
        measures.append(lambda _: cyclictest.latencies_ns(**place, duration_s=settings.wakeup_s))
    with stress.stressed() if under_stress else nullcontext():
        rounds = native.interleaved(settings.rounds, *measures)
    note = stress.DESCRIPTION if under_stress else ""
    yield from percentile_rows(what, rounds, no_cyclictest=no_cyclictest, note=note)


def _native(who: str, *, priority: int, cpu: int, duration_s: float) -> list[float]:
    duration_ms = round(duration_s * 1000) + _SETTLE_MS
    found = native.run("bench_wakeup", who=who, priority=priority, cpu=cpu, duration_ms=duration_ms)
    latencies: list[float] = found["latencies_ns"][_SETTLE_MS:]
    return latencies


def _pairs(rounds: list[list[list[float]]], percent: float, other: int) -> list[tuple[float, float]]:
    """(component, other) of each round, in us."""
    return [
        (percentile(found[0], percent) / _NS_PER_US, percentile(found[other], percent) / _NS_PER_US)
        for found in rounds
    ]
