"""Random task sets for tests of the analysis: reproducible from a seed.

Utilizations: UUniFast-discard (Davis, Burns, "Improved priority assignment for global fixed priority
pre-emptive scheduling in multiprocessor real-time systems", 2011). Periods with their share, and the factors
from average to worst execution: Kramer, Ziegenbein, Hamann, "Real world automotive benchmarks for free",
WATERS 2015, without the angle-synchronous tasks.
"""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import floor
from random import Random
from typing import TypeAlias

from sporadic_tasks import SporadicTask

from mauve_rt.analysis.critical_section import CriticalSection

MS = 1_000_000
Change: TypeAlias = Callable[[Random, list[SporadicTask]], list[SporadicTask]]
# Period (ms): share (%), least and largest factor from average to worst execution.
WATERS_2015 = {
    1: (3, 1.30, 29.11),
    2: (2, 1.54, 19.04),
    5: (2, 1.13, 18.44),
    10: (25, 1.06, 30.03),
    20: (25, 1.06, 15.61),
    50: (3, 1.13, 7.76),
    100: (20, 1.02, 8.88),
    200: (1, 1.03, 4.90),
    1000: (4, 1.84, 4.75),
}


def utilizations(random: Random, *, count: int, total: float) -> list[float]:
    """UUniFast-discard: uniform among all vectors of this sum with no entry above 1."""
    while True:
        shares, rest = [], total
        for left in range(count - 1, 0, -1):
            next_rest = rest * random.random() ** (1 / left)
            shares.append(rest - next_rest)
            rest = next_rest
        shares.append(rest)
        if max(shares) <= 1:
            return shares


def waters_set(random: Random, *, count: int, total: float, grain_ns: int = 1) -> list[SporadicTask]:
    """Tasks of one CPU with distinct priorities in random order.

    UUniFast gives the shares of the average executions; each is multiplied by a factor for the worst
    execution, and all are scaled to the total. Costs are multiples of the grain: with a coarse one, some jobs
    finish right at arrivals.
    """
    periods = random.choices(list(WATERS_2015), [row[0] for row in WATERS_2015.values()], k=count)
    worst = [
        share * random.uniform(*WATERS_2015[period][1:])
        for share, period in zip(utilizations(random, count=count, total=total), periods, strict=True)
    ]
    scale = total / sum(worst)
    priorities = random.sample(range(1, 100), count)
    return [
        SporadicTask(
            name=f"t{index}",
            priority=priorities[index],
            separation_ns=period * MS,
            cost_ns=max(1, int(worst[index] * scale * period * MS / grain_ns)) * grain_ns,
            deadline_ns=period * MS,
        )
        for index, period in enumerate(periods)
    ]


def with_jitter(random: Random, tasks: list[SporadicTask]) -> list[SporadicTask]:
    """Release jitter below the period, often none."""
    return [
        replace(task, jitter_ns=random.choice((0, random.randrange(task.separation_ns)))) for task in tasks
    ]


def with_one_resource(random: Random, tasks: list[SporadicTask]) -> list[SporadicTask]:
    """Some tasks lock one common resource."""
    return [
        replace(task, sections=(CriticalSection(resource="r", length_ns=random.randint(1, task.cost_ns)),))
        if random.random() < 0.6
        else task
        for task in tasks
    ]


def small_set(random: Random, *, changed: Change | None = None) -> list[SporadicTask]:
    """Two to four tasks with periods of 4 to 24 ns and three priorities: quick to simulate."""
    tasks = []
    shares = utilizations(random, count=random.randint(2, 4), total=random.uniform(0.4, 0.95))
    for index, share in enumerate(shares):
        period = random.randint(4, 24)
        tasks.append(
            SporadicTask(
                name=f"t{index}",
                priority=random.randint(1, 3),
                separation_ns=period,
                cost_ns=max(1, int(share * period)),
                deadline_ns=3 * period,
                jitter_ns=random.choice((0, 0, random.randint(0, period))),
            )
        )
    return changed(random, tasks) if changed else tasks


def with_resources(random: Random, tasks: list[SporadicTask]) -> list[SporadicTask]:
    """Some tasks lock some of three resources, one after another or nested."""
    changed = []
    for task in tasks:
        sections: list[CriticalSection] = []
        left = task.cost_ns
        for name in ("a", "b", "c"):
            if left >= 1 and random.random() < 0.5:
                length = random.randint(1, left)
                nested = bool(sections) and random.random() < 0.4 and sections[-1].length_ns >= 2
                if nested:
                    length = random.randint(1, sections[-1].length_ns - 1)
                else:
                    left -= length
                sections.append(
                    CriticalSection(
                        resource=name, length_ns=length, inside=sections[-1].resource if nested else ""
                    )
                )
        changed.append(replace(task, sections=tuple(sections)))
    return changed


def nearly_full(random: Random, tasks: list[SporadicTask]) -> list[SporadicTask]:
    """One task takes what the others leave of 98 % of the processor: busy windows have many jobs."""
    chosen = random.choice(tasks)
    load = sum(Fraction(task.cost_ns, task.separation_ns) for task in tasks)
    more_ns = max(0, floor((Fraction(98, 100) - load) * chosen.separation_ns))
    return [replace(task, cost_ns=task.cost_ns + more_ns) if task is chosen else task for task in tasks]
