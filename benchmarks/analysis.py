"""How long a verdict takes on fifty components, next to pyRTA on as many sporadic tasks."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from random import Random

from native import BenchmarkError, interleaved
from response_time_analysis import model
from response_time_analysis.analysis import fp
from rows import Row, compared
from settings import Settings

from mauve_rt.analysis.bounds import Subject, bounds_of
from mauve_rt.analysis.machines import ExecutionTime, Machine, State
from mauve_rt.analysis.verdict import Outcome, judge

_COMPONENTS, _CPUS = 50, 2
_STATES, _WAITS = (3, 10), (1, 3)
_PERIODS_MS = (1, 2, 5, 10, 20, 50, 100, 200)  # of engine control: Kramer, Ziegenbein, Hamann, WATERS 2015
_MS = 1_000_000
_SHARE = 0.06  # of each component, at most: with this seed the CPUs are loaded by 0.50 and 0.43
_SEED = 1


def analysis_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of both, in this process: warm."""
    machines = _architecture(Random(_SEED))  # noqa: S311 - not for secrets
    subjects = [Subject.of(machine) for machine in machines]
    pairs = interleaved(
        settings.rounds, _milliseconds(lambda: _judge(machines)), _milliseconds(lambda: _reference(subjects))
    )
    yield compared(
        "verdict on 50 components of 3 to 10 states",
        pairs,
        unit="ms",
        beside="pyRTA, sporadic tasks of the largest costs and shortest distances",
        limit=100,
    )


def _milliseconds(work: Callable[[], None]) -> Callable[[int], float]:
    def measure(_number: int) -> float:
        began = time.perf_counter()
        work()
        return (time.perf_counter() - began) * 1e3

    return measure


def _judge(machines: list[Machine]) -> None:
    subjects = [Subject.of(machine) for machine in machines]
    verdict = judge(subjects, bounds_of(subjects))
    if verdict.outcome != Outcome.SCHEDULABLE:
        raise BenchmarkError(f"the set of components is {verdict.sentence}")


def _reference(subjects: list[Subject]) -> None:
    for cpu in range(_CPUS):
        tasks = [
            model.Task(
                arrivals=model.Sporadic(subject.task.shortest_separation_ns),
                execution=model.FullyPreemptive(model.WCET(subject.task.largest_cost_ns or 1)),
                priority=subject.machine.priority,
            )
            for subject in subjects
            if subject.machine.cpus == (cpu,)
        ]
        for task in tasks:
            fp.rta(model.taskset(tasks), task, model.IdealProcessor(), horizon=1_000 * _MS)


def _architecture(random: Random) -> list[Machine]:
    """Components with random fsms, the shorter their waits the higher their priority."""
    machines = sorted(
        (_component(random, number) for number in range(_COMPONENTS)),
        key=lambda machine: -min(state.separation_ns for state in machine.states if state.is_wait),
    )
    return [replace(machine, priority=1 + number) for number, machine in enumerate(machines)]


def _component(random: Random, number: int) -> Machine:
    waits_ms = {f"W{wait}": random.choice(_PERIODS_MS) for wait in range(random.randint(*_WAITS))}
    executions = [f"E{state}" for state in range(max(1, random.randint(*_STATES) - len(waits_ms)))]
    most_ns = _SHARE * min(waits_ms.values()) * _MS / len(executions)
    states = [_wait(name, ms * _MS, executions[0]) for name, ms in waits_ms.items()]
    for place, name in enumerate(executions):
        later = [*executions[place + 1 :], *waits_ms]
        cost_ns = max(1, round(most_ns * random.uniform(0.2, 1)))
        successors = random.sample(later, min(len(later), random.randint(1, 2)))
        states.append(_execution(name, cost_ns, successors, is_initial=place == 0))
    return Machine(
        name=f"component_{number}",
        cpus=(number % _CPUS,),
        priority=1,
        policy="SCHED_FIFO",
        period_ns=0,
        offset_ns=0,
        deadline_ns=0,
        overrun="skip",
        states=tuple(states),
        is_python=False,
    )


def _wait(name: str, time_ns: int, successor: str) -> State:
    return State(
        name=name,
        is_initial=False,
        is_wait=True,
        separation_ns=time_ns,
        latest_ns=time_ns,
        is_event_wait=False,
        successors=(successor,),
        time=ExecutionTime(0, "declared"),  # of its guards
    )


def _execution(name: str, cost_ns: int, successors: list[str], *, is_initial: bool) -> State:
    return State(
        name=name,
        is_initial=is_initial,
        is_wait=False,
        separation_ns=0,
        latest_ns=0,
        is_event_wait=False,
        successors=tuple(successors),
        time=ExecutionTime(cost_ns, "declared"),
    )
