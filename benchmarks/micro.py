"""What takes nanoseconds: data, activations, trace records, a shadow; and what a lock costs who is urgent."""

import os
from collections.abc import Iterator, Sequence
from typing import Any

import native
from ratios import median_interval, percentile
from rows import Row, alone, compared, exactly_zero, not_available
from settings import Settings

_PS_PER_NS = 1000
_NS_PER_US = 1000
_PACE_NS = 1000
_RELEASES = ("plain", "shadowed", "awaiting", "waking", "probation", "blended")
_SHADOW_US = 5.0  # 0.5 % of the period; most of it is the system call that wakes the shadow's thread
_LOOKUP_NS_PER_HOP = 1000
_ONE_CPU = "this machine has one CPU"
_COPY = "PI mutex lock + unlock + copy"


def shared_data_rows(settings: Settings) -> Iterator[Row]:
    """Write and read SharedData: alone, and while the other end is used without pause."""
    other = _other_cpu(settings)
    rounds = _rounds("bench_shared_data", settings, other_cpu=other)
    for size, ratio_limit in (("16", 1.1), ("4096", 1.3)):
        for verb in ("write", "read"):
            yield compared(
                f"SharedData {verb}, {size} B, alone",
                _block_pairs(rounds, f"{verb}_{size}", f"bare_{verb}_{size}"),
                unit="ns",
                beside=_COPY,
                ratio_limit=ratio_limit,
            )
    limits = {("read", "16"): 0.1, ("write", "16"): 0.3}
    for size in ("16", "4096"):
        for verb, end in (("read", "writer"), ("write", "reader")):
            what = f"SharedData {verb}, {size} B, against a hammering {end}"
            if other < 0:
                yield not_available(what, _ONE_CPU)
                continue
            pairs = _block_pairs(rounds, f"hammered_{verb}_{size}", f"bare_hammered_{verb}_{size}")
            limit = limits.get((verb, size))
            yield compared(what, pairs, unit="ns", beside=_COPY, ratio_limit=limit)
    what = "SharedData write and read, 1 MiB, on one thread"
    yield compared(what, _block_pairs(rounds, "copy", "bare_copy"), unit="ns", beside="two memcpy")
    what = "SharedData write and read in place, 1 MiB, on one thread"
    pairs = _block_pairs(rounds, "in_place", "bare_in_place")
    yield compared(what, pairs, unit="ns", beside="one memcpy", ratio_limit=1.1)


def ring_buffer_rows(settings: Settings) -> Iterator[Row]:
    """Pass elements from one CPU to another one through a RingBuffer."""
    other = _other_cpu(settings)
    paths = {
        "stream": "from one CPU to another, an element",
        "echo": "there and back between two CPUs, a round trip",
    }
    whats = {
        (path, size): f"RingBuffer of {capacity}, {size} B, {told}"
        for size, capacity in (("16", 1024), ("4096", 64))
        for path, told in paths.items()
    }
    wrong = "RingBuffer: elements that were lost, repeated or torn"
    if other < 0:
        for what in (*whats.values(), wrong):
            yield not_available(what, _ONE_CPU)
        return
    rounds = _rounds("bench_ring_buffer", settings, other_cpu=other, blocks=21)
    for (path, size), what in whats.items():
        boost = f"boost_{path}_{size}"
        if f"{boost}_ps" in rounds[0]:
            pairs = _block_pairs(rounds, f"{path}_{size}", boost)
            limit = 2 if size == "16" else None
            yield compared(what, pairs, unit="ns", beside="boost spsc_queue", ratio_limit=limit)
        else:
            yield alone(what, _blocks(rounds, f"{path}_{size}"), unit="ns")
            yield not_available(f"{what}, beside boost spsc_queue", "boost/lockfree is not installed")
        yield alone(f"{what}, two readers connected", _blocks(rounds, f"{path}_two_{size}"), unit="ns")
    note = f"of {sum(found['elements'] for found in rounds)} elements with one reader or two"
    yield exactly_zero(wrong, [found["wrong"] for found in rounds], note=note)


def latest_value_rows(settings: Settings) -> Iterator[Row]:
    """Write a LatestValue, and read it: alone, and while a thread writes to it."""
    what = "LatestValue read, 16 B"
    other = _other_cpu(settings)
    rounds = _rounds("bench_latest_value", settings, writer_cpu=other)
    pairs = _block_pairs(rounds, "write", "seqlock_write")
    limit = round(1.5 * median_interval([pair[1] for pair in pairs]).value + 5, 1)
    note = "the limit is 1.5 times the seqlock's write in the same run, and 5 ns"
    write = "LatestValue write, 16 B, alone"
    yield compared(write, pairs, unit="ns", beside="seqlock", limit=limit, note=note)
    pairs = _block_pairs(rounds, "alone", "seqlock_alone")
    yield compared(f"{what}, alone", pairs, unit="ns", beside="seqlock", ratio_limit=1.2)
    hammered = f"{what}, against a hammering writer"
    if other < 0:
        yield not_available(hammered, _ONE_CPU)
        return
    sums = {name: sum(found[name] for found in rounds) for name in rounds[0] if not name.endswith("_ps")}
    note = f"writes a read: {sums['writes'] / sums['reads']:.2g} to the LatestValue, "
    note += f"{sums['seqlock_writes'] / sums['reads']:.2g} to the seqlock, "
    note += f"whose readers tried {1 + sums['seqlock_retries'] / sums['reads']:.3g} times"
    pairs = _block_pairs(rounds, "hammered", "seqlock_hammered")
    yield compared(hammered, pairs, unit="ns", beside="seqlock", ratio_limit=1.2, note=note)
    rounds += _rounds("bench_latest_value", settings, writer_cpu=other, pace_ns=_PACE_NS)
    pairs = _block_pairs(rounds[settings.rounds :], "hammered", "seqlock_hammered")
    paced = f"{what}, against a writer that writes every {_PACE_NS} ns"
    yield compared(paced, pairs, unit="ns", beside="seqlock", ratio_limit=1.5)
    bad = [found["failed"] + found["torn"] for found in rounds]
    note = f"of {sum(found['reads'] for found in rounds)} reads against either writer"
    yield exactly_zero(f"{what}: reads that failed or found halves of two values", bad, note=note)


def transform_lookup_rows(settings: Settings) -> Iterator[Row]:
    """Look up transforms of a TransformTree."""
    rounds = _rounds("bench_transform_lookup", settings)
    for hops, plural in ((1, ""), (10, "s")):
        pairs = _block_pairs(rounds, f"lookup_{hops}", f"map_{hops}")
        what = f"TransformTree lookup by names, interpolated, {hops} hop{plural}"
        beside, limit = "two std::map lookups by name", hops * _LOOKUP_NS_PER_HOP
        yield compared(what, pairs, unit="ns", beside=beside, limit=limit)
    yield exactly_zero("TransformTree: lookups that failed", [found["failed"] for found in rounds])


def activation_rows(settings: Settings) -> Iterator[Row]:
    """Resume a state machine of two states, on no thread."""
    rounds = _rounds("bench_activation", settings)
    note = "Task::resume() from the end of a wait to the entry of the next, without the futex call: "
    note += "commands, two readings of the clock, statistics, the call of an empty state, 4 trace records"
    for name, limit in (("traced", 300), ("untraced", None)):
        what = f"one activation of a two-state FSM, kernel work only, {name}"
        yield alone(what, _blocks(rounds, name), unit="ns", limit=limit, note=note if limit else "")


def trace_rows(settings: Settings) -> Iterator[Row]:
    """Write a trace record, and a log line."""
    rounds = _rounds("bench_trace", settings)
    beside = "clock_gettime"
    note = "a mark on a thread that is not traced; the loop around it included"
    off = _block_pairs(rounds, "off", "clock")
    yield compared("trace record, off", off, unit="ns", beside=beside, limit=2, note=note)
    on = _block_pairs(rounds, "on", "clock")
    yield compared("trace record, on", on, unit="ns", beside=beside, ratio_limit=1.6)
    note = "the arguments copied into the thread's ring; formatted by another thread"
    kept = _block_pairs(rounds, "log", "on")
    yield compared("log line with 2 doubles", kept, unit="ns", beside="trace record, on", limit=60, note=note)
    below = _block_pairs(rounds, "log_off", "clock")
    note = "below the level of its component; the loop around it included"
    yield compared("log line below its level", below, unit="ns", beside=beside, limit=2, note=note)


def shadow_rows(settings: Settings) -> Iterator[Row]:
    """Execute a component with a shadow, and on probation: ports, and whole releases."""
    rounds = _rounds("bench_shadow", settings)
    beside = "the same port without"
    sides = {"tapped_read": "read, with a shadow's tap", "tapped_write": "write, with a shadow's tap"}
    sides |= {
        "watched_write": "write, with an output limit of a probation",
        "limited_write": "write, with a max_slew that limits it",
    }
    for name, what in sides.items():
        pairs = _block_pairs(rounds, name, name.partition("_")[2])
        yield compared(f"port of a SharedData, 16 B, {what}", pairs, unit="ns", beside=beside)
    what = "copy of a release with two ports of 16 B for its shadow, without the wake-up"
    yield alone(what, _blocks(rounds, "capture"), unit="ns")
    medians = [
        {name: percentile(found[f"{name}_ns"], 50) / _NS_PER_US for name in _RELEASES} for found in rounds
    ]
    note = "three ports of 16 B; CPU time of the component's thread from one release to the next, p50; "
    note += f"the shadow executed {sum(found['compared'] for found in rounds)} of "
    note += f"{sum(found['releases'] for found in rounds)} releases"
    added = [each["shadowed"] - each["plain"] for each in medians]
    what = "CPU time that a shadow adds to each release of a 1 kHz component"
    yield alone(what, added, unit="us", limit=_SHADOW_US, note=note)
    whats = {
        "shadowed": "with a shadow",
        "awaiting": "while a bumpless change waits for near outputs",
        "waking": "that wakes a sleeping ordinary thread, without a shadow",
        "probation": "on probation with an output limit",
        "blended": "in a blend of two equal cores",
    }
    for name, what in whats.items():
        yield compared(
            f"CPU time of a release of a 1 kHz component {what}",
            [(each[name], each["plain"]) for each in medians],
            unit="us",
            beside="the same component without",
        )
    for percent in (50, 99):
        yield compared(
            f"wake-up latency of a neighbour on the CPU while a bumpless change waits, p{percent}",
            _us_pairs(rounds, "neighbour_awaiting_ns", "neighbour_plain_ns", percent),
            unit="us",
            beside="the same neighbour without",
        )
        yield compared(
            f"bumpless change of a core that is near at once, blackout p{percent}",
            _us_pairs(rounds, "bumpless_blackout_ns", "blackout_ns", percent),
            unit="us",
            beside="a plain change between the same cores",
        )


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


def _us_pairs(
    rounds: Sequence[dict[str, Any]], name: str, reference: str, percent: float
) -> list[tuple[float, float]]:
    return [
        (percentile(found[name], percent) / _NS_PER_US, percentile(found[reference], percent) / _NS_PER_US)
        for found in rounds
    ]


def _other_cpu(settings: Settings) -> int:
    """A CPU for a second thread; -1 where the machine has one."""
    return min(os.sched_getaffinity(0) - {settings.cpu}, default=-1)


def _blocks(rounds: Sequence[dict[str, Any]], name: str) -> list[float]:
    """The median of the blocks of each round, in ns a call."""
    return [percentile(found[f"{name}_ps"], 50) / _PS_PER_NS for found in rounds]


def _block_pairs(rounds: Sequence[dict[str, Any]], name: str, beside: str) -> list[tuple[float, float]]:
    """(measured, reference) of each round: the medians of its blocks, in ns a call."""
    return list(zip(_blocks(rounds, name), _blocks(rounds, beside), strict=True))
