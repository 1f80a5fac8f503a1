"""A run of the components of one CPU under SCHED_FIFO, in virtual time, until one misses its deadline.

Each execution takes the time that is known of its state, to the end. `Choices` decide what a model leaves
open: which way a component takes, when an event comes, how late a thread begins, when a job locks.

As the Linux kernel does it, threads are queued, not jobs: one that wakes up goes to the end of the queue of
its priority; one that is preempted stays where it is, and so does one that goes on with the next job without
a sleep. A lock passes priorities on: its holder goes to the end of the queue of the higher priority, and
afterwards to the head of its own. A lock that is given back goes to the most urgent thread that waits for it,
unless a thread that is more urgent still takes it first.
"""

import heapq
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cached_property
from typing import NamedTuple, Protocol

from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.machines import FOREVER_NS, Machine
from mauve_rt.analysis.time_limit import check_time_limit


@dataclass(frozen=True)
class Member:
    """A component of the run: the cost of each of its jobs is known."""

    machine: Machine
    task: DigraphTask
    sections: tuple[tuple[str, int], ...] = ()
    """Resources that each job locks once, and how long. In the longest of its states, one after the other."""

    @cached_property
    def limits_ns(self) -> dict[str, int]:
        """Wall-clock bounds of its states, of which less CPU time is declared."""
        return {
            state.name: state.limit_ns
            for state in self.machine.states
            if state.time.ns is not None and state.time.ns < state.limit_ns
        }


class Choices(Protocol):
    """Decides what the model leaves open."""

    def first(self, member: Member) -> tuple[Job, int]:
        """The job that a component begins with, and its nominal instant after the epoch."""

    def next(self, member: Member, job: Job) -> tuple[Job, int] | None:
        """What follows a job, and how long after its nominal instant; None: nothing."""

    def late_ns(self) -> int:
        """How long after its nominal instant a thread begins."""

    def before_locks_ns(self, left_ns: int) -> int:
        """How long a state executes before it locks, of its time outside of critical sections."""


class Slice(NamedTuple):
    """A component had the processor."""

    component: str
    begin_ns: int
    end_ns: int
    resource: str = ""
    """Which it held locked."""


@dataclass
class Cycle:
    """A job in the run. Instants in ns after the epoch; lists grow as it goes on."""

    component: str
    job: Job
    nominal_ns: int
    ready_ns: int
    """When its thread asks for the processor."""
    states: list[tuple[str, int, int]] = field(default_factory=list)
    """Name, begin and end of each execution, preemption included; an end of -1: it lasts."""
    finish_ns: int = -1
    """-1: it lasts."""
    next_ns: int = FOREVER_NS
    """The nominal instant that its wait ends at."""
    too_long: str = ""
    """The state that lasted beyond its wall-clock bound, where that ends the run."""

    @property
    def deadline_ns(self) -> int:
        """The instant."""
        return self.nominal_ns + self.job.deadline_ns


class Schedule(NamedTuple):
    """What happened, and the cycle that missed its deadline or was too long, the last one; None: none was."""

    cycles: list[Cycle]
    slices: list[Slice]
    missed: Cycle | None

    def shares_ns(self, cycle: Cycle) -> dict[tuple[str, str], int]:
        """Who had the processor how long from a cycle's nominal instant to its finish, the longest first.

        By component and the resource that it held locked.
        """
        found: Counter[tuple[str, str]] = Counter()
        for component, begin_ns, end_ns, resource in self.slices:
            share_ns = min(end_ns, cycle.finish_ns) - max(begin_ns, cycle.nominal_ns)
            found[component, resource] += max(0, share_ns)
        return {who: share_ns for who, share_ns in found.most_common() if share_ns}


class _Do(Enum):
    EXECUTE = auto()
    LOCK = auto()
    UNLOCK = auto()


_RELEASE = ""
"""Of the execution before the first state."""


@dataclass
class _Step:
    do: _Do
    name: str
    """Of the state, or of the resource."""
    left_ns: int = 0
    ends: bool = False
    """Whether the state ends with it."""


@dataclass(eq=False)
class _Thread:
    member: Member
    cycle: Cycle
    priority: int
    """Its own, or what it inherits."""
    place: int = 0
    """In the queue of its priority; the least is the head."""
    steps: deque[_Step] = field(default_factory=deque)
    held: list[str] = field(default_factory=list)
    wanted: str = ""


def run(
    members: Sequence[Member], choices: Choices, *, most_jobs: int, until_repeated: bool = False
) -> Schedule:
    """From the epoch on, until a deadline is missed, or so many jobs.

    Of members that wake up at one instant with one priority, the first one goes first.

    `until_repeated`: the run also ends where it begins to repeat itself. Only for choices that depend on the
    member and its job alone.
    """
    return _Cpu(members, choices).run(most_jobs, until_repeated=until_repeated)


_Idle = frozenset[tuple[int, int, int, Job]]
"""Of each thread: its number, when it begins, its nominal instant, its job."""


class _Cpu:
    def __init__(self, members: Sequence[Member], choices: Choices) -> None:
        self._choices = choices
        self._now_ns = 0
        self._ready: list[_Thread] = []
        self._waiting: list[_Thread] = []  # for a resource
        self._asleep: list[tuple[int, int, _Thread]] = []  # by instant, then the order of members
        self._owners: dict[str, _Thread] = {}
        self._heirs: dict[str, _Thread] = {}  # of locks that were given back: have not run since
        self._head, self._tail = 0, 0  # places in a queue
        self._order = {member.task.name: number for number, member in enumerate(members)}
        self._cycles: list[Cycle] = []
        self._slices: list[Slice] = []
        for member in members:
            if member.task.jobs:
                job, nominal_ns = choices.first(member)
                self._sleep(_Thread(member, self._cycle(member, job, nominal_ns), member.machine.priority))

    def run(self, most_jobs: int, *, until_repeated: bool) -> Schedule:
        idle: set[_Idle] = set()
        while len(self._cycles) < most_jobs:
            check_time_limit()
            self._wake()
            if self._ready:
                missed = self._execute(min(self._ready, key=lambda one: (-one.priority, one.place)))
                if missed is not None:
                    return Schedule(self._cycles, self._slices, missed)
            elif self._asleep:
                if until_repeated:
                    state = self._idle()
                    if state in idle:
                        break
                    idle.add(state)
                self._now_ns = self._asleep[0][0]
            else:
                break
        return Schedule(self._cycles, self._slices, None)

    def _idle(self) -> _Idle:
        """What decides the future where no thread is ready. Instants are relative to the next release."""
        next_ns = self._asleep[0][0]
        return frozenset(
            (number, ready_ns - next_ns, thread.cycle.nominal_ns - next_ns, thread.cycle.job)
            for ready_ns, number, thread in self._asleep
        )

    def _cycle(self, member: Member, job: Job, nominal_ns: int) -> Cycle:
        return Cycle(member.task.name, job, nominal_ns, nominal_ns + self._choices.late_ns())

    def _sleep(self, thread: _Thread) -> None:
        number = self._order[thread.member.task.name]
        heapq.heappush(self._asleep, (thread.cycle.ready_ns, number, thread))

    def _wake(self) -> None:
        while self._asleep and self._asleep[0][0] <= self._now_ns:
            thread = heapq.heappop(self._asleep)[-1]
            self._to_tail(thread)
            self._ready.append(thread)
            self._begin(thread)

    def _to_tail(self, thread: _Thread) -> None:
        self._tail += 1
        thread.place = self._tail

    def _to_head(self, thread: _Thread) -> None:
        self._head -= 1
        thread.place = self._head

    def _begin(self, thread: _Thread) -> None:
        thread.cycle.ready_ns = self._now_ns
        self._cycles.append(thread.cycle)
        thread.steps = deque(self._steps(thread.member, thread.cycle.job))

    def _steps(self, member: Member, job: Job) -> Iterator[_Step]:
        times_ns = {state.name: state.time.ns or 0 for state in member.machine.states}
        longest = max(job.states, key=lambda name: times_ns[name], default="")
        if job.release_cost_ns:
            yield _Step(_Do.EXECUTE, _RELEASE, job.release_cost_ns)
        for name in job.states:
            left_ns = times_ns[name]
            for step in self._locking(member, name, left_ns) if name == longest else ():
                yield step
                left_ns -= step.left_ns
            yield _Step(_Do.EXECUTE, name, left_ns, ends=True)

    def _locking(self, member: Member, state: str, time_ns: int) -> Iterator[_Step]:
        sections: list[tuple[str, int]] = []
        for resource, length_ns in member.sections:
            left_ns = time_ns - sum(length for _, length in sections)
            sections += [(resource, min(length_ns, left_ns))] if left_ns else []
        if sections:
            left_ns = time_ns - sum(length_ns for _, length_ns in sections)
            yield _Step(_Do.EXECUTE, state, self._choices.before_locks_ns(left_ns))
        for resource, length_ns in sections:
            yield _Step(_Do.LOCK, resource)
            yield _Step(_Do.EXECUTE, state, length_ns)
            yield _Step(_Do.UNLOCK, resource)

    def _execute(self, thread: _Thread) -> Cycle | None:
        """Until its step ends or a thread wakes up; returns its cycle if that ended too late."""
        if not thread.steps:
            return self._finish(thread)
        step, cycle = thread.steps[0], thread.cycle
        if step.do == _Do.LOCK:
            self._lock(thread, step.name)
            return None
        if step.name != _RELEASE and (not cycle.states or cycle.states[-1][2] >= 0):
            cycle.states.append((step.name, self._now_ns, -1))
        end_ns = self._now_ns + step.left_ns
        until_ns = min(end_ns, self._asleep[0][0]) if self._asleep else end_ns
        if until_ns > self._now_ns:
            resource = thread.held[0] if thread.held else ""
            self._slices.append(Slice(cycle.component, self._now_ns, until_ns, resource))
        self._now_ns, step.left_ns = until_ns, end_ns - until_ns
        if step.left_ns:
            return None
        thread.steps.popleft()
        if step.ends:
            begin_ns = cycle.states[-1][1]
            cycle.states[-1] = (step.name, begin_ns, until_ns)
            limit_ns = thread.member.limits_ns.get(step.name, 0)
            if limit_ns and until_ns - begin_ns > limit_ns:
                cycle.finish_ns, cycle.too_long = until_ns, step.name
                return cycle
        while thread.steps and thread.steps[0].do == _Do.UNLOCK:  # before anybody wakes up at this instant
            self._unlock(thread, thread.steps.popleft().name)
        return None if thread.steps else self._finish(thread)

    def _lock(self, thread: _Thread, resource: str) -> None:
        heir = self._heirs.get(resource)
        is_behind = heir not in (None, thread) and heir.priority >= thread.priority
        if resource in self._owners or is_behind:
            self._ready.remove(thread)
            self._waiting.append(thread)
            thread.wanted = resource
        else:
            self._heirs.pop(resource, None)
            thread.steps.popleft()
            thread.held.append(resource)
            self._owners[resource] = thread
        self._inherit()

    def _unlock(self, thread: _Thread, resource: str) -> None:
        thread.held.remove(resource)
        del self._owners[resource]
        waiting = [other for other in self._waiting if other.wanted == resource]
        if waiting:
            first = max(waiting, key=lambda other: other.priority)
            self._waiting.remove(first)
            first.wanted = ""
            self._to_tail(first)
            self._ready.append(first)
            self._heirs[resource] = first
        self._inherit()

    def _inherit(self) -> None:
        """A holder has the priority of the most urgent thread that waits for it."""
        changed = True
        while changed:
            changed = False
            for thread in (*self._ready, *self._waiting):
                asking = [other.priority for other in self._waiting if other.wanted in thread.held]
                priority = max([thread.member.machine.priority, *asking])
                if priority != thread.priority:
                    changed = True
                    (self._to_tail if priority > thread.priority else self._to_head)(thread)
                    thread.priority = priority

    def _finish(self, thread: _Thread) -> Cycle | None:
        cycle = thread.cycle
        cycle.finish_ns = self._now_ns
        self._ready.remove(thread)
        following = self._choices.next(thread.member, cycle.job)
        if following is not None:
            job, later_ns = following
            cycle.next_ns = cycle.nominal_ns + later_ns
            self._go_on(thread, job)
        return cycle if self._now_ns > cycle.deadline_ns else None

    def _go_on(self, thread: _Thread, job: Job) -> None:
        machine, nominal_ns = thread.member.machine, thread.cycle.next_ns
        if nominal_ns < self._now_ns and machine.overrun != "catch_up":
            if machine.overrun != "skip" or not machine.period_ns:
                return  # it faults, or nobody knows its grid: it stops
            nominal_ns += -(-(self._now_ns - nominal_ns) // machine.period_ns) * machine.period_ns
        thread.cycle = self._cycle(thread.member, job, nominal_ns)
        if nominal_ns > self._now_ns:
            self._sleep(thread)
        else:  # it does not sleep, so it keeps its place: the first of its priority
            self._ready.append(thread)
            self._begin(thread)
