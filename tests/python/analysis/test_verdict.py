"""Verdicts: schedulable, not (with a run that shows it), not proved, not provable; and the runs."""

import re
from dataclasses import replace
from itertools import pairwise
from math import gcd
from random import Random

import networkx as nx
import pytest
from analysis_machines import MS, connected, event, execution, machine, wait
from random_digraphs import random_digraph
from schedule_simulation import LOCK, RUN, UNLOCK, Release, Step, simulate

from mauve_rt.analysis.bounds import Subject, bounds_of
from mauve_rt.analysis.digraph import START, DigraphTask, Job, digraph_of, period_of
from mauve_rt.analysis.digraph_times import Component
from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.schedule import Cycle, Member, Schedule, run
from mauve_rt.analysis.verdict import Outcome, Verdict, judge
from mauve_rt.analysis.witness import witness_of


def loop(name: str, cost_ms: float, period_ms: int, priority: int, **told: object) -> Machine:
    return machine(
        execution("Run", "Pause", wcet_ms=cost_ms, initial=True),
        wait("Pause", "Run", ms=period_ms),
        name=name,
        priority=priority,
        **told,
    )


def verdict(*machines: Machine, wakeup_ns: int = 0) -> Verdict:
    subjects = [Subject.of(one) for one in machines]
    return judge(subjects, bounds_of(subjects, wakeup_ns=wakeup_ns), wakeup_ns=wakeup_ns)


# ---- the sentence


def test_schedulable() -> None:
    found = verdict(loop("high", 1, 4, 60), loop("low", 3, 8, 50))
    assert found.sentence == "schedulable: every component meets its deadline"
    assert found.witness is None


def test_not_schedulable_says_who_misses_when_and_what_held_it_up() -> None:
    found = verdict(
        loop("high", 2, 5, 60), loop("mid", 3, 20, 55), loop("low", 4, 20, 50, deadline_ns=10 * MS)
    )
    assert found.sentence == (
        "not schedulable: low misses its deadline at 10.000 ms after the start and ends at 13.000 ms: "
        "6.000 ms of high + 3.000 ms of mid + 4.000 ms of its own"
    )


def test_a_late_wake_up_is_named() -> None:
    assert "+ 0.500 ms until its thread begins" in verdict(loop("one", 9.8, 10, 50), wakeup_ns=MS // 2).why


def test_an_offset_that_prevents_the_miss_proves_that_there_is_none() -> None:
    high, low = loop("high", 4, 10, 60), loop("low", 5, 10, 50, offset_ns=5 * MS, deadline_ns=6 * MS)
    assert verdict(high, low).outcome == Outcome.SCHEDULABLE
    assert verdict(high, replace(low, offset_ns=0)).outcome == Outcome.NOT_SCHEDULABLE


def test_a_bound_with_offsets_that_is_too_long_is_named_as_such() -> None:
    """Blocking counts for each job, and no run has the lock held at that time."""
    low = loop("low", 4, 10, 50, offset_ns=5 * MS, deadline_ns=MS * 9 // 2, ports=connected(map=3))
    below = loop("below", 1, 40, 40, offset_ns=12 * MS, ports=connected(map=3))
    found = verdict(loop("high", 3, 10, 60), low, below)
    assert found.why == (
        "low has a bound of 5.000 ms (with offsets) and a deadline of 4.500 ms; "
        "none of 64 runs misses a deadline"
    )


def test_what_is_missing_is_not_provable_but_a_miss_is_a_miss() -> None:
    unknown = loop("unknown", 0, 10, 70)
    assert verdict(unknown, loop("one", 1, 10, 50)).sentence == (
        "not provable: something is missing of unknown"
    )
    assert verdict(unknown, loop("one", 11, 10, 50)).outcome == Outcome.NOT_SCHEDULABLE


def test_a_job_longer_than_its_wait_misses_its_deadline() -> None:
    found = verdict(loop("one", 12, 10, 50))
    assert found.why == (
        "one misses its deadline at 10.000 ms after the start and ends at 12.000 ms: 12.000 ms of its own"
    )


def test_another_cpu_has_its_own_run() -> None:
    found = verdict(loop("good", 9, 10, 90), loop("bad", 11, 10, 50, cpus=[1]))
    assert found.witness is not None
    assert {cycle.component for cycle in found.witness.cycles} == {"bad"}


def test_an_event_can_come_at_the_worst_time() -> None:
    sporadic = machine(
        event("Await", "Run", least_ms=20, initial=True),
        execution("Run", "Await", wcet_ms=4),
        name="sporadic",
        priority=60,
    )
    found = verdict(sporadic, loop("low", 5, 10, 50, offset_ns=3 * MS, deadline_ns=8 * MS))
    assert found.outcome == Outcome.NOT_SCHEDULABLE
    assert "4.000 ms of sporadic + 5.000 ms of its own" in found.why


def test_a_lock_that_one_below_holds_is_named() -> None:
    user = loop("user", 1, 10, 60, deadline_ns=3 * MS, ports=connected(map=3))
    holder = loop("holder", 5, 27, 40, ports=connected(map=3))
    found = verdict(user, loop("between", 1, 10, 50), holder)
    assert found.outcome == Outcome.NOT_SCHEDULABLE
    assert found.witness is not None
    assert re.search(
        r"^user misses its deadline at .*: 2\.\d+ ms blocking by map, which holder holds \+ 1\.000 ms",
        found.why,
    )
    assert verdict(user, loop("between", 1, 10, 50)).outcome == Outcome.SCHEDULABLE


# ---- the run


class Drawn:
    """Any way, any lateness; what was taken, by component."""

    def __init__(self, random: Random) -> None:
        self.random = random
        self.before: list[int] = []

    def first(self, member: Member) -> tuple[Job, int]:
        return self.random.choice(member.task.jobs), self.random.randint(0, 30)

    def next(self, member: Member, job: Job) -> tuple[Job, int] | None:
        following = member.task.after(job)
        later = job.separation_ns + self.random.choice((0, 0, self.random.randint(0, 20)))
        return (self.random.choice(following), later) if following else None

    def late_ns(self) -> int:
        return self.random.choice((0, 0, 2))

    def before_locks_ns(self, left_ns: int) -> int:
        self.before.append(self.random.randint(0, left_ns))
        return self.before[-1]


def member(task: DigraphTask, priority: int, sections: tuple[tuple[str, int], ...]) -> Member:
    """Each job of a state of its own."""
    states = [
        execution(f"{job.after}-{job.until}", job.until, bound_ms=(job.cost_ns or 0) / MS)
        for job in task.jobs
    ]
    jobs = tuple(
        Job(job.after, (f"{job.after}-{job.until}",), job.cost_ns, job.until, job.separation_ns, 10**9)
        for job in task.jobs
    )
    one = machine(*states, name=task.name, priority=priority, overrun="catch_up")
    return Member(one, DigraphTask(task.name, jobs), sections)


def random_schedule(seed: int, *, locks: bool = False) -> tuple[list[Member], Schedule, list[int]]:
    """The members, what they did, and how long each job executed before its first lock."""
    random = Random(seed)  # noqa: S311 - not for secrets
    members = []
    for number in range(3):
        resources = random.sample("AB", random.randint(1, 2)) if locks else []
        sections = tuple((resource, random.randint(1, 4)) for resource in resources)
        task = random_digraph(random, f"T{number}", share=0.25)
        members.append(member(task, random.randint(1, 3), sections))
    choices = Drawn(random)
    return members, run(members, choices, most_jobs=60), choices.before


def program(cycle: Cycle, sections: tuple[tuple[str, int], ...], before_ns: int) -> list[Step]:
    """What the other simulation executes."""
    left_ns, steps = cycle.job.cost_ns or 0, [] if not sections else [(RUN, before_ns)]
    for resource, most_ns in sections:
        length_ns = min(most_ns, left_ns)
        if length_ns:
            steps += [(LOCK, resource), (RUN, length_ns), (UNLOCK, resource)]
            left_ns -= length_ns
    return [*steps, (RUN, left_ns - (before_ns if sections else 0))]


@pytest.mark.parametrize("locks", [False, True])
def test_runs_are_those_of_the_other_simulation(*, locks: bool) -> None:
    compared = delayed = 0
    for seed in range(400):
        members, schedule, before = random_schedule(seed, locks=locks)
        urgency = {one.task.name: one.machine.priority for one in members}
        begins = [(urgency[cycle.component], cycle.ready_ns) for cycle in schedule.cycles]
        if len(set(begins)) < len(begins):
            continue  # who goes first is left open
        components = [Component(one.task, one.machine.priority) for one in members]
        sections = {one.task.name: one.sections for one in members}
        releases: dict[str, list[Release]] = {name: [] for name in urgency}
        done: dict[str, list[Cycle]] = {name: [] for name in urgency}
        for number, cycle in enumerate(schedule.cycles):
            steps = program(cycle, sections[cycle.component], before[number] if locks else 0)
            done[cycle.component].append(cycle)
            releases[cycle.component].append(Release(cycle.nominal_ns, cycle.ready_ns, steps))
        expected = simulate(components, releases)
        for name, cycles in done.items():
            if cycles and all(one.finish_ns >= 0 for one in cycles):
                assert max(one.finish_ns - one.nominal_ns for one in cycles) == expected[name], (seed, name)
                compared += 1
        delayed += any(
            resource and urgency[who] < urgency[cycle.component]
            for cycle in schedule.cycles
            if cycle.finish_ns >= 0
            for who, resource in schedule.shares_ns(cycle)
        )
    assert compared > 200
    assert bool(delayed) == locks, "by a holder of lower priority"


class AtOnce(Drawn):
    """Each job at its offset, once; a lock as the last of a job."""

    def __init__(self) -> None:
        pass

    def first(self, member: Member) -> tuple[Job, int]:
        return member.task.jobs[0], member.machine.offset_ns

    def next(self, _member: Member, _job: Job) -> None:
        return None

    def late_ns(self) -> int:
        return 0

    def before_locks_ns(self, left_ns: int) -> int:
        return left_ns


def test_a_more_urgent_thread_takes_a_lock_before_the_one_that_was_woken_for_it() -> None:
    """Low gives the lock back at 10; mid has waited for it since 5; high comes at 10 and is first."""

    def of(name: str, priority: int, offset: int, *, cost: int, held: int) -> Member:
        one = machine(execution("Run", "End", wcet_ms=cost / MS), name=name, priority=priority)
        job = Job("Start", ("Run",), cost, "End", 1000, 10**9)
        sections = (("A", held),)
        return Member(replace(one, offset_ns=offset), DigraphTask(name, (job,)), sections)

    members = [
        of("low", 1, 0, cost=10, held=10),
        of("mid", 2, 5, cost=4, held=4),
        of("high", 3, 10, cost=3, held=3),
    ]
    done = {cycle.component: cycle.finish_ns for cycle in run(members, AtOnce(), most_jobs=9).cycles}
    assert (done["high"], done["mid"]) == (13, 17)
    components = [Component(one.task, one.machine.priority) for one in members]
    programs = {"low": (0, 10), "mid": (5, 4), "high": (10, 3)}
    releases = {
        name: [Release(at, at, [(LOCK, "A"), (RUN, held), (UNLOCK, "A")])]
        for name, (at, held) in programs.items()
    }
    assert simulate(components, releases) == {"low": 10, "mid": 12, "high": 3}


def test_one_has_the_processor_and_it_is_one_of_the_most_urgent() -> None:
    for seed in range(200):
        members, schedule, _ = random_schedule(seed)
        urgency = {one.task.name: one.machine.priority for one in members}
        assert all(one.end_ns <= other.begin_ns for one, other in pairwise(schedule.slices)), seed
        for name, begin_ns, end_ns, _ in schedule.slices:
            pending = {
                cycle.component
                for cycle in schedule.cycles
                if cycle.ready_ns < end_ns and (cycle.finish_ns < 0 or cycle.finish_ns > begin_ns)
            }
            assert urgency[name] == max(urgency[one] for one in pending), (seed, begin_ns)


def test_the_witness_is_the_same_each_time() -> None:
    def found() -> Schedule | None:
        machines = [loop("a", 3, 10, 50), loop("b", 5, 14, 50), loop("c", 3, 17, 40, deadline_ns=11 * MS)]
        return witness_of([Member(one, digraph_of(one)) for one in machines])

    assert found() is not None
    assert found() == found()


class Regular(Drawn):
    """Each job as early as it may be: a run that repeats itself."""

    def __init__(self) -> None:
        pass

    def first(self, member: Member) -> tuple[Job, int]:
        return member.task.jobs[0], 0

    def next(self, member: Member, job: Job) -> tuple[Job, int]:
        return member.task.after(job)[0], job.separation_ns

    def late_ns(self) -> int:
        return 0

    def before_locks_ns(self, left_ns: int) -> int:
        return left_ns


def test_a_run_ends_where_it_repeats_itself() -> None:
    machines = [loop("a", 1, 4, 60), loop("b", 1, 6, 50)]
    members = [Member(one, digraph_of(one)) for one in machines]
    found = run(members, Regular(), most_jobs=1000, until_repeated=True)
    assert found.missed is None
    assert [(cycle.component, cycle.nominal_ns // MS) for cycle in found.cycles] == [
        *(("a", 0), ("b", 0), ("a", 4), ("b", 6), ("a", 8)),
        *(("a", 12), ("b", 12)),
    ]
    assert len(run(members, Regular(), most_jobs=1000).cycles) == 1000


def test_a_run_that_ends_where_it_repeats_itself_finds_each_miss() -> None:
    missed = 0
    for seed in range(100):
        random = Random(seed)  # noqa: S311 - not for secrets
        machines = [
            loop(f"T{number}", random.randint(1, 4), random.randint(4, 14), 1 + number, overrun=overrun)
            for number, overrun in enumerate(random.choices(("catch_up", "skip", "fault"), k=3))
        ]
        members = [Member(one, digraph_of(one)) for one in machines]
        long = run(members, Regular(), most_jobs=2000)
        short = run(members, Regular(), most_jobs=2000, until_repeated=True)
        assert short.missed == long.missed, seed
        assert short.cycles == long.cycles[: len(short.cycles)], seed
        missed += long.missed is not None
    assert 20 < missed < 80


def test_no_miss_is_found_where_the_bounds_are_met() -> None:
    met = missed = 0
    for seed in range(60):
        random = Random(seed)  # noqa: S311 - not for secrets
        machines = [
            loop(f"T{number}", random.randint(1, 6), random.randint(8, 30), 1 + number) for number in range(3)
        ]
        subjects = [Subject.of(one) for one in machines]
        found = witness_of([Member(one.machine, one.task) for one in subjects])
        if all(bound.meets_deadline for bound in bounds_of(subjects).values()):
            met += 1
            assert found is None, seed
        else:
            missed += found is not None
    assert met > 15
    assert missed > 5


class Twice(Drawn):
    """A short job, and from then on long ones."""

    def __init__(self, short: Job, long: Job) -> None:
        self.jobs = (short, long)

    def first(self, _member: Member) -> tuple[Job, int]:
        return self.jobs[0], 0

    def next(self, _member: Member, _job: Job) -> tuple[Job, int]:
        return self.jobs[1], 10 * MS

    def late_ns(self) -> int:
        return 0


@pytest.mark.parametrize(
    ("policy", "nominals"), [("catch_up", [0, 10, 20]), ("skip", [0, 10, 30]), ("fault", [0, 10])]
)
def test_after_an_overrun_it_goes_on_as_its_policy_says(policy: str, nominals: list[int]) -> None:
    one = machine(
        execution("Short", "Pause", bound_ms=1),
        execution("Long", "Pause", bound_ms=12),
        overrun=policy,
        period_ns=10 * MS,
    )
    jobs = [Job("Pause", (name,), 1, "Pause", 10 * MS, 100 * MS) for name in ("Short", "Long")]
    found = run([Member(one, DigraphTask("c", tuple(jobs)))], Twice(*jobs), most_jobs=3)
    assert [cycle.nominal_ns // MS for cycle in found.cycles] == nominals


# ---- the grid


def test_the_period_is_the_greatest_divisor_of_all_cycles() -> None:
    for seed in range(100):
        task = random_digraph(Random(seed), "T", share=0.5, most_waits=4)  # noqa: S311 - not for secrets
        lengths = {job.until: job.separation_ns for job in task.jobs}
        graph = nx.DiGraph((job.after, job.until) for job in task.jobs)
        cycles = [sum(lengths[wait] for wait in cycle) for cycle in nx.simple_cycles(graph)]
        assert period_of(task) == gcd(*cycles), seed


def test_what_leads_into_the_cycle_does_not_count() -> None:
    assert period_of(digraph_of(loop("one", 1, 10, 50))) == 10 * MS
    job = Job(START, (), 1, "A", 7, 7)
    assert period_of(DigraphTask("c", (job, Job("A", (), 1, "B", 3, 3), Job("B", (), 1, "A", 7, 7)))) == 10
    assert period_of(DigraphTask("c", (job,))) == 0
