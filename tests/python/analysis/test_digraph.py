"""The digraph of a machine: its jobs, what each costs at most, how far apart they are."""

import itertools
import random

from analysis_machines import MS, event, execution, machine, wait

from mauve_rt.analysis.digraph import START, DigraphTask, digraph_of
from mauve_rt.analysis.machines import FOREVER_NS, ExecutionTime, Machine


def told(task: DigraphTask) -> list[tuple[str, tuple[str, ...], float | None, str, float]]:
    return [
        (job.after, job.states, job.cost_ns and job.cost_ns / MS, job.until, job.separation_ns / MS)
        for job in task.jobs
    ]


def test_a_loop_of_one_execution_and_one_wait() -> None:
    task = digraph_of(
        machine(execution("Run", "Pause", bound_ms=0.5, initial=True), wait("Pause", "Run", ms=10))
    )
    assert told(task) == [(START, ("Run",), 0.5, "Pause", 10), ("Pause", ("Run",), 0.5, "Pause", 10)]
    assert task.after(task.jobs[0]) == (task.jobs[1],) == task.after(task.jobs[1])
    assert {job.deadline_ns for job in task.jobs} == {10 * MS}, "the next instant"
    assert (task.shortest_separation_ns, task.largest_cost_ns) == (10 * MS, 0.5 * MS)


def test_of_several_ways_to_a_wait_the_costliest_counts() -> None:
    task = digraph_of(
        machine(
            execution("Look", "Short", "Long", bound_ms=1, initial=True),
            execution("Short", "Pause", bound_ms=1),
            execution("Long", "More", bound_ms=2),
            execution("More", "Pause", "Rest", bound_ms=3),
            wait("Pause", "Look", ms=10),
            wait("Rest", "Look", ms=40),
            deadline_ns=7 * MS,
        )
    )
    way = ("Look", "Long", "More")
    assert told(task) == [
        (START, way, 6, "Pause", 10), (START, way, 6, "Rest", 40),
        ("Pause", way, 6, "Pause", 10), ("Pause", way, 6, "Rest", 40),
        ("Rest", way, 6, "Pause", 10), ("Rest", way, 6, "Rest", 40),
    ]  # fmt: skip
    assert {job.deadline_ns for job in task.jobs} == {7 * MS}


def test_a_wait_that_leads_to_a_wait_is_a_job_that_costs_nothing() -> None:
    task = digraph_of(
        machine(wait("A", "B", ms=3, initial=True), wait("B", "Run", ms=7), execution("Run", "A", bound_ms=1))
    )
    assert told(task) == [("A", (), 0, "B", 7), ("B", ("Run",), 1, "A", 3)]


def test_an_event_wait_separates_by_its_least_time() -> None:
    task = digraph_of(
        machine(event("Await", "Run", least_ms=5, initial=True), execution("Run", "Await", bound_ms=1))
    )
    assert told(task) == [("Await", ("Run",), 1, "Await", 5)]


def test_after_a_wait_without_an_end_nothing_follows() -> None:
    endless = wait("End", ms=0)
    endless.duration_ns = FOREVER_NS
    task = digraph_of(machine(execution("Run", "End", bound_ms=1, initial=True), endless))
    assert [(job.until, job.separation_ns) for job in task.jobs] == [("End", FOREVER_NS)]
    assert task.after(task.jobs[0]) == ()


def test_what_no_way_leads_to_is_left_out() -> None:
    task = digraph_of(
        machine(
            execution("Run", "Pause", bound_ms=1, initial=True),
            wait("Pause", "Run", ms=10),
            execution("Island", "Beach"),
            wait("Beach", "Island", ms=1),
        )
    )
    assert {job.until for job in task.jobs} == {"Pause"}
    assert task.largest_cost_ns == 1 * MS


def test_a_missing_time_makes_the_cost_of_its_jobs_unknown_and_of_no_others() -> None:
    one = machine(
        execution("Known", "Pause", bound_ms=1, initial=True),
        wait("Pause", "Known", "Unknown", ms=10, wcet_ms=1),
        execution("Unknown", "Rest"),
        wait("Rest", "Known", ms=20),
    )
    assert one.missing == ("Unknown",)
    task = digraph_of(one)
    assert {(job.after, job.until): job.cost_ns for job in task.jobs} == {
        (START, "Pause"): MS, ("Pause", "Pause"): 2 * MS, ("Pause", "Rest"): None, ("Rest", "Pause"): MS,
    }  # fmt: skip
    assert task.largest_cost_ns is None
    filled = one.with_budgets(
        {"Unknown": ExecutionTime(3 * MS, "measured"), "Known": ExecutionTime(9 * MS, "no")}
    )
    assert filled.missing == ()
    assert digraph_of(filled).largest_cost_ns == 4 * MS, "what is declared stays"


def test_a_release_costs_the_guards_of_its_wait_and_what_the_computer_takes() -> None:
    one = machine(
        wait("Pause", "Run", "Run", ms=10, wcet_ms=2, initial=True),
        execution("Run", "Brief", wcet_ms=5),
        wait("Brief", "Pause", ms=1),
    )
    jobs = digraph_of(one, overhead_ns=MS // 2).jobs
    assert [(job.after, job.release_cost_ns, job.cost_ns) for job in jobs] == [
        ("Pause", 5 * MS // 2, 15 * MS // 2),
        ("Brief", MS // 2, MS // 2),
    ]


def test_a_machine_that_is_not_configured_has_no_jobs() -> None:
    assert digraph_of(machine()) == DigraphTask("c", ())


def walk(one: Machine, steps: int, chance: random.Random) -> list[tuple[str, int, str]]:
    """What a run executes between its waits: another way than the digraph's."""
    states = {state.name: state for state in one.states}
    at = next(state for state in one.states if state.is_initial)
    done, after, cost_ns = [], START, 0
    for _ in range(steps):
        if at.is_wait:
            if after or cost_ns:
                done.append((after, cost_ns, at.name))
            after, cost_ns = at.name, at.time.ns or 0
        else:
            cost_ns += at.time.ns or 0
        at = states[chance.choice(at.successors)]
    return done


def random_machine(chance: random.Random) -> Machine:
    """Executions lead on to later ones or to waits, so that no loop is without a wait."""
    count, waits = chance.randint(1, 6), [f"W{number}" for number in range(chance.randint(1, 3))]
    states = []
    for number in range(count):
        later = [f"E{other}" for other in range(number + 1, count)] + waits
        successors = chance.choices(later, k=chance.randint(1, 3))
        states.append(
            execution(f"E{number}", *successors, bound_ms=chance.randint(1, 9), initial=number == 0)
        )
    everything = [f"E{number}" for number in range(count)] + waits
    states += [
        wait(name, *chance.choices(everything, k=chance.randint(1, 2)), ms=chance.randint(1, 9), wcet_ms=2)
        for name in waits
    ]
    return machine(*states)


def test_no_run_of_any_machine_is_outside_of_its_digraph() -> None:
    chance = random.Random(11)  # noqa: S311 - not for secrets
    reached = total = 0
    for _ in range(300):
        one = random_machine(chance)
        jobs = {(job.after, job.until): job for job in digraph_of(one).jobs}
        largest: dict[tuple[str, str], int] = {}
        runs = (walk(one, 40, chance) for _ in range(100))  # a long one may never leave a part of the machine
        for after, cost_ns, until in itertools.chain.from_iterable(runs):
            assert cost_ns <= jobs[after, until].cost_ns
            largest[after, until] = max(cost_ns, largest.get((after, until), 0))
        reached += sum(jobs[key].cost_ns == cost_ns for key, cost_ns in largest.items())
        total += len(largest)
    assert reached > 0.95 * total, "and the costs are those of runs"
