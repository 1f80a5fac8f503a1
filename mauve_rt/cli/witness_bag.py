"""A schedule that misses a deadline, as a bag: what a recording of that run would hold."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.analysis.machines import FOREVER_NS, Machine
from mauve_rt.analysis.schedule import Cycle, Schedule
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.records import DEADLINE_MISSED, Kind
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.recording.trace_bag import TraceBag

_EPOCH_NS = 1_000_000_000


class _Event(NamedTuple):
    time_ns: int
    component: str
    kind: Kind
    name: str = ""
    a: int = 0
    b: int = 0
    c: int = 0


def write_witness(directory: Path, machines: Sequence[Machine], schedule: Schedule) -> None:
    """Write a schedule of these components.

    Raises:
        TraceError: the folder exists or cannot be written, or mauve_msgs is not installed.
    """
    here = {cycle.component for cycle in schedule.cycles}
    components = {machine.name: machine for machine in machines if machine.name in here}
    source = SyntheticSource([*components])
    events = [event for machine in components.values() for event in _start(machine)]
    for cycle in schedule.cycles:
        events += _events(cycle, components[cycle.component])
    if schedule.missed is not None:
        events.append(_miss(schedule.missed))
    for event in sorted(events, key=lambda one: one.time_ns):
        at_ns, component, kind, name, a, b, c = event
        source.add(component, kind, at_ns, name=name, a=a, b=b, c=c)
    bag = TraceBag(source, directory, node_name="/witness", on_error=_refuse)
    bag.write(source.drain_trace(), (), whole=True)
    bag.close()


def _start(machine: Machine) -> Iterator[_Event]:
    first_ns = _EPOCH_NS + machine.offset_ns
    yield _Event(
        _EPOCH_NS, machine.name, Kind.DEPLOYMENT, a=_EPOCH_NS, b=machine.offset_ns, c=machine.period_ns
    )
    yield _Event(_EPOCH_NS, machine.name, Kind.START, a=first_ns)


def _events(cycle: Cycle, machine: Machine) -> Iterator[_Event]:
    component, nominal_ns, finish_ns = cycle.component, _at(cycle.nominal_ns), _at(cycle.finish_ns)
    if not cycle.states and cycle.finish_ns < 0:
        return  # its thread did not begin
    began_ns = _at(cycle.states[0][1]) if cycle.states else finish_ns
    yield _Event(began_ns, component, Kind.RELEASE, cycle.job.after, a=nominal_ns, b=began_ns)
    for state, begin_ns, end_ns in cycle.states:
        yield _Event(_at(begin_ns), component, Kind.STATE_BEGIN, state)
        if end_ns >= 0:
            yield _Event(_at(end_ns), component, Kind.STATE_END, state)
    if cycle.finish_ns < 0:
        return
    wait, next_ns = cycle.job.until, _at(cycle.next_ns)
    yield _Event(finish_ns, component, Kind.WAIT, wait, a=next_ns)
    if finish_ns > next_ns:
        skips = machine.overrun == "skip" and machine.period_ns
        skipped = -(-(finish_ns - next_ns) // machine.period_ns) if skips else 0
        yield _Event(finish_ns, component, Kind.OVERRUN, wait, a=next_ns, b=finish_ns, c=skipped)


def _miss(cycle: Cycle) -> _Event:
    late_ns = cycle.finish_ns - cycle.deadline_ns
    return _Event(_at(cycle.deadline_ns), cycle.component, Kind.MARK, DEADLINE_MISSED, a=late_ns)


def _at(time_ns: int) -> int:
    return time_ns if time_ns == FOREVER_NS else _EPOCH_NS + time_ns


def _refuse(problem: str) -> None:
    raise TraceError(problem)
