"""A run that misses a deadline, searched for: where a bound is too long, it may be no more than a bound.

Runs begin as an executor does, all components on one epoch, each at its offset. The first ones take the
costliest and the densest way that the fsms have; the others draw.
"""

from collections.abc import Callable, Sequence
from random import Random

from mauve_rt.analysis.bounds import Subject
from mauve_rt.analysis.digraph import START, Job
from mauve_rt.analysis.machines import FOREVER_NS
from mauve_rt.analysis.schedule import Member, Schedule, run

RUNS = 64
_MOST_JOBS = 10_000  # of the first two runs, and of all others together
_EVENT_LATER = 2  # times the least distance, at most, where a run draws it
_DENSE = 0.5  # of the events: as soon as they may come


def witness_of(members: Sequence[Member], *, wakeup_ns: int = 0) -> Schedule | None:
    """A run of components of one CPU in which one misses its deadline; None: none was found in `RUNS` runs.

    The search is the same each time.
    """
    random = Random(0)  # noqa: S311 - not for secrets
    for number in range(RUNS if _has_choices(members, wakeup_ns) else 1):
        way = _WAYS[number] if number < len(_WAYS) else None
        order = [*members] if way else random.sample(members, len(members))
        most_jobs = _MOST_JOBS if way else _MOST_JOBS // RUNS
        choices = Drawn(random, members, way, wakeup_ns)
        found = run(order, choices, most_jobs=most_jobs, until_repeated=way is not None)
        if found.missed is not None:
            return found
    return None


def member_of(subject: Subject) -> Member:
    """As a run takes it."""
    sections = tuple((section.resource, section.length_ns) for section in subject.sections)
    return Member(subject.machine, subject.task, sections)


def _has_choices(members: Sequence[Member], wakeup_ns: int) -> bool:
    if wakeup_ns or len({member.machine.priority for member in members}) < len(members):
        return True
    if any(member.sections for member in members):
        return True
    events = any(state.is_event_wait for member in members for state in member.machine.states)
    return events or any(len(member.task.after(job)) > 1 for member in members for job in member.task.jobs)


def _costliest(job: Job) -> float:
    return job.cost_ns or 0


def _densest(job: Job) -> float:
    return (job.cost_ns or 0) / job.separation_ns


_Way = Callable[[Job], float]
_WAYS: tuple[_Way, ...] = (_costliest, _densest)


class Drawn:
    """Choices of one run: by a way, or each component by one of its own or by drawing."""

    WAYS = _WAYS

    def __init__(self, random: Random, members: Sequence[Member], way: _Way | None, wakeup_ns: int) -> None:
        self._random = random
        self._ways = {member.task.name: way or random.choice((*_WAYS, None, None)) for member in members}
        self._draws = way is None
        self._wakeup_ns = wakeup_ns
        self._instants_ns = [member.machine.offset_ns for member in members]

    def first(self, member: Member) -> tuple[Job, int]:
        """As Choices."""
        machine = member.machine
        initial = next(state for state in machine.states if state.is_initial)
        if not initial.is_wait:
            jobs = [job for job in member.task.jobs if job.after == START]
            return self._one_of(member, jobs), machine.offset_ns
        jobs = [job for job in member.task.jobs if job.after == initial.name]
        if initial.is_event_wait:
            came_ns = self._random.choice(self._instants_ns) if self._draws else max(self._instants_ns)
            latest_ns = machine.offset_ns + initial.latest_ns
            return self._one_of(member, jobs), min(max(machine.offset_ns, came_ns), latest_ns)
        return self._one_of(member, jobs), machine.offset_ns + initial.separation_ns

    def next(self, member: Member, job: Job) -> tuple[Job, int] | None:
        """As Choices."""
        following = member.task.after(job)
        if not following or job.separation_ns == FOREVER_NS:
            return None
        return self._one_of(member, following), self._later_ns(member, job)

    def late_ns(self) -> int:
        """As Choices."""
        return self._random.choice((0, self._wakeup_ns)) if self._draws else self._wakeup_ns

    def before_locks_ns(self, left_ns: int) -> int:
        """As Choices."""
        return self._random.choice((0, left_ns, self._random.randint(0, left_ns))) if self._draws else left_ns

    def _later_ns(self, member: Member, job: Job) -> int:
        wait = next(state for state in member.machine.states if state.name == job.until)
        if not wait.is_event_wait or not self._draws or self._random.random() < _DENSE:
            return job.separation_ns
        most_ns = max(job.separation_ns, min(wait.latest_ns, _EVENT_LATER * job.separation_ns))
        return self._random.randint(job.separation_ns, most_ns)

    def _one_of(self, member: Member, jobs: Sequence[Job]) -> Job:
        way = self._ways[member.task.name]
        return max(jobs, key=way) if way else self._random.choice(jobs)
