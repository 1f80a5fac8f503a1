"""A task model to look at."""

from collections.abc import Sequence

from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.machines import FOREVER_NS, Machine, in_ms


def print_model(
    found: Sequence[tuple[Machine, DigraphTask, Sequence[str]]], assumptions: Sequence[str]
) -> None:
    """Print each component: its states, its jobs, what cannot be proved of it; then what is assumed."""
    for machine, task, not_provable in found:
        print(f"{machine.name}: {_scheduling(machine)}")
        for state in machine.states:
            if not state.is_wait:
                print(f"  {state.name}: {state.time}")
        for job in task.jobs:
            print(f"  job {_job(job)}")
        for why in not_provable:
            print(f"  not provable: {why}")
    print("assumed, as no cost of it is known:")
    for each in assumptions:
        print(f"  {each}")


def _scheduling(machine: Machine) -> str:
    cpus = f"CPU {', '.join(map(str, machine.cpus))}" if machine.cpus else "any CPU"
    rhythm = f"period {in_ms(machine.period_ns)}" if machine.period_ns else "by its waits"
    deadline = in_ms(machine.deadline_ns) if machine.deadline_ns else "the next instant"
    return f"{cpus}, priority {machine.priority}, {rhythm}, deadline {deadline}, overrun {machine.overrun}"


def _job(job: Job) -> str:
    way = " -> ".join([job.after or "the start", *job.states, job.until])
    cost = "of unknown cost" if job.cost_ns is None else f"at most {in_ms(job.cost_ns)}"
    after = (
        "none follows"
        if job.separation_ns == FOREVER_NS
        else f"the next one {in_ms(job.separation_ns)} later"
    )
    return f"{way}: {cost}, {after}"
