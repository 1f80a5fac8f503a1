"""What a trace tells about timing, in sentences, none of which claims more than the trace proves."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from mauve_rt.trace.reading.statistics import ComponentStatistics
from mauve_rt.trace.reading.violations import Violation
from mauve_rt.trace.report.analysis import Analysis, Fault
from mauve_rt.trace.report.machine import Machine
from mauve_rt.trace.report.overruns import culprits
from mauve_rt.trace.report.units import counted, listed, share_text, time_text, times

GOOD, ATTENTION, BAD = "good", "attention", "bad"
_RANKS = (BAD, ATTENTION, GOOD, "")
_MANY = 0.01
"""Share of releases from which overruns are more than an exception."""
_NAMED = 6
"""Components with overruns that get a sentence each."""


class Sentence(NamedTuple):
    """A sentence and how serious it is: good, attention, bad, or empty for a mere fact."""

    level: str
    text: str


def sentences_on(analysis: Analysis, machine: Machine) -> list[Sentence]:
    """Return all of them, the most serious first."""
    return ranked(
        [
            *_misses(analysis),
            *_violations(analysis),
            *_overruns(analysis, machine),
            *_stalls(analysis, machine),
            *_swaps(analysis),
            *_faults(analysis),
            *_doubts(analysis),
            *_latencies(analysis),
            *_scope(analysis),
        ]
    )


def ranked(sentences: Iterable[Sentence]) -> list[Sentence]:
    """Return them with the most serious first; equals stay in order."""
    return sorted(sentences, key=lambda one: _RANKS.index(one.level))


def _misses(analysis: Analysis) -> Iterator[Sentence]:
    for one in analysis.misses[:_NAMED]:
        at = time_text(one.time_ns - analysis.zero_ns)
        yield Sentence(BAD, f"{one.component} missed its deadline at {at} by {time_text(one.late_ns)}.")


def _violations(analysis: Analysis) -> Iterator[Sentence]:
    worst: dict[str, Violation] = {}
    for one in sorted(analysis.violations, key=lambda one: -one.excess_ns):
        worst.setdefault(one.component, one)
    if worst:
        jobs = counted(sum(one.jobs for one in analysis.violations), "job")
        yield Sentence(
            ATTENTION, f"{jobs} took longer than proved: correct the declared times, or the model."
        )
    for one in [*worst.values()][:_NAMED]:
        yield Sentence(ATTENTION, f"At {time_text(one.end_ns - analysis.zero_ns)}: {one.message}.")


def _scope(analysis: Analysis) -> Iterator[Sentence]:
    lost = analysis.trace.lost
    components = counted(len(analysis.trace.components), "component")
    yield Sentence(
        ATTENTION if lost else "",
        f"{components}, {time_text(analysis.duration_ns)}, {counted(analysis.records, 'record')}; "
        + (f"at least {lost:,} more were lost." if lost else "none was lost."),
    )


def _overruns(analysis: Analysis, machine: Machine) -> Iterator[Sentence]:
    found = analysis.statistics
    releases = sum(one.releases for one in found.values())
    late = sorted((one for one in found.values() if one.overruns), key=lambda one: -one.overruns)
    if not releases:
        yield Sentence(ATTENTION, "No component was released while this was recorded.")
        return
    if not late:
        told = " that were recorded" if analysis.trace.lost else ""
        yield Sentence(GOOD, f"No overrun in {counted(releases, 'release')}{told}: each cycle ended in time.")
        return
    for one in late[:_NAMED]:
        share = one.overruns / max(one.releases, 1)
        least = "at least " if one.lost_records else ""
        text = (
            f"{one.component} overran {least}{times(one.overruns)} "
            f"({share_text(share)} of {counted(one.releases, 'release')}) "
            f"and skipped {counted(one.skipped, 'instant')}"
        )
        blamed = culprits(analysis, one.component)
        if blamed:
            worst = blamed[0]
            which = "all" if worst.overruns == one.overruns else f"{worst.overruns:,}"
            which = "in that cycle" if one.overruns == 1 else f"in {which} of these cycles"
            what = f"its state {worst.state}" if worst.state else "the wake-up itself"
            limit = "" if one.overruns == 1 else "up to "
            text += f"; {which} {what} took longest, {limit}{time_text(worst.longest_ns)}"
        stalled = machine.overruns[one.component]
        if stalled:
            where = "then" if one.overruns == 1 else f"in {_of_them(stalled, one.overruns)}"
            text += f"; the machine stalled {where}"
        yield Sentence(BAD if share > _MANY else ATTENTION, text + ".")
    if len(late) > _NAMED:
        rest = sum(one.overruns for one in late[_NAMED:])
        yield Sentence(ATTENTION, f"{len(late) - _NAMED} more components overran {rest:,} times.")
    punctual = [one.component for one in found.values() if one.releases and not one.overruns]
    if punctual:
        yield Sentence(GOOD, f"{listed(punctual)} had no overrun.")


def _latencies(analysis: Analysis) -> Iterator[Sentence]:
    released = [one for one in analysis.statistics.values() if one.wakeup.count]
    if not released:
        return
    worst = max(released, key=lambda one: one.wakeup.max_ns)
    if worst.wakeup.max_ns == 0 and all(one.wakeup.min_ns == 0 for one in released):
        yield Sentence(
            "", "Every wake-up came exactly on time, as in simulated time: no machine is measured."
        )
        return
    text = (
        f"The latest wake-up came {time_text(worst.wakeup.max_ns)} after its instant ({worst.component}); "
        f"the 99th percentile of its latencies is {time_text(worst.wakeup.p99_ns)}"
    )
    periodic = [one for one in released if one.phase_error.count]
    # beyond half a period the nearest instant of the grid is another one: nothing would be said by it
    if periodic and all(2 * one.wakeup.max_ns < one.period_ns for one in periodic):
        most = max(periodic, key=lambda one: _off_ns(one) / one.period_ns)
        text += (
            ". Against the grids of the deployment, no release was further off than "
            f"{share_text(_off_ns(most) / most.period_ns)} of its period "
            f"({most.component}, {time_text(_off_ns(most))})"
        )
    yield Sentence("", text + ".")


def _stalls(analysis: Analysis, machine: Machine) -> Iterator[Sentence]:
    found = machine.stalls
    if not found:
        return
    worst = max(found, key=lambda one: one.latency_ns)
    at_worst = "" if len(found) == 1 else "at worst "
    yield Sentence(
        ATTENTION if any(machine.overruns.values()) else "",
        f"The machine stalled {times(len(found))}: several components woke late together while none of them "
        f"was executing, {at_worst}{worst.components} of them by up to {time_text(worst.latency_ns)} "
        f"({time_text(worst.end_ns - analysis.zero_ns)} after the begin). Something outside of them held "
        "the processors.",
    )


def _of_them(part: int, whole: int) -> str:
    return "all of them" if part == whole else f"{part:,} of them"


def _off_ns(one: ComponentStatistics) -> int:
    return max(abs(one.phase_error.max_ns), abs(one.phase_error.min_ns))


def _swaps(analysis: Analysis) -> Iterator[Sentence]:
    measured = [swap.measured for swap in analysis.swaps]
    if not measured:
        yield Sentence("", "Nothing was reconfigured.")
        return
    longest = max(measured, key=lambda one: one.blackout_ns)
    touched = sorted({one.component for one in measured})
    whose = f" ({longest.component})" if len(touched) > 1 else ""
    lasted = "blackout" if len(measured) == 1 else "longest blackout"
    yield Sentence(
        "",
        f"{counted(len(measured), 'reconfiguration').capitalize()} of {listed(touched)}; "
        f"the {lasted} lasted {time_text(longest.blackout_ns)}{whose}.",
    )
    known = [one for one in measured if one.missed_releases is not None]
    missed = sum(one.missed_releases or 0 for one in known)
    if missed:
        names = listed(sorted({one.component for one in known if one.missed_releases}))
        yield Sentence(ATTENTION, f"{counted(missed, 'release').capitalize()} missed by {names}.")
    elif known:
        all_known = len(known) == len(measured)
        which = (
            "No reconfiguration" if all_known else f"Of {len(known):,} reconfigurations with a period none"
        )
        yield Sentence(GOOD, f"{which} missed a release.")
    off = [one for one in known if one.phase_nominal_ns]
    if off:
        worst_ns = max(abs(one.phase_nominal_ns or 0) for one in off)
        swaps = counted(len(off), "reconfiguration")
        yield Sentence(BAD, f"{swaps} left the component off its grid, by up to {time_text(worst_ns)}.")
    elif known:
        latest_ns = max(one.phase_actual_ns or 0 for one in known)
        yield Sentence(
            GOOD,
            "After each reconfiguration the next release was due on the grid of the deployment, "
            f"and came at most {time_text(latest_ns)} after it.",
        )
    refused = [one for one in measured if not one.committed]
    if refused:
        yield Sentence(
            ATTENTION,
            f"{counted(len(refused), 'reconfiguration')} refused by the new core's adopt: "
            "all went on as before.",
        )
    unknown = len(measured) - len(known)
    if unknown:
        yield Sentence(
            "",
            f"Of {counted(unknown, 'reconfiguration')} no missed releases can be told: no period, "
            "or no release came after.",
        )


def _faults(analysis: Analysis) -> Iterator[Sentence]:
    for fault in analysis.faults[:_NAMED]:
        at = time_text(fault.time_ns - analysis.zero_ns)
        where = f" in its state {fault.state}" if fault.state else ""
        reason = f": {fault.reason}" if fault.reason else ""
        what = f"{fault.component} had a fault{where}, {at} after the begin{reason}"
        yield Sentence(BAD, f"{what}; {_what_followed(fault)}.")
    if len(analysis.faults) > _NAMED:
        yield Sentence(BAD, f"{len(analysis.faults) - _NAMED} more faults followed.")


def _what_followed(fault: Fault) -> str:
    takeover = fault.takeover
    if takeover is None:
        return "it was parked (FAULTED)"
    text = (
        f"fallback core {takeover.what.rsplit('/', 1)[-1]} took over after {time_text(takeover.blackout_ns)}"
    )
    if takeover.actual_ns is None:
        return text
    return f"{text}, and was released {time_text(takeover.actual_ns - fault.time_ns)} after the fault"


def _doubts(analysis: Analysis) -> Iterator[Sentence]:
    damaged = [file for file in analysis.trace.files if file.damage]
    if damaged:
        files = counted(len(damaged), "file")
        yield Sentence(ATTENTION, f"Of {files} not all could be read: {damaged[0].damage}.")
    lossy = [name for name, found in analysis.statistics.items() if found.lost_records]
    if lossy:
        yield Sentence(
            ATTENTION, f"Records of {listed(lossy)} are missing: their counts here are lower bounds."
        )
    torn = [swap for swap in analysis.swaps if not swap.measured.complete]
    if torn:
        yield Sentence(
            ATTENTION,
            f"Of {counted(len(torn), 'reconfiguration')} records are missing: the figures are doubtful.",
        )
    silent = [name for name, found in analysis.statistics.items() if not found.releases]
    if silent and len(silent) < len(analysis.statistics):
        yield Sentence(ATTENTION, f"No release of {listed(silent)} is in the trace.")
    sporadic = [name for name in analysis.trace.components if analysis.sporadic(name)]
    if sporadic:
        verb = "is" if len(sporadic) == 1 else "are"
        yield Sentence(
            "", f"{listed(sporadic)} {verb} event-triggered: phase and missed releases do not apply."
        )
    ordinary = [one.name for one in analysis.trace.architecture if one.policy == "SCHED_OTHER"]
    if ordinary:
        yield Sentence(ATTENTION, f"Without real-time scheduling (SCHED_OTHER): {listed(ordinary)}.")
