"""What reconfigurations cost, from the records that the component's own thread wrote.

*Blackout*: from the `parked` to the `armed` record.
A fallback core that takes over after a fault counts as one: from the `fault` record to the `start` record.

*Missed releases*: the instants, by the g before the commit, from the one pending at the park up to the first
nominal one after it.
*Phase*: that release, nominal and actual, minus the nearest instant of the grid epoch + offset + k*g that the
deployment record tells, and minus where the machine's waits since its initial state put it within a period:
after the waits 4, 6, 5 of a g of 15 that is 4, 10 and 0.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mauve_rt.trace.format.records import IN_VAIN, Kind, ReconfigurationPhase, Records
from mauve_rt.trace.reading.trace import Trace


@dataclass(frozen=True, kw_only=True)
class Reconfiguration:
    """A component was parked, something was committed (or refused), and it was armed again. Times in ns.

    After a fault: it was stopped by the fault, and went on with its fallback core.
    """

    component: str
    what: str
    """What was committed of this component, as it recorded it; empty when it did not."""
    committed: bool
    """False: refused by adopt, everything went on as before."""
    parked_ns: int
    armed_ns: int
    pending_ns: int
    """The instant that was pending at the park."""
    adopt_ns: int
    take_ns: int
    nominal_ns: int | None
    """The first release after it, as it should be; None when none came."""
    actual_ns: int | None
    missed_releases: int | None
    """None without a grid (sporadic) or without a release."""
    phase_nominal_ns: int | None
    phase_actual_ns: int | None
    complete: bool
    """False when records are missing between the park and the first release: the figures are doubtful."""
    after_fault: bool = False
    """A fallback core took over: `parked_ns` is the time of the fault, `armed_ns` that of the new start."""

    @property
    def blackout_ns(self) -> int:
        """From the parked to the armed record."""
        return self.armed_ns - self.parked_ns


def reconfigurations(trace: Trace) -> list[Reconfiguration]:
    """All reconfigurations in a trace by time.

    A park that the bag ends in is none (yet), nor is one whose change was called off.
    """
    found = [one for component in trace.components for one in _of_component(trace, component)]
    return sorted(found, key=lambda one: one.parked_ns)


def _of_component(trace: Trace, component: str) -> list[Reconfiguration]:
    records = trace.of(component)
    (marks,) = np.nonzero(np.isin(records["kind"], (Kind.PARKED, Kind.ARMED)))
    kinds = records["kind"]
    changes = [
        (int(parked), int(armed))
        for parked, armed in pairwise(marks)
        if kinds[parked] == Kind.PARKED and kinds[armed] == Kind.ARMED
        if records["b"][armed] != IN_VAIN
    ]
    return [
        *(_measure(trace, component, *change) for change in changes),
        *(_measure(trace, component, *takeover, after_fault=True) for takeover in _takeovers(records)),
    ]


def _takeovers(records: Records) -> Iterator[tuple[int, int]]:
    """Indices of each fault after which a fallback core took over, and of the start that followed."""
    kinds = records["kind"]
    (ends,) = np.nonzero(np.isin(kinds, (Kind.START, Kind.STOP, Kind.FAULT, Kind.RELEASE, Kind.PARKED)))
    starts_anew = (kinds[ends[:-1]] == Kind.FAULT) & (kinds[ends[1:]] == Kind.START)
    for index in np.flatnonzero(starts_anew).tolist():
        fault, end = int(ends[index]), int(ends[index + 1])
        between = records[fault:end]
        if ((between["kind"] == Kind.RECONFIGURATION) & (between["c"] == 0)).any():
            yield fault, end


def _measure(
    trace: Trace, component: str, parked: int, armed: int, *, after_fault: bool = False
) -> Reconfiguration:
    records = trace.of(component)
    between = records[parked:armed]
    phases = between[between["kind"] == Kind.RECONFIGURATION]
    (later,) = np.nonzero(np.isin(records["kind"][armed:], (Kind.RELEASE, Kind.STOP, Kind.PARKED)))
    last = armed + int(later[0]) if len(later) else armed
    released = records["kind"][last] == Kind.RELEASE
    nominal_ns = int(records["a"][last]) if released else None
    actual_ns = int(records["b"][last]) if released else None
    period_ns = _period_before(trace, component, parked)
    pending_ns = int(records["a"][parked]) + (period_ns if after_fault else 0)
    grid = trace.deployment_at(component, int(records["time_ns"][armed]))
    phase_nominal_ns, phase_actual_ns, missed_releases = None, None, None
    if grid is not None and grid.period_ns > 0 and nominal_ns is not None and actual_ns is not None:
        place_ns = int(records["c"][last])
        phase_nominal_ns = grid.phase_ns(nominal_ns - place_ns)
        phase_actual_ns = phase_nominal_ns + actual_ns - nominal_ns
        missed_releases = _missed(pending_ns, nominal_ns, period_ns)
    return Reconfiguration(
        component=component,
        what=", ".join(dict.fromkeys(trace.name(int(name)) for name in phases["name"])),
        committed=after_fault or bool(records["b"][armed]),
        parked_ns=int(records["time_ns"][parked]),
        armed_ns=int(records["time_ns"][armed]),
        pending_ns=pending_ns,
        adopt_ns=int(phases["b"][phases["a"] == ReconfigurationPhase.ADOPT].sum()),
        take_ns=int(phases["b"][phases["a"] == ReconfigurationPhase.TAKE].sum()),
        nominal_ns=nominal_ns,
        actual_ns=actual_ns,
        missed_releases=missed_releases,
        phase_nominal_ns=phase_nominal_ns,
        phase_actual_ns=phase_actual_ns,
        complete=int(records["sequence"][last] - records["sequence"][parked]) == last - parked,
        after_fault=after_fault,
    )


def _period_before(trace: Trace, component: str, parked: int) -> int:
    """Return g at the park: a new fsm tells its own before it is armed, maybe at the same instant."""
    deployed = trace.of(component)["kind"] == Kind.DEPLOYMENT
    later = int(np.count_nonzero(deployed[parked:]))
    grids = trace.deployments(component)
    return grids[max(len(grids) - later - 1, 0)].period_ns


def _missed(pending_ns: int, nominal_ns: int, period_ns: int) -> int:
    if period_ns <= 0 or nominal_ns <= pending_ns:
        return 0
    return -(-(nominal_ns - pending_ns) // period_ns)
