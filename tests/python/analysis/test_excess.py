"""The term of a job above its bound that exceeded its declared time by most."""

from analysis_machines import MS, connected, execution, machine, wait

from mauve_rt.analysis.excess import Excess, Interval, Term, TracedJob, largest_excess
from mauve_rt.analysis.machines import Machine


def component(name: str, priority: int, *, cpu: int = 0, guard_ms: float = 0.0) -> Machine:
    """Works for 2 ms in each period of 10 ms, by its declared times."""
    states = (
        execution("Work", "Pause", wcet_ms=2, initial=True),
        wait("Pause", "Work", "Work", ms=10, wcet_ms=guard_ms) if guard_ms else wait("Pause", "Work", ms=10),
    )
    return machine(*states, name=name, priority=priority, cpus=[cpu], ports=connected(map=1))


def job(name: str, *, ready: float = 0, begin: float, works: float | None = None, end: float) -> TracedJob:
    """In ms; it works from `works` (its begin) to its end."""
    work = Interval(round((begin if works is None else works) * MS), round(end * MS))
    times = (round(each * MS) for each in (0, ready, begin, end))
    return TracedJob(name, "Pause", *times, executions=[("Work", work)])


MACHINES = {
    "own": component("own", 50, guard_ms=0.5),
    "above": component("above", 60),
    "below": component("below", 40),
    "elsewhere": component("elsewhere", 60, cpu=1),
}


def largest(own: TracedJob, *others: TracedJob, bound_ms: float = 4, wakeup_ms: float = 0) -> Excess:
    return largest_excess(
        own, [own, *others], MACHINES, bound_ns=round(bound_ms * MS), wakeup_ns=round(wakeup_ms * MS)
    )


def test_its_own_execution() -> None:
    found = largest(job("own", begin=0, end=5))
    assert found == Excess(Term.EXECUTION, "own.Work", 5 * MS, 2 * MS)
    assert found.text.startswith("execution of own.Work took 5.000 ms (2.000 ms declared)")


def test_preemption_is_no_time_of_its_own_but_of_the_other_component() -> None:
    found = largest(job("own", begin=0, end=6), job("above", begin=1, end=5))
    assert found == Excess(Term.EXECUTION, "above.Work", 4 * MS, 2 * MS)


def test_a_component_of_another_cpu_or_below_preempts_nothing() -> None:
    others = (job("elsewhere", begin=1, end=5), job("below", begin=1, end=5))
    assert largest(job("own", begin=0, end=6), *others) == Excess(Term.EXECUTION, "own.Work", 6 * MS, 2 * MS)


def test_a_late_wake_up() -> None:
    found = largest(job("own", begin=4, end=6), wakeup_ms=1)
    assert found == Excess(Term.WAKE_UP, "own", 4 * MS, 1 * MS)


def test_one_that_waits_for_a_more_urgent_component_or_for_its_own_backlog_is_not_late() -> None:
    late = job("own", ready=3, begin=5, end=7)
    assert largest(late, job("above", begin=2, end=5), bound_ms=6) == Excess(
        Term.EXECUTION, "above.Work", 3 * MS, 2 * MS
    )


def test_guards() -> None:
    found = largest(job("own", begin=0, works=3, end=5))
    assert found == Excess(Term.GUARD, "own.Pause", 3 * MS, MS // 2)


def test_a_lock() -> None:
    own = job("own", begin=0, end=7)
    own.lock_waits.append(("map", Interval(1 * MS, 6 * MS)))
    assert largest(own) == Excess(Term.BLOCKING, "map", 5 * MS, 1 * MS)


def test_while_a_more_urgent_one_waits_for_a_lock_the_others_execute() -> None:
    above = job("above", begin=1, end=5)
    above.lock_waits.append(("map", Interval(1 * MS, 4 * MS)))
    own = job("own", begin=0, end=5)
    assert largest(own, above) == Excess(Term.EXECUTION, "own.Work", 4 * MS, 2 * MS)


def test_what_no_declared_time_explains_is_the_rest() -> None:
    found = largest(job("own", begin=0, end=2), bound_ms=1)
    assert found == Excess(Term.REST, "", 1 * MS, 0)
    assert "foreign thread or overhead" in found.text
