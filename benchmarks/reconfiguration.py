"""Replacing a core, stopping, starting, deploying: rows from the C++ programs beside this file."""

import os
from collections.abc import Iterator
from typing import Any

import native
from ratios import percentile
from rows import Row, compared, exactly_zero, not_available, pooled
from settings import Settings

Rounds = list[list[dict[str, Any]]]
_NS_PER_US = 1000
_BESIDE_SWAP = "hot-standby handover of two threads"


def swap_rows(settings: Settings) -> Iterator[Row]:
    """Replace the core, then the fsm, of a running component, again and again, as services do it."""
    what = "replace core of a running 1 kHz component with 100 us of work"
    rounds = _both("bench_swap", settings, count=settings.swaps, cpu=settings.cpu)
    yield from _blackout_rows(what, rounds, p50_ratio=1.5, p99_us=1000)
    components = [component for component, _ in rounds]
    yield _missed(what, components, settings)
    phases = [found["worst_nominal_phase_ns"] for found in components]
    yield exactly_zero(f"{what}, nominal phase error", phases, unit="ns")

    cpus = len(os.sched_getaffinity(0))
    busy = _both("bench_swap", settings, count=settings.swaps, cpu=settings.cpu, busy_cpus=cpus)
    yield from _blackout_rows(f"{what}, an ordinary thread busy on each CPU", busy)

    what = "replace fsm of a running 1 kHz component by one on the same grid"
    place = {"count": settings.swaps, "priority": settings.priority, "cpu": settings.cpu}
    fsms = [native.run("bench_swap", part="fsm", seed=number, **place) for number in range(settings.rounds)]
    yield _missed(what, fsms, settings)


def _blackout_rows(
    what: str, rounds: Rounds, *, p50_ratio: float | None = None, p99_us: float | None = None
) -> Iterator[Row]:
    for percent, ratio_limit, limit in ((50, p50_ratio, None), (99, None, p99_us)):
        yield compared(
            f"{what}, blackout p{percent}",
            _pairs(rounds, "blackout_ns", percent),
            unit="us",
            beside=_BESIDE_SWAP,
            ratio_limit=ratio_limit,
            limit=limit,
        )
    blackouts, handovers = (
        [ns / _NS_PER_US for one in rounds for ns in one[side]["blackout_ns"]] for side in (0, 1)
    )
    name = f"{what}, blackout p99.9"
    yield pooled(name, blackouts, 99.9, unit="us", reference=handovers, beside=_BESIDE_SWAP)


def _missed(what: str, found: list[dict[str, Any]], settings: Settings) -> Row:
    releases, stalled, reported = (
        sum(one[name] for one in found) for name in ("releases", "missed_in_stalls", "reported_missed")
    )
    note = f"{settings.rounds * settings.swaps} replacements; {stalled} of {releases} releases were missed "
    note += f"inside stalls of the machine that a witness marked; the reports told of {reported}"
    return exactly_zero(f"{what}, releases missed", [one["missed"] for one in found], note=note)


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


def stop_beside_rows(settings: Settings) -> Iterator[Row]:
    """Stop a component while somebody else's change of it waits, or is prepared."""

    def measure(beside: str) -> native.Measure:
        return lambda _: native.run(
            "bench_stop_beside",
            beside=beside,
            count=settings.busy_stops,
            priority=settings.priority,
            cpu=settings.cpu,
        )

    whats = {
        "commit": "a transaction over it waits for a component in a 100 ms state",
        "preparation": "a new core for it takes 100 ms to prepare",
    }
    rounds = native.interleaved(settings.rounds, measure("nothing"), *map(measure, whats))
    for place, what in enumerate(whats.values(), start=1):
        for percent, limit in ((50, 2), (99, None)):
            pairs = [
                (
                    percentile(found[place]["durations_ns"], percent),
                    percentile(found[0]["durations_ns"], percent),
                )
                for found in rounds
            ]
            yield compared(
                f"stop of a 1 kHz component while {what}, p{percent}",
                [(measured / _NS_PER_US, alone_us / _NS_PER_US) for measured, alone_us in pairs],
                unit="us",
                beside="the same stop, nothing else going on",
                ratio_limit=limit,
            )


def prefault_rows(settings: Settings) -> Iterator[Row]:
    """Replace a core by one that owns memory nobody has touched yet."""
    found = [
        native.run("bench_prefault", priority=settings.priority, cpu=settings.cpu)
        for _ in range(settings.rounds)
    ]
    worst = [max(one["faults"]) for one in found]
    what = "page faults of a component's thread after its core was replaced by one with 8 MiB"
    yield exactly_zero(what, worst)


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
