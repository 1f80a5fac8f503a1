"""Many components in one process: time to start, CPU share, locked memory."""

from collections.abc import Iterator
from typing import Any

import native
from rows import Row, alone, compared, exactly_zero
from settings import Settings

_COUNTS = (1, 8, 64, 500)
_SIMULATED = 3000
_KIB = 1024
_LINEAR = 1.5
"""A component of the most costs at most so many times one of the middle count, or it is not linear."""


def scale_rows(settings: Settings) -> Iterator[Row]:
    """Components at 10 Hz, as many as there may be."""
    rounds = native.interleaved(
        settings.rounds,
        *[_measure(count, settings.scale_s) for count in _COUNTS],
    )
    found = {count: [found[place] for found in rounds] for place, count in enumerate(_COUNTS)}
    for count in _COUNTS:
        firsts = sorted(one["first_ns"] / 1e6 for one in found[count])
        note = f"the last first release came {firsts[len(firsts) // 2]:.0f} ms after the call of deploy()"
        what = f"{count} components at 10 Hz"
        starts = [one["start_ns"] / 1e6 for one in found[count]]
        yield alone(f"{what}: time until all threads are ready", starts, unit="ms", note=note)
        leads = [one["lead_ns"] / 1e6 for one in found[count]]
        what_lead = f"{what}: from the return of deploy(), all being ready, to the epoch"
        yield alone(what_lead, leads, unit="ms", limit=20)
        shares = [100 * one["cpu_ns"] / one["ran_ns"] for one in found[count]]
        yield alone(f"{what}: share of one CPU", shares, unit="%")
        reserved = found[count][0]["reserved_bytes"] / count / _KIB
        note = "resident pages of locked mappings (Locked of smaps_rollup); the mappings themselves (VmLck) "
        note += f"grew by {reserved:.0f} KiB each"
        locked = [one["locked_bytes"] / count / _KIB for one in found[count]]
        yield alone(f"{what}: locked memory each", locked, unit="KiB", limit=256, note=note)
    for what, name in (
        ("time to start", "start_ns"),
        ("CPU time", "cpu_ns"),
        ("locked memory", "locked_bytes"),
    ):
        middle, most = _COUNTS[-2:]
        pairs = [
            (big[name] / most, small[name] / middle)
            for big, small in zip(found[most], found[middle], strict=True)
        ]
        unit, scale = ("KiB", _KIB) if name == "locked_bytes" else ("us", 1000)
        yield compared(
            f"{what} of one component among {most}",
            [(a / scale, b / scale) for a, b in pairs],
            unit=unit,
            beside=f"among {middle}",
            ratio_limit=_LINEAR,
        )


def idle_rows(settings: Settings) -> Iterator[Row]:
    """All components wait, and none declares a bound: nothing has to wake up."""
    found = [native.run("bench_idle", priority=settings.priority) for _ in range(settings.rounds)]
    rates = [one["wakeups"] / (one["duration_ns"] / 1e9) for one in found]
    what = "8 components that wait, none with a bound: wake-ups a second of all threads"
    yield exactly_zero(what, rates)


def simulation_rows(settings: Settings) -> Iterator[Row]:
    """Virtual time with a thousand components; one transaction over three thousand."""
    rounds = native.interleaved(
        settings.rounds,
        *[lambda _, spread=spread: native.run("bench_simulation", spread=spread) for spread in (0, 1)],
    )
    for place, how in enumerate(("at one instant", "at instants of their own")):
        passed = [found[place]["virtual_ns"] / found[place]["real_ns"] for found in rounds]
        each = [found[place]["real_ns"] / found[place]["releases"] for found in rounds]
        note = f"{sorted(each)[len(each) // 2]:.0f} ns a release; no trace"
        yield alone(f"1000 components at 10 Hz, due {how}: virtual time", passed, unit="s/s", note=note)
    changes = [
        native.run("bench_simulation", measure="transaction", components=_SIMULATED, trace=1)
        for _ in range(settings.rounds)
    ]
    took_ms = [one["real_ns"] / 1e6 for one in changes]
    what = f"simulated transaction, a new core for each of {_SIMULATED} components: real time of the commit"
    note = "from the preparation to the report; with a trace"
    yield alone(what, took_ms, unit="ms", limit=1000, note=note)


def _measure(count: int, duration_s: float) -> native.Measure:
    def measure(_: int) -> dict[str, Any]:
        return native.run("bench_scale", components=count, duration_ms=round(duration_s * 1000))

    return measure
