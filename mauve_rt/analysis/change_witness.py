"""A run in which a deadline is missed while a change is made, searched for as in `witness`.

Until the change each participant does jobs of its old parts; its first release at or after the change is one
of its new parts, with the handover in it. States and waits of new parts have the ending `_NEW`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from random import Random

from mauve_rt.analysis.bounds import Subject
from mauve_rt.analysis.digraph import START, DigraphTask, Job
from mauve_rt.analysis.machines import FOREVER_NS
from mauve_rt.analysis.plan import is_same
from mauve_rt.analysis.schedule import Member, Schedule, run
from mauve_rt.analysis.witness import Drawn, member_of

RUNS = 128
_MOST_JOBS = 120
_NEW = " (new)"
_LATEST_PERIODS = 4  # of the longest wait, until the change comes at the latest


@dataclass(frozen=True)
class _Side:
    """A component of one CPU: before the change, after it, or both."""

    member: Member
    entries: tuple[Job, ...]
    """What its first release at or after the change may be; none: nothing changes, or it is removed."""
    is_changed: bool
    is_added: bool


def change_witness(
    before: Mapping[str, Subject],
    after: Mapping[str, Subject],
    handovers: Mapping[str, int],
    *,
    wakeup_ns: int = 0,
) -> tuple[Schedule, int] | None:
    """A run of the components of one CPU and the instant of the change in it; None: no run misses a deadline.

    Args:
        before: those before the change, by name.
        after: those after it.
        handovers: ns, of those that change.
        wakeup_ns: how late a thread begins at most.

    """
    sides = [_side(before.get(name), after.get(name), handovers.get(name)) for name in {**before, **after}]
    random = Random(0)  # noqa: S311 - not for secrets
    longest_ns = max((_longest_wait(side) for side in sides), default=0)
    for number in range(RUNS):
        change_ns = random.randint(0, _LATEST_PERIODS * longest_ns) if number else 0
        choices = _Changing(random, sides, change_ns, wakeup_ns)
        order = random.sample([side.member for side in sides], len(sides))
        found = run(order, choices, most_jobs=_MOST_JOBS)
        if found.missed is not None:
            return found, change_ns
    return None


def _longest_wait(side: _Side) -> int:
    waits = [job.separation_ns for job in side.member.task.jobs if job.separation_ns != FOREVER_NS]
    return max(waits, default=0)


def _side(old: Subject | None, new: Subject | None, handover_ns: int | None) -> _Side:
    if old is not None and is_same(old, new, is_handed_over=handover_ns is not None):
        return _Side(member_of(old), (), is_changed=False, is_added=False)
    if new is None:
        if old is None:
            raise ValueError("a component is there before a change or after it")
        return _Side(member_of(old), (), is_changed=True, is_added=False)
    renamed = _renamed(new)
    first = tuple(_handed_over(job, handover_ns or 0) for job in renamed.task.jobs)
    if old is None:
        return _Side(renamed, _starting(first, new), is_changed=True, is_added=True)
    both = member_of(old)
    machine = replace(both.machine, states=(*both.machine.states, *renamed.machine.states))
    task = DigraphTask(both.task.name, (*both.task.jobs, *renamed.task.jobs))
    sections = dict((*both.sections, *renamed.sections))
    member = Member(machine, task, tuple(sections.items()))
    return _Side(member, first, is_changed=True, is_added=False)


def _renamed(subject: Subject) -> Member:
    member = member_of(subject)
    states = tuple(
        replace(state, name=state.name + _NEW, successors=tuple(name + _NEW for name in state.successors))
        for state in member.machine.states
    )
    jobs = tuple(
        replace(
            job,
            after=job.after + _NEW if job.after != START else START + _NEW,
            states=tuple(name + _NEW for name in job.states),
            until=job.until + _NEW,
        )
        for job in member.task.jobs
    )
    return Member(
        replace(member.machine, states=states), DigraphTask(member.task.name, jobs), member.sections
    )


def _handed_over(job: Job, handover_ns: int) -> Job:
    return replace(
        job,
        cost_ns=(job.cost_ns or 0) + handover_ns,
        release_cost_ns=(job.release_cost_ns or 0) + handover_ns,
    )


def _starting(jobs: tuple[Job, ...], subject: Subject) -> tuple[Job, ...]:
    """Those that a start begins with."""
    initial = next(state for state in subject.machine.states if state.is_initial)
    begin = initial.name if initial.is_wait else START
    return tuple(job for job in jobs if job.after == begin + _NEW)


class _Changing(Drawn):
    """Choices of one run with a change at an instant."""

    def __init__(self, random: Random, sides: Sequence[_Side], change_ns: int, wakeup_ns: int) -> None:
        way = None if random.random() < 0.5 else self.WAYS[0]  # noqa: PLR2004 - half of the runs
        super().__init__(random, [side.member for side in sides], way, wakeup_ns)
        self._sides = {side.member.task.name: side for side in sides}
        self._change_ns = change_ns
        self._nominal_ns: dict[str, int] = {}
        self._is_new: set[str] = set()

    def first(self, member: Member) -> tuple[Job, int]:
        name = member.task.name
        side = self._sides[name]
        if side.is_added:
            self._is_new.add(name)
            job, at_ns = self._one_of(member, side.entries), self._change_ns
        else:
            job, at_ns = super().first(member)
            if side.is_changed and at_ns >= self._change_ns and side.entries:
                self._is_new.add(name)
                job = self._entry(side, job.after)
        self._nominal_ns[name] = at_ns
        return job, at_ns

    def next(self, member: Member, job: Job) -> tuple[Job, int] | None:
        name = member.task.name
        side = self._sides[name]
        if job.separation_ns == FOREVER_NS:
            return None
        later_ns = self._later_ns(member, job)
        self._nominal_ns[name] += later_ns
        if side.is_changed and name not in self._is_new and self._nominal_ns[name] >= self._change_ns:
            if not side.entries:
                return None  # it is removed
            self._is_new.add(name)
            return self._entry(side, job.until), later_ns
        following = member.task.after(job)
        return (self._one_of(member, following), later_ns) if following else None

    def _entry(self, side: _Side, wait: str) -> Job:
        """In the wait of the same name, where the new fsm has one."""
        fitting = [job for job in side.entries if job.after == wait + _NEW]
        return self._one_of(side.member, fitting or side.entries)
