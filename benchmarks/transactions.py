"""Transactions: what they cost those they touch, and that nobody else notices, for thousands of them."""

import os
from collections.abc import Iterator
from typing import Any

import native
from ratios import percentile
from rows import Row, alone, compared, exactly_zero, never_over, pooled
from settings import Settings

_KIB = 1024
_OF_ONE = 1.5
"""No component waits for another one: five cost the one with the longest blackout little more than one."""
_FLAT_KIB = 64
"""What the heap may grow by in nine tenths of a soak: a leak of some bytes a transaction makes more of it."""


def transaction_rows(settings: Settings) -> Iterator[Row]:
    """Five running components: three get another core, two another resource."""
    rounds = [
        native.run(
            "bench_transaction",
            seed=number,
            count=settings.transactions,
            priority=settings.priority,
            cpus=_cpus(),
        )
        for number in range(settings.rounds)
    ]
    what = "transaction over 5 running 1 kHz components, rewiring two"
    for percent, limit in ((50, None), (99, 200)):
        values = [percentile(found["blackout_ns"], percent) / 1000 for found in rounds]
        yield alone(f"{what}, longest blackout p{percent}", values, unit="us", limit=limit)
    pairs = [
        (percentile(found["blackout_ns"], 50) / 1000, percentile(found["blackout_of_one_ns"], 50) / 1000)
        for found in rounds
    ]
    one = "a transaction that replaces one core"
    yield compared(f"{what}, longest blackout", pairs, unit="us", beside=one, ratio_limit=_OF_ONE)
    blackouts = [ns / 1000 for found in rounds for ns in found["blackout_ns"]]
    yield pooled(f"{what}, longest blackout p99.9", blackouts, 99.9, unit="us")
    for whose in ("untouched", "touched"):
        missed = [found[f"{whose}_missed"] for found in rounds]
        note = _stalls(rounds, whose)
        yield exactly_zero(f"{what}, releases missed by {whose} components", missed, note=note)


def refused_rows(settings: Settings) -> Iterator[Row]:
    """Ask for what cannot be made in time."""
    found = [
        native.run("bench_refused", priority=settings.priority, cpu=settings.cpu)
        for _ in range(settings.rounds)
    ]
    refused, releases, stalled = (
        sum(one[name] for one in found) for name in ("refused", "releases", "missed_in_stalls")
    )
    note = f"{refused} were refused after 60 ms; {stalled} of {releases} releases were missed inside stalls "
    note += "of the machine that a witness marked"
    what = "transactions over a 1 kHz component and one in a 150 ms state: releases that the 1 kHz one missed"
    yield exactly_zero(what, [one["missed"] for one in found], note=note)


def soak_rows(settings: Settings) -> Iterator[Row]:
    """Random transactions against a model of them."""
    found = native.run("bench_soak", count=settings.soak, cpus=_cpus(), timeout_s=1800)
    total = found["made"] + found["refused"]
    what = f"{total} random transactions over 8 x 1 kHz and 50 x 100 Hz"
    note = f"{found['made']} came into force, {found['refused']} were refused as they should"
    yield exactly_zero(f"{what}: architectures other than described", [found["differences"]], note=note)
    note = f"of {found['releases']} by components that the transaction at the time did not touch; "
    note += f"{found['missed_in_stalls']} more inside stalls of the machine that a witness marked"
    yield exactly_zero(f"{what}: releases missed", [found["missed"]], note=note)
    heap, resident = found["heap_bytes"], found["resident_bytes"]
    note = "from the end of the first tenth to that of the last; resident memory "
    note += f"{(resident[-1] - resident[0]) / _KIB:+.0f} KiB"
    growth = [(heap[-1] - heap[0]) / _KIB]
    yield never_over(f"{what}: growth of the heap", growth, limit=_FLAT_KIB, unit="KiB", note=note)


def _stalls(rounds: list[dict[str, Any]], whose: str) -> str:
    releases = sum(found[f"{whose}_releases"] for found in rounds)
    stalled = sum(found[f"{whose}_missed_in_stalls"] for found in rounds)
    return f"{stalled} of {releases} releases were missed inside stalls of the machine that a witness marked"


def _cpus() -> int:
    return min(2, len(os.sched_getaffinity(0)))
