"""What takes nanoseconds: data, activations, trace records; and what a lock costs who is urgent."""

import os
from collections.abc import Iterator, Sequence
from typing import Any

import native
from ratios import percentile
from rows import Row, alone, compared, exactly_zero, not_available
from settings import Settings

_PS_PER_NS = 1000
_PACE_NS = 1000


def shared_data_rows(settings: Settings) -> Iterator[Row]:
    """Write and read SharedData, nobody else about."""
    rounds = _rounds("bench_shared_data", settings)
    for size in ("16", "4096"):
        for verb in ("write", "read"):
            yield compared(
                f"SharedData {verb}, {size} B, alone",
                _block_pairs(rounds, f"{verb}_{size}", f"bare_{verb}_{size}"),
                unit="ns",
                beside="PI mutex lock + unlock + copy",
                ratio_limit=1.3,
            )


def latest_value_rows(settings: Settings) -> Iterator[Row]:
    """Read a LatestValue, nobody else about and while a thread writes to it."""
    what = "LatestValue read, 16 B"
    cpus = sorted(os.sched_getaffinity(0) - {settings.cpu})
    rounds = _rounds("bench_latest_value", settings, writer_cpu=cpus[0] if cpus else -1)
    pairs = _block_pairs(rounds, "alone", "seqlock_alone")
    yield compared(f"{what}, alone", pairs, unit="ns", beside="seqlock", ratio_limit=1.5)
    hammered = f"{what}, against a hammering writer"
    if not cpus:
        yield not_available(hammered, "this machine has one CPU")
        return
    sums = {name: sum(found[name] for found in rounds) for name in rounds[0] if not name.endswith("_ps")}
    note = f"writes a read: {sums['writes'] / sums['reads']:.2g} to the LatestValue, "
    note += f"{sums['seqlock_writes'] / sums['reads']:.2g} to the seqlock, "
    note += f"whose readers tried {1 + sums['seqlock_retries'] / sums['reads']:.3g} times"
    pairs = _block_pairs(rounds, "hammered", "seqlock_hammered")
    yield compared(hammered, pairs, unit="ns", beside="seqlock", ratio_limit=1.5, note=note)
    rounds += _rounds("bench_latest_value", settings, writer_cpu=cpus[0], pace_ns=_PACE_NS)
    pairs = _block_pairs(rounds[settings.rounds :], "hammered", "seqlock_hammered")
    paced = f"{what}, against a writer that writes every {_PACE_NS} ns"
    yield compared(paced, pairs, unit="ns", beside="seqlock", ratio_limit=1.5)
    bad = [found["failed"] + found["torn"] for found in rounds]
    note = f"of {sum(found['reads'] for found in rounds)} reads against either writer"
    yield exactly_zero(f"{what}: reads that failed or found halves of two values", bad, note=note)


def activation_rows(settings: Settings) -> Iterator[Row]:
    """Resume a state machine of two states, on no thread."""
    rounds = _rounds("bench_activation", settings)
    note = "Task::resume() from the end of a wait to the entry of the next, without the futex call: "
    note += "commands, two readings of the clock, statistics, the call of an empty state, 4 trace records"
    for name, limit in (("traced", 300), ("untraced", None)):
        values = [percentile(found[f"{name}_ps"], 50) / _PS_PER_NS for found in rounds]
        what = f"one activation of a two-state FSM, kernel work only, {name}"
        yield alone(what, values, unit="ns", limit=limit, note=note if limit else "")


def trace_rows(settings: Settings) -> Iterator[Row]:
    """Write a trace record."""
    rounds = _rounds("bench_trace", settings)
    beside = "clock_gettime"
    note = "a mark on a thread that is not traced; the loop around it included"
    off = _block_pairs(rounds, "off", "clock")
    yield compared("trace record, off", off, unit="ns", beside=beside, limit=2, note=note)
    on = _block_pairs(rounds, "on", "clock")
    yield compared("trace record, on", on, unit="ns", beside=beside, ratio_limit=1.6)


def inversion_rows(settings: Settings) -> Iterator[Row]:
    """Block the urgent by the one that nobody would let run."""
    rounds = native.both("bench_inversion", settings.rounds, count=settings.inversions, cpu=settings.cpu)
    pairs = [
        (max(component["blocked_ns"]) / 1e6, max(bare["blocked_ns"]) / 1e6) for component, bare in rounds
    ]
    what = "FIFO90 blocked by a 2 ms holder while a FIFO50 hog burns 50 ms, through SharedData, worst"
    yield compared(what, pairs, unit="ms", beside="std::mutex", limit=2.2)


def _rounds(program: str, settings: Settings, **options: int) -> list[dict[str, Any]]:
    """A process a round; within it the sides take turns."""
    place = {"priority": settings.priority, "cpu": settings.cpu, **options}
    return [native.run(program, **place) for _ in range(settings.rounds)]


def _block_pairs(rounds: Sequence[dict[str, Any]], name: str, beside: str) -> list[tuple[float, float]]:
    """(measured, reference) of each round: the medians of its blocks, in ns a call."""
    return [
        (percentile(found[f"{name}_ps"], 50) / _PS_PER_NS, percentile(found[f"{beside}_ps"], 50) / _PS_PER_NS)
        for found in rounds
    ]
