"""Response times by the package response-time-analysis (pyRTA), for comparison.

pyRTA measures from the release, `digraph_times` from the arrival: the first release of a busy window comes a
whole jitter after its arrival, the later ones come without delay. With jitter below the period, one job is
released at offset 0.
"""

from collections.abc import Iterable
from random import Random

from response_time_analysis import model
from response_time_analysis.analysis import fifo, fp
from sporadic_tasks import SporadicTask, response_times
from task_sets import MS, waters_set, with_jitter, with_one_resource

IDEAL = model.IdealProcessor()


def fixed_priority_ns(tasks: list[SporadicTask], index: int) -> int | None:
    """The bound of one task, all others of its priority counted as higher; at most one resource is locked."""
    ceiling = max((task.priority for task in tasks if task.sections), default=0)
    blocks = tasks[index].priority <= ceiling
    mapped = [_mapped(task, blocks=blocks and task.priority < ceiling) for task in tasks]
    horizon = 1000 * max(task.separation_ns for task in tasks)
    found = fp.rta(model.taskset(mapped), mapped[index], IDEAL, horizon=horizon)
    if not found.bound_found():
        return None
    jitter_ns = tasks[index].jitter_ns
    return max(response + (0 if offset else jitter_ns) for offset, _, response in found.search_space or ())


def fifo_ns(tasks: list[SporadicTask]) -> int | None:
    """The bound, from the release, of every task: one priority, and jobs are first in, first out."""
    return fifo.rta(model.taskset([_mapped(task, blocks=False) for task in tasks]), IDEAL).response_time_bound


def _mapped(task: SporadicTask, *, blocks: bool) -> model.Task:
    cost = model.WCET(task.cost_ns)
    length_ns = max((section.length_ns for section in task.sections), default=0)
    execution: model.PreemptionModel = model.FullyPreemptive(cost)
    if blocks and length_ns:
        # pyRTA lets a segment begin one instant before the window: one more, and the section counts whole.
        execution = _Section(cost, length_ns + 1)
    return model.Task(
        arrivals=model.PeriodicWithJitter(task.separation_ns, task.jitter_ns),
        execution=execution,
        priority=task.priority,
    )


class _Section(model.FloatingNonPreemptive):
    """A segment that is one longer than the section it stands for, and so perhaps than the job."""

    def __post_init__(self) -> None:
        pass


def random_set(seed: int) -> list[SporadicTask]:
    """Distinct priorities in random order, half of the sets with jitter, half with a shared resource."""
    random = Random(seed)  # noqa: S311 - no cryptography
    tasks = waters_set(
        random,
        count=random.randint(2, 5),
        total=random.uniform(0.3, 0.98),
        grain_ns=random.choice((1, MS // 10)),
    )
    if random.random() < 0.5:
        tasks = with_jitter(random, tasks)
    return with_one_resource(random, tasks) if random.random() < 0.5 else tasks


def disagreements(seeds: Iterable[int]) -> list[str]:
    """A line for each random set on which the two analyses differ: the first task that has two bounds."""
    found = []
    for seed in seeds:
        tasks = random_set(seed)
        for index, bound in enumerate(response_times(tasks)):
            expected = fixed_priority_ns(tasks, index)
            if bound.response_ns != expected:
                found.append(f"seed {seed}, {tasks[index].name}: {bound.response_ns}, pyRTA {expected}")
                break
    return found
