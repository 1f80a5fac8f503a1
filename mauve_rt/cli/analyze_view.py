"""A task model and a verdict to look at."""

from collections.abc import Mapping, Sequence

from mauve_rt.analysis.bounds import Bound, Subject
from mauve_rt.analysis.digraph import Job
from mauve_rt.analysis.machines import FOREVER_NS, Machine, in_ms
from mauve_rt.analysis.verdict import Outcome, Verdict


def print_model(subjects: Sequence[Subject], bounds: Mapping[str, Bound]) -> None:
    """Print each component: its states, its jobs, its bound."""
    for subject in subjects:
        print(f"{subject.name}: {_scheduling(subject.machine)}")
        for state in subject.machine.states:
            if not state.is_wait:
                print(f"  {state.name}: {state.time}")
        for hold in subject.machine.holds:
            print(f"  holds the lock of {hold}")
        for job in subject.task.jobs:
            print(f"  job {_job(job)}")
        if not subject.obstacles:
            print(f"  response {_response(bounds[subject.name])}")


def print_verdict(verdict: Verdict, subjects: Sequence[Subject], assumptions: Sequence[str]) -> None:
    """Print it, with what it takes for granted."""
    if verdict.outcome == Outcome.SCHEDULABLE:
        _print_list(f"{verdict.sentence}, if", assumptions)
    elif verdict.outcome == Outcome.NOT_SCHEDULABLE:
        _print_list(f"{verdict.sentence}, if", _REACHED)
    elif verdict.outcome == Outcome.NOT_PROVABLE:
        found = [f"{subject.name}: {why}" for subject in subjects for why in subject.obstacles]
        _print_list(f"{verdict.sentence}", found)
    else:
        print(verdict.sentence)


_REACHED = (
    "guards let each component go the way that it goes in this run",
    "each execution takes all of the time that is said of its state",
)


def _print_list(head: str, lines: Sequence[str]) -> None:
    print(head)
    for line in lines:
        print(f"  {line}")


def _scheduling(machine: Machine) -> str:
    cpus = f"CPU {', '.join(map(str, machine.cpus))}" if machine.cpus else "any CPU"
    rhythm = f"period {in_ms(machine.period_ns)}" if machine.period_ns else "by its waits"
    deadline = in_ms(machine.deadline_ns) if machine.deadline_ns else "the next instant"
    return f"{cpus}, priority {machine.priority}, {rhythm}, deadline {deadline}, overrun {machine.overrun}"


def _response(bound: Bound) -> str:
    if bound.response_ns is None:
        return f"without a bound: {bound.reason}"
    met = "met" if bound.meets_deadline else "not proved to be met"
    blocked = f", blocked up to {in_ms(bound.blocking_ns)}" if bound.blocking_ns else ""
    deadline = f"its deadline of {in_ms(bound.deadline_ns)} is {met}"
    return f"at most {in_ms(bound.response_ns)}, {deadline}{blocked}"


def _job(job: Job) -> str:
    way = " -> ".join([job.after or "the start", *job.states, job.until])
    cost = "of unknown cost" if job.cost_ns is None else f"at most {in_ms(job.cost_ns)}"
    after = (
        "none follows"
        if job.separation_ns == FOREVER_NS
        else f"the next one {in_ms(job.separation_ns)} later"
    )
    return f"{way}: {cost}, {after}"
