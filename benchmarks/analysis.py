"""How long a verdict takes: on fifty components, next to pyRTA on as many tasks; on a change; on 500."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from random import Random
from typing import TypeVar

from native import BenchmarkError, interleaved
from response_time_analysis import model
from response_time_analysis.analysis import fp
from rows import Row, alone, compared
from settings import Settings

from mauve_rt.analysis.bounds import Subject, bounds_of
from mauve_rt.analysis.machines import ExecutionTime, Machine, State
from mauve_rt.analysis.study import Study, Surroundings, study, study_of_change
from mauve_rt.analysis.verdict import Outcome, judge
from mauve_rt.model.threads import ThreadList

_COMPONENTS, _CPUS = 50, 2
_MANY, _MANY_CPUS = 500, 4
_CHANGED = 5
_HANDOVER_NS = 100_000
_OVERHEAD_NS = 20_000
_STATES, _WAITS = (3, 10), (1, 3)
_PERIODS_MS = (1, 2, 5, 10, 20, 50, 100, 200)  # of engine control: Kramer, Ziegenbein, Hamann, WATERS 2015
_MS = 1_000_000
_SHARE = 0.06  # of each component, at most: with this seed the CPUs are loaded by 0.50 and 0.43
_SHARE_OF_MANY = 0.006
_HIGHEST = 97
_SEED = 1


def analysis_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of both, in this process: warm. Each round has a wake-up of its own: results are kept."""
    machines = _architecture(Random(_SEED))  # noqa: S311 - not for secrets
    subjects = [Subject.of(machine) for machine in machines]
    pairs = interleaved(
        settings.rounds,
        _milliseconds(lambda number: _judge(machines, number)),
        _milliseconds(lambda _number: _reference(subjects)),
    )
    yield compared(
        f"verdict on {_COMPONENTS} components of 3 to 10 states",
        pairs,
        unit="ms",
        beside="pyRTA, sporadic tasks of the largest costs and shortest distances",
        limit=100,
    )
    yield alone(
        f"verdicts on a change of {_CHANGED} of {_COMPONENTS} components, during and after it, CPU time",
        [_change_ms(machines, number) for number in range(settings.rounds)],
        unit="ms",
        limit=100,
    )
    many = _architecture(
        Random(_SEED),  # noqa: S311 - not for secrets
        components=_MANY,
        cpus=_MANY_CPUS,
        share=_SHARE_OF_MANY,
    )
    yield alone(
        f"verdict on {_MANY} components on {_MANY_CPUS} CPUs, CPU time",
        [_cpu_ms(partial(_study, many, number))[1] for number in range(settings.rounds)],
        unit="ms",
        limit=2_000,
    )


def _milliseconds(work: Callable[[int], None]) -> Callable[[int], float]:
    def measure(number: int) -> float:
        began = time.perf_counter()
        work(number)
        return (time.perf_counter() - began) * 1e3

    return measure


Result = TypeVar("Result")


def _cpu_ms(work: Callable[[], Result]) -> tuple[Result, float]:
    began = time.process_time()
    result = work()
    return result, (time.process_time() - began) * 1e3


def _judge(machines: list[Machine], wakeup_ns: int) -> None:
    subjects = [Subject.of(machine) for machine in machines]
    verdict = judge(subjects, bounds_of(subjects, wakeup_ns=wakeup_ns))
    if verdict.outcome != Outcome.SCHEDULABLE:
        raise BenchmarkError(f"the set of components is {verdict.sentence}")


def _surroundings(wakeup_ns: int) -> Surroundings:
    return Surroundings(threads=ThreadList(wakeup_ns, _OVERHEAD_NS, ()))


def _study(machines: list[Machine], wakeup_ns: int) -> Study:
    found = study(machines, _surroundings(wakeup_ns))
    if found.verdict.outcome is not Outcome.SCHEDULABLE:
        raise BenchmarkError(f"the set of components is {found.verdict.sentence}")
    return found


def _change_ms(machines: list[Machine], wakeup_ns: int) -> float:
    """Of components all over, each with a new core that takes a tenth longer."""
    now = _study(machines, wakeup_ns)
    after = [
        _slower(one) if not place % (_COMPONENTS // _CHANGED) else one for place, one in enumerate(machines)
    ]
    handovers = {one.name: _HANDOVER_NS for one, other in zip(after, machines, strict=True) if one != other}

    def verdicts() -> Study:
        return study_of_change(now, _study(after, wakeup_ns), handovers, _surroundings(wakeup_ns))

    during, took_ms = _cpu_ms(verdicts)
    if during.verdict.outcome is not Outcome.SCHEDULABLE:
        raise BenchmarkError(f"the change is {during.verdict.sentence}")
    return took_ms


def _slower(machine: Machine) -> Machine:
    states = (
        replace(state, time=ExecutionTime(round((state.time.ns or 0) * 1.1), "declared"))
        for state in machine.states
    )
    return replace(machine, states=tuple(states))


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


def _architecture(
    random: Random, *, components: int = _COMPONENTS, cpus: int = _CPUS, share: float = _SHARE
) -> list[Machine]:
    """Components with random fsms, the shorter their waits the higher their priority."""
    machines = sorted(
        (_component(random, number, cpus, share) for number in range(components)),
        key=lambda machine: -min(state.separation_ns for state in machine.states if state.is_wait),
    )
    levels = min(components, _HIGHEST)
    return [
        replace(machine, priority=1 + place * levels // components) for place, machine in enumerate(machines)
    ]


def _component(random: Random, number: int, cpus: int, share: float) -> Machine:
    waits_ms = {f"W{wait}": random.choice(_PERIODS_MS) for wait in range(random.randint(*_WAITS))}
    executions = [f"E{state}" for state in range(max(1, random.randint(*_STATES) - len(waits_ms)))]
    most_ns = share * min(waits_ms.values()) * _MS / len(executions)
    states = [_wait(name, ms * _MS, executions[0]) for name, ms in waits_ms.items()]
    for place, name in enumerate(executions):
        later = [*executions[place + 1 :], *waits_ms]
        cost_ns = max(1, round(most_ns * random.uniform(0.2, 1)))
        successors = random.sample(later, min(len(later), random.randint(1, 2)))
        states.append(_execution(name, cost_ns, successors, is_initial=place == 0))
    return Machine(
        name=f"component_{number}",
        cpus=(number % cpus,),
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
