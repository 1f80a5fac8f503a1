"""SCHED_FIFO on one CPU with priority inheritance, simulated: a second oracle for the analysis.

As the Linux kernel does it: threads, not jobs, are queued; a thread that wakes up goes to the end of the
queue of its priority, one that is preempted stays at the head, one with a raised priority goes to the end,
one with a lowered priority to the head. A thread with a released job goes on without sleeping.
"""

import heapq
from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count, pairwise
from random import Random
from types import MappingProxyType
from typing import Protocol

from sporadic_tasks import SporadicTask

from mauve_rt.analysis.critical_section import CriticalSection

RUN, LOCK, UNLOCK, WAIT = range(4)
Step = tuple[int, int | str]  # RUN and WAIT: ns; LOCK and UNLOCK: the resource


@dataclass
class Release:
    """One job: its arrival, its release after the jitter, its program."""

    arrival_ns: int
    release_ns: int
    program: list[Step]


class Scheduled(Protocol):
    """A task or component, as far as the scheduler knows it."""

    @property
    def name(self) -> str: ...

    @property
    def priority(self) -> int: ...


@dataclass(eq=False)
class Thread:
    task: Scheduled
    jobs: deque[Release]
    steps: deque[Step] = field(default_factory=deque)
    held: list[str] = field(default_factory=list)
    wanted: str = ""
    wants_since: int = 0
    priority: int = 0
    in_job: bool = False
    began_ns: int = -1


def simulated_jobs(
    tasks: Sequence[Scheduled], releases: dict[str, list[Release]]
) -> dict[str, list[tuple[int, int]]]:
    """Of each task the first instant at which each job executes, and its finish."""
    cpu = _Cpu(tasks, releases)
    cpu.run()
    return cpu.finished


def simulate(tasks: Sequence[Scheduled], releases: dict[str, list[Release]]) -> dict[str, int]:
    """The longest response time (ns) of each task, from arrival to finish, until all jobs are done."""
    return _Cpu(tasks, releases).run()


class _Cpu:
    def __init__(self, tasks: Sequence[Scheduled], releases: dict[str, list[Release]]) -> None:
        self.threads = [Thread(task, deque(releases[task.name]), priority=task.priority) for task in tasks]
        self.now = 0
        self.queues: dict[int, deque[Thread]] = defaultdict(deque)
        self.owners: dict[str, Thread] = {}
        self.heirs: dict[str, Thread] = {}  # woken for a lock: one more urgent may take it first
        self.longest = dict.fromkeys(releases, 0)
        self.finished: dict[str, list[tuple[int, int]]] = {name: [] for name in releases}
        self.order = count()
        self.events: list[tuple[int, int, Thread]] = []
        for thread in self.threads:
            self._sleep_until_release(thread)

    def run(self) -> dict[str, int]:
        while True:
            while self.events and self.events[0][0] <= self.now:
                self._wake(heapq.heappop(self.events)[2])
            runnable = [priority for priority, queue in self.queues.items() if queue]
            if runnable:
                self._execute(self.queues[max(runnable)][0])
            elif self.events:
                self.now = self.events[0][0]
            else:
                assert not any(thread.steps or thread.jobs for thread in self.threads), "deadlock"
                return self.longest

    def _wake(self, thread: Thread) -> None:
        if not thread.in_job:
            self._begin(thread)
        self.queues[thread.priority].append(thread)

    def _execute(self, thread: Thread) -> None:
        if not thread.steps:
            self._finish(thread)
            return
        kind, value = thread.steps[0]
        if kind == RUN:
            thread.began_ns = self.now if thread.began_ns < 0 else thread.began_ns
            end = self.now + int(value)
            until = min(end, self.events[0][0]) if self.events else end
            thread.steps[0] = (RUN, end - until)
            self.now = until
            if until == end:  # intervals of execution are half-open: ends come before arrivals
                thread.steps.popleft()
                while thread.steps and thread.steps[0][0] == UNLOCK:
                    self._unlock(thread, str(thread.steps[0][1]))
                if not thread.steps:
                    self._finish(thread)
        elif kind == WAIT:
            thread.steps.popleft()
            self._sleep(thread, self.now + int(value))
        elif kind == LOCK:
            self._lock(thread, str(value))
        else:
            self._unlock(thread, str(value))

    def _finish(self, thread: Thread) -> None:
        done = thread.jobs.popleft()
        name = thread.task.name
        self.longest[name] = max(self.longest[name], self.now - done.arrival_ns)
        self.finished[name].append((thread.began_ns, self.now))
        thread.began_ns = -1
        if thread.jobs and thread.jobs[0].release_ns <= self.now:
            self._begin(thread)
        else:
            thread.in_job = False
            self.queues[thread.priority].remove(thread)
            self._sleep_until_release(thread)

    def _begin(self, thread: Thread) -> None:
        thread.in_job = True
        thread.steps.extend(thread.jobs[0].program)

    def _sleep_until_release(self, thread: Thread) -> None:
        if thread.jobs:
            heapq.heappush(self.events, (thread.jobs[0].release_ns, next(self.order), thread))

    def _sleep(self, thread: Thread, until: int) -> None:
        self.queues[thread.priority].remove(thread)
        heapq.heappush(self.events, (until, next(self.order), thread))

    def _lock(self, thread: Thread, resource: str) -> None:
        heir = self.heirs.get(resource, thread)
        is_free = resource not in self.owners and (heir is thread or heir.priority < thread.priority)
        if is_free:
            self.heirs.pop(resource, None)
            thread.steps.popleft()
            self.owners[resource] = thread
            thread.held.append(resource)
        else:
            self.queues[thread.priority].remove(thread)
            thread.wanted, thread.wants_since = resource, next(self.order)
        self._inherit()

    def _unlock(self, thread: Thread, resource: str) -> None:
        thread.steps.popleft()
        thread.held.remove(resource)
        del self.owners[resource]
        waiting = [other for other in self.threads if other.wanted == resource]
        if waiting:
            first = max(waiting, key=lambda other: (other.priority, -other.wants_since))
            first.wanted = ""
            self.heirs[resource] = first
            self.queues[first.priority].append(first)
        self._inherit()

    def _inherit(self) -> None:
        changed = True
        while changed:
            changed = False
            for thread in self.threads:
                asking = [other.priority for other in self.threads if other.wanted in thread.held]
                priority = max([thread.task.priority, *asking])
                if priority != thread.priority:
                    changed = True
                    self._set_priority(thread, priority)

    def _set_priority(self, thread: Thread, priority: int) -> None:
        before, thread.priority = thread.priority, priority
        if thread in self.queues[before]:
            self.queues[before].remove(thread)
            if priority > before:
                self.queues[priority].append(thread)
            else:
                self.queues[priority].appendleft(thread)


Waits = Mapping[str, Sequence[int]]  # of a task: the length (ns) of each wait of a job


def longest_simulated(
    random: Random, tasks: list[SporadicTask], *, runs: int = 4, waits: Waits = MappingProxyType({})
) -> dict[str, int]:
    """The longest response time (ns) of each task in some runs with random releases and programs."""
    longest = {task.name: 0 for task in tasks}
    for _ in range(runs):
        releases = random_releases(random, tasks, jobs=8, full=random.random() < 0.8, waits=waits)
        for name, response_ns in simulate(tasks, releases).items():
            longest[name] = max(longest[name], response_ns)
    return longest


def random_releases(
    random: Random, tasks: list[SporadicTask], *, jobs: int, full: bool, waits: Waits
) -> dict[str, list[Release]]:
    """Releases that respect the tasks' parameters: many at the same instant, some late, some jobs shorter."""
    found: dict[str, list[Release]] = {}
    ties = random.randint(0, 30)
    for task in tasks:
        arrival = random.choice((ties, ties - task.jitter_ns, random.randint(0, 30)))
        delay_all = random.choice((0.2, 0.5, 0.9))
        found[task.name] = []
        last_release = 0
        for number in range(jobs):
            delay = task.jitter_ns if number == 0 else random.choice((0, random.randint(0, task.jitter_ns)))
            last_release = max(last_release, arrival + delay, 0)
            program = random_program(random, task, full=full, waits_ns=waits.get(task.name, ()))
            # A release is never more than the jitter after its arrival: arrivals before 0 are released by 0.
            found[task.name].append(
                Release(max(arrival, last_release - task.jitter_ns), last_release, program)
            )
            late = random.randint(1, 6) if random.random() > delay_all else 0
            arrival = found[task.name][-1].arrival_ns + task.separation_ns + late * (random.random() < 0.3)
    return found


def random_program(
    random: Random, task: SporadicTask, *, full: bool, waits_ns: Sequence[int] = ()
) -> list[Step]:
    """The task's sections at random places among its execution and its waits, which are part of its cost."""
    inner: dict[str, list[CriticalSection]] = defaultdict(list)
    for section in task.sections:
        inner[section.inside].append(section)

    def execution(length: int, sections: list[CriticalSection]) -> list[list[Step]]:
        parts = [_section(section) for section in sections]
        rest = length - sum(section.length_ns for section in sections)
        used = rest if full else random.randint(min(1, rest), rest)
        cuts = sorted(random.randint(0, used) for _ in parts)
        runs = [end - start for start, end in pairwise([0, *cuts, used])]
        steps: list[list[Step]] = []
        for index, run in enumerate(runs):
            steps.append([(RUN, run)] if run else [])
            if index < len(parts):
                steps.append(parts[index])
        return steps

    def _section(section: CriticalSection) -> list[Step]:
        inside = [step for part in execution(section.length_ns, inner[section.resource]) for step in part]
        return [(LOCK, section.resource), *inside, (UNLOCK, section.resource)]

    groups: list[list[Step]] = []
    for group in execution(task.cost_ns - sum(waits_ns), inner[""]):
        if len(group) == 1 and int(group[0][1]) > 1:  # a wait can be within plain execution, too
            cut = random.randint(0, int(group[0][1]))
            groups += [[(RUN, cut)] if cut else [], [(RUN, int(group[0][1]) - cut)]]
        else:
            groups.append(group)
    groups = [group for group in groups if group and group != [(RUN, 0)]]
    for wait_ns in waits_ns:  # never the last step: a job ends by executing
        groups.insert(random.randrange(len(groups)), [(WAIT, wait_ns)])
    return [step for group in groups for step in group]
