"""A task model to look at."""

from collections.abc import Mapping, Sequence

from mauve_rt.analysis.bounds import Bound
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.machines import FOREVER_NS, Machine, in_ms


def print_model(
    found: Sequence[tuple[Machine, DigraphTask, Sequence[str]]],
    bounds: Mapping[str, Bound],
    assumptions: Sequence[str],
) -> None:
    """Print each component: its states, its jobs, its bound, what cannot be proved; then what is assumed."""
    for machine, task, not_provable in found:
        print(f"{machine.name}: {_scheduling(machine)}")
        for state in machine.states:
            if not state.is_wait:
                print(f"  {state.name}: {state.time}")
        for job in task.jobs:
            print(f"  job {_job(job)}")
        for why in not_provable:
            print(f"  not provable: {why}")
        if not not_provable:
            print(f"  response {_response(bounds[machine.name])}")
    print("assumed, and for threads no cost is known:")
    for each in assumptions:
        print(f"  {each}")


def _scheduling(machine: Machine) -> str:
    cpus = f"CPU {', '.join(map(str, machine.cpus))}" if machine.cpus else "any CPU"
    rhythm = f"period {in_ms(machine.period_ns)}" if machine.period_ns else "by its waits"
    deadline = in_ms(machine.deadline_ns) if machine.deadline_ns else "the next instant"
    return f"{cpus}, priority {machine.priority}, {rhythm}, deadline {deadline}, overrun {machine.overrun}"


def _response(bound: Bound) -> str:
    if bound.response_ns is None:
        return f"without a bound: {bound.reason}"
    met = "met" if bound.meets_deadline else "not proved to be met"
    return f"at most {in_ms(bound.response_ns)}, its deadline of {in_ms(bound.deadline_ns)} is {met}"


def _job(job: Job) -> str:
    way = " -> ".join([job.after or "the start", *job.states, job.until])
    cost = "of unknown cost" if job.cost_ns is None else f"at most {in_ms(job.cost_ns)}"
    after = (
        "none follows"
        if job.separation_ns == FOREVER_NS
        else f"the next one {in_ms(job.separation_ns)} later"
    )
    return f"{way}: {cost}, {after}"
