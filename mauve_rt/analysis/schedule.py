"""A run of the components of one CPU under SCHED_FIFO, in virtual time, until one misses its deadline.

Each execution takes the time that is known of its state, to the end. What a model leaves open, `Choices`
decide: which way a component takes, when an event comes, how late a thread begins. As the Linux kernel does
it, threads are queued, not jobs: one that wakes up goes to the end of the queue of its priority, one that is
preempted stays where it is, one that goes on with the next job without a sleep does, too.
"""

import heapq
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.machines import FOREVER_NS, Machine


@dataclass(frozen=True)
class Member:
    """A component of the run: the cost of each of its jobs is known."""

    machine: Machine
    task: DigraphTask


class Choices(Protocol):
    """Decides what the model leaves open."""

    def first(self, member: Member) -> tuple[Job, int]:
        """The job that a component begins with, and its nominal instant after the epoch."""

    def next(self, member: Member, job: Job) -> tuple[Job, int] | None:
        """What follows a job, and how long after its nominal instant; None: nothing."""

    def late_ns(self) -> int:
        """How long after its nominal instant a thread begins."""


class Slice(NamedTuple):
    """A component had the processor."""

    component: str
    begin_ns: int
    end_ns: int


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

    @property
    def deadline_ns(self) -> int:
        """The instant."""
        return self.nominal_ns + self.job.deadline_ns


class Schedule(NamedTuple):
    """What happened, and the cycle that missed its deadline, the last one to finish; None: none did."""

    cycles: list[Cycle]
    slices: list[Slice]
    missed: Cycle | None

    def shares_ns(self, cycle: Cycle) -> dict[str, int]:
        """Who had the processor how long from a cycle's nominal instant to its finish, the longest first."""
        found: Counter[str] = Counter()
        for component, begin_ns, end_ns in self.slices:
            found[component] += max(0, min(end_ns, cycle.finish_ns) - max(begin_ns, cycle.nominal_ns))
        return {name: share_ns for name, share_ns in found.most_common() if share_ns}


@dataclass(eq=False)
class _Thread:
    member: Member
    cycle: Cycle
    left: deque[list[str | int]] = field(default_factory=deque)  # state and time of what is to be executed


def run(members: Sequence[Member], choices: Choices, *, most_jobs: int) -> Schedule:
    """From the epoch on, until a deadline is missed, or so many jobs.

    Of members that wake up at one instant with one priority, the first one goes first.
    """
    return _Cpu(members, choices).run(most_jobs)


class _Cpu:
    def __init__(self, members: Sequence[Member], choices: Choices) -> None:
        self._choices = choices
        self._now_ns = 0
        self._ready: list[tuple[int, int, _Thread]] = []  # most urgent first, then who came first
        self._asleep: list[tuple[int, int, _Thread]] = []  # by instant, then the order of members
        self._came = 0
        self._order = {member.task.name: number for number, member in enumerate(members)}
        self._cycles: list[Cycle] = []
        self._slices: list[Slice] = []
        for member in members:
            if member.task.jobs:
                job, nominal_ns = choices.first(member)
                self._sleep(_Thread(member, self._cycle(member, job, nominal_ns)))

    def run(self, most_jobs: int) -> Schedule:
        while len(self._cycles) < most_jobs:
            self._wake()
            if self._ready:
                missed = self._execute(self._ready[0][-1])
                if missed is not None:
                    return Schedule(self._cycles, self._slices, missed)
            elif self._asleep:
                self._now_ns = self._asleep[0][0]
            else:
                break
        return Schedule(self._cycles, self._slices, None)

    def _cycle(self, member: Member, job: Job, nominal_ns: int) -> Cycle:
        return Cycle(member.task.name, job, nominal_ns, nominal_ns + self._choices.late_ns())

    def _sleep(self, thread: _Thread) -> None:
        number = self._order[thread.member.task.name]
        heapq.heappush(self._asleep, (thread.cycle.ready_ns, number, thread))

    def _wake(self) -> None:
        while self._asleep and self._asleep[0][0] <= self._now_ns:
            thread = heapq.heappop(self._asleep)[-1]
            self._came += 1
            heapq.heappush(self._ready, (-thread.member.machine.priority, self._came, thread))
            self._begin(thread)

    def _begin(self, thread: _Thread) -> None:
        thread.cycle.ready_ns = self._now_ns
        self._cycles.append(thread.cycle)
        times_ns = {state.name: state.time.ns or 0 for state in thread.member.machine.states}
        thread.left = deque([name, times_ns[name]] for name in thread.cycle.job.states)

    def _execute(self, thread: _Thread) -> Cycle | None:
        """Until its state ends or somebody wakes up; returns its cycle if that ended too late."""
        cycle = thread.cycle
        if not thread.left:
            return self._finish(thread)
        name, left_ns = str(thread.left[0][0]), int(thread.left[0][1])
        if not cycle.states or cycle.states[-1][2] >= 0:
            cycle.states.append((name, self._now_ns, -1))
        end_ns = self._now_ns + left_ns
        until_ns = min(end_ns, self._asleep[0][0]) if self._asleep else end_ns
        if until_ns > self._now_ns:
            self._slices.append(Slice(cycle.component, self._now_ns, until_ns))
        self._now_ns = until_ns
        thread.left[0][1] = end_ns - until_ns
        if until_ns < end_ns:
            return None
        thread.left.popleft()
        cycle.states[-1] = (name, cycle.states[-1][1], until_ns)
        return None if thread.left else self._finish(thread)

    def _finish(self, thread: _Thread) -> Cycle | None:
        cycle = thread.cycle
        cycle.finish_ns = self._now_ns
        heapq.heappop(self._ready)
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
            heapq.heappush(self._ready, (-machine.priority, -1, thread))
            self._begin(thread)
