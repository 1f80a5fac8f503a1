"""Replacing a core, stopping, starting, deploying: rows from the C++ programs beside this file."""

import os
from collections.abc import Iterator
from typing import Any

import native
from ratios import percentile
from rows import Row, compared, exactly_zero, not_available
from settings import Settings

Rounds = list[list[dict[str, Any]]]
_NS_PER_US = 1000


def swap_rows(settings: Settings) -> Iterator[Row]:
    """Replace the core of a running component, again and again."""
    rounds = _both("bench_swap", settings, count=settings.swaps, cpu=settings.cpu)
    what = "replace core of a running 1 kHz component with 100 us of work"
    beside = "hot-standby handover of two threads"
    components = [component for component, _ in rounds]
    releases = sum(found["releases"] for found in components)
    stalled = sum(found["missed_in_stalls"] for found in components)
    note = f"{settings.rounds * settings.swaps} replacements; {stalled} of {releases} releases were missed "
    note += "inside stalls of the machine that a witness marked"
    yield compared(
        f"{what}, blackout p50", _pairs(rounds, "blackout_ns", 50), unit="us", beside=beside, ratio_limit=1.5
    )
    yield compared(
        f"{what}, blackout p99", _pairs(rounds, "blackout_ns", 99), unit="us", beside=beside, limit=1000
    )
    yield exactly_zero(f"{what}, releases missed", [found["missed"] for found in components], note=note)
    phases = [found["worst_nominal_phase_ns"] for found in components]
    yield exactly_zero(f"{what}, nominal phase error", phases, unit="ns")


def stop_rows(settings: Settings) -> Iterator[Row]:
    """Stop a component that is asleep, then one that is not."""
    for wait_ms in (500, 5000):
        rounds = _both("bench_stop", settings, count=settings.stops, cpu=settings.cpu, wait_ms=wait_ms)
        for percent, limit_us in ((50, 50), (99, 200)):
            what = f"stop while asleep, {wait_ms / 1000:g} s period, p{percent}"
            pairs = _pairs(rounds, "durations_ns", percent)
            yield compared(what, pairs, unit="us", beside="futex wake-to-run of a thread", limit=limit_us)
    rounds = _both("bench_stop_busy", settings, count=settings.busy_stops, cpu=settings.cpu)
    left_ms = percentile([left for component, _ in rounds for left in component["left_ns"]], 50) / 1e6
    note = f"over what was left of the execution, {left_ms:.4g} ms when it was asked"
    for percent in (50, 99):
        yield compared(
            f"stop in mid-execution, 20 ms left, 5 s period, over the 20 ms, p{percent}",
            _pairs(rounds, "late_ns", percent),
            unit="us",
            beside="a thread that ends its work and wakes who waits",
            limit=100,
            note=note,
        )


def deployment_rows(settings: Settings) -> Iterator[Row]:
    """Deploy components together."""
    for cpus in (1, 2):
        place = "one CPU" if cpus == 1 else "two CPUs"
        what = f"spread of the first releases of 8 x 1 kHz components on {place}"
        if cpus > len(os.sched_getaffinity(0)):
            yield not_available(what, "this machine has one CPU")
            continue
        rounds = _both("bench_deployment", settings, count=settings.deployments, cpus=cpus)
        pairs = _pairs(rounds, "spreads_ns", 50)
        beside = "threads with a barrier and a shared epoch"
        yield compared(what, pairs, unit="us", beside=beside, ratio_limit=1.25)


def restart_rows(settings: Settings) -> Iterator[Row]:
    """Stop and start at random instants."""
    found = [
        native.run(
            "bench_restart",
            seed=number,
            count=settings.restarts,
            priority=settings.priority,
            cpu=settings.cpu,
        )
        for number in range(settings.rounds)
    ]
    worst = [max(map(abs, one["nominal_phase_ns"])) for one in found]
    starts = sum(len(one["nominal_phase_ns"]) for one in found)
    actual = percentile([phase for one in found for phase in one["actual_phase_ns"]], 50)
    late_us = actual / _NS_PER_US
    asked = settings.rounds * settings.restarts
    note = f"{starts} of them came to a release, the actual one {late_us:.3g} us after the nominal (p50)"
    what = f"phase error after {asked} random stop/start, nominal, worst"
    yield exactly_zero(what, worst, unit="ns", note=note)


def _both(program: str, settings: Settings, **options: int) -> Rounds:
    return native.both(program, settings.rounds, priority=settings.priority, **options)


def _pairs(rounds: Rounds, name: str, percent: float) -> list[tuple[float, float]]:
    """(component, bare) of each round, in us."""
    return [
        (percentile(component[name], percent) / _NS_PER_US, percentile(bare[name], percent) / _NS_PER_US)
        for component, bare in rounds
    ]
