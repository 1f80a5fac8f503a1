"""Random digraph tasks, and runs of them: paths that a component could take."""

from collections.abc import Sequence
from itertools import pairwise
from random import Random

from schedule_simulation import LOCK, RUN, UNLOCK, Release, Step

from mauve_rt.analysis.critical_section import CriticalSection
from mauve_rt.analysis.digraph import DigraphTask, Job


def random_digraph(random: Random, name: str, *, share: float, most_waits: int = 3) -> DigraphTask:
    """Jobs between a few waits; its utilization is near `share`."""
    waits = {f"W{number}": random.randint(4, 40) for number in range(random.randint(1, most_waits))}
    jobs = []
    for after in waits:
        for until in random.sample([*waits], random.randint(1, len(waits))):
            cost = max(1, round(share * waits[until] * random.uniform(0.3, 1.2)))
            jobs.append(Job(after, (), cost, until, waits[until], deadline_ns=10**6))
    return DigraphTask(name, tuple(jobs))


def random_sections(random: Random, task: DigraphTask) -> tuple[CriticalSection, ...]:
    """Sections of some of three resources, one after another in a job."""
    resources = [name for name in ("a", "b", "c") if random.random() < 0.5]
    longest = max(job.cost_ns or 1 for job in task.jobs)
    return tuple(CriticalSection(resource=name, length_ns=random.randint(1, longest)) for name in resources)


def random_run(
    random: Random,
    task: DigraphTask,
    *,
    until: int,
    jitter: int,
    dense: bool,
    sections: Sequence[CriticalSection] = (),
) -> list[Release]:
    """Jobs along one path; `dense`: each as early as it may be, from the first instant on."""
    job = random.choice(task.jobs)
    arrival = 0 if dense else random.randint(0, 30)
    releases = []
    while arrival < until:
        late = random.choice((0, jitter))
        start = arrival + jitter if dense and not releases else arrival + late
        releases.append((arrival, start, job))
        arrival += job.separation_ns + (0 if dense else random.choice((0, 0, random.randint(0, 20))))
        following = task.after(job)
        if not following:
            break
        job = random.choice(following)
    starts = [start for _, start, _ in releases]
    assert all(one <= other for one, other in pairwise(starts)), "jitter is below the separations"
    return [
        Release(arrival, start, _program(random, job.cost_ns or 0, sections))
        for arrival, start, job in releases
    ]


def _program(random: Random, cost: int, sections: Sequence[CriticalSection]) -> list[Step]:
    """An execution of this cost; sections as long as they may be, as far as they are in it."""
    program: list[Step] = []
    for section in random.sample(sections, len(sections)):
        before = random.randint(0, cost // 3)
        held = min(section.length_ns, cost - before)
        if held > 0:
            program += [(RUN, before)] if before else []
            program += [(LOCK, section.resource), (RUN, held), (UNLOCK, section.resource)]
            cost -= before + held
    return [*program, (RUN, cost)] if cost else program
