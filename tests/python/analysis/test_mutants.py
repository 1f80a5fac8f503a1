"""Each classic mistake of an analysis, made on purpose, is found by the text-book sets and by the oracle."""

from collections.abc import Iterator, Sequence
from random import Random

import pytest
from pyrta_oracle import disagreements
from schedule_simulation import longest_simulated
from sporadic_tasks import response_times
from task_sets import nearly_full, small_set, with_resources
from textbook_sets import EXAMPLES

from mauve_rt.analysis import digraph_times
from mauve_rt.analysis.demand import Path, Staircase, cost_of
from mauve_rt.analysis.digraph import DigraphTask
from mauve_rt.analysis.digraph_times import Component

IN_NS, UNTIL_NS = Staircase.in_ns, Staircase.until_ns
WITHIN, FINISH_NS = digraph_times._within, digraph_times.Delay.finish_ns


def no_blocking(_one: Component, _components: Sequence[Component]) -> int:
    return 0


NO_JITTER = property(lambda _one: 0, lambda _one, _given_ns: None)


def no_carry_over(task: DigraphTask, end_ns: int) -> Iterator[Path]:
    return (path._replace(work_ns=cost_of(path.job)) for path in WITHIN(task, end_ns))


def first_job_only(task: DigraphTask, _end_ns: int) -> Iterator[Path]:
    return (path for path in WITHIN(task, 1))


def closed_interval(work: Staircase, length_ns: int) -> int:
    return UNTIL_NS(work, length_ns)


def half_open_interval(work: Staircase, instant_ns: int) -> int:
    return IN_NS(work, instant_ns)


def own_release(delay: digraph_times.Delay, path: Path) -> int:
    """As if the kernel queued jobs, not threads: none that is released later goes first."""
    equal_ns = sum(other.until_ns(path.release_ns) for other in delay.equal)
    return FINISH_NS(digraph_times.Delay(delay.higher, (), delay.blocking_ns + equal_ns), path)


MUTANTS: dict[str, tuple[object, str, object]] = {
    "blocking forgotten": (digraph_times, "blocking_ns", no_blocking),
    "jitter forgotten": (Component, "jitter_ns", NO_JITTER),
    "carry-over forgotten": (digraph_times, "_within", no_carry_over),
    "only the first job of the window": (digraph_times, "_within", first_job_only),
    "half-open interval turned round": (Staircase, "in_ns", closed_interval),
    "closed interval turned round": (Staircase, "until_ns", half_open_interval),
    "jobs queued, not threads": (digraph_times.Delay, "finish_ns", own_release),
}
OUTSIDE_THE_ORACLE = {  # pyRTA has none of them
    "closed interval turned round",
    "jobs queued, not threads",
}
NOT_BY_SIMULATION = {
    "half-open interval turned round",  # wrong, but never too low
}


@pytest.mark.parametrize("name", MUTANTS)
def test_the_textbook_sets_find(name: str, monkeypatch: pytest.MonkeyPatch):
    assert all(example.holds() for example in EXAMPLES)
    monkeypatch.setattr(*MUTANTS[name])
    assert not all(example.holds() for example in EXAMPLES)


@pytest.mark.parametrize("name", sorted(MUTANTS.keys() - OUTSIDE_THE_ORACLE))
def test_the_oracle_finds(name: str, monkeypatch: pytest.MonkeyPatch):
    seeds = range(200)
    assert disagreements(seeds) == []
    monkeypatch.setattr(*MUTANTS[name])
    assert disagreements(seeds) != []


def exceeded() -> bool:
    """Whether a simulated response time exceeds its bound in some of the sets."""
    for seed in range(1500):
        random = Random(seed)  # noqa: S311 - no cryptography
        tasks = small_set(random, changed=random.choice((None, with_resources, nearly_full)))
        longest = longest_simulated(random, tasks, runs=1)
        bounds = response_times(tasks)
        for task, bound in zip(tasks, bounds, strict=True):
            if bound.response_ns is not None and longest[task.name] > bound.response_ns:
                return True
    return False


@pytest.mark.parametrize("name", sorted(MUTANTS.keys() - NOT_BY_SIMULATION))
def test_the_simulation_finds(name: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(*MUTANTS[name])
    assert exceeded()
