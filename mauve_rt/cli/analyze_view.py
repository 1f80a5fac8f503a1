"""A task model and a verdict to look at."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mauve_rt.analysis.bounds import Bound, Subject
from mauve_rt.analysis.digraph import Job
from mauve_rt.analysis.machines import FOREVER_NS, Machine, State, in_ms
from mauve_rt.analysis.study import Study, Surroundings
from mauve_rt.analysis.verdict import Outcome
from mauve_rt.model.threads import ThreadList

if TYPE_CHECKING:
    from mauve_rt.cli.analyze_plan import Plan


def print_model(now: Study, threads: ThreadList) -> None:
    """Print each component: its states, its jobs, its bound; then what else takes a CPU or a lock."""
    for subject in now.subjects:
        if subject.machine.is_component:
            _print_component(subject, now.bounds[subject.name])
    for subject in now.subjects:
        if not subject.machine.is_component:
            print(_thread(subject))
    costs = [f"begins up to {in_ms(threads.wakeup_ns)} late"] if threads.wakeup_ns >= 0 else []
    costs += [f"costs {in_ms(threads.overhead_ns)}"] if threads.overhead_ns >= 0 else []
    if costs:
        print(f"each release {' and '.join(costs)}")
    if any(state.is_enforced for subject in now.subjects for state in subject.machine.states):
        overrun_ns = Surroundings(threads=threads).overrun_ns
        print(
            f"the watchdog ends an execution up to {in_ms(overrun_ns)} of CPU time above its enforced wcet_ns"
        )


def _print_component(subject: Subject, bound: Bound) -> None:
    print(f"{subject.name}: {_scheduling(subject.machine)}")
    for state in subject.machine.states:
        if not state.is_wait:
            print(f"  {state.name}: {state.time}{', enforced' * state.is_enforced}{_limit(state)}")
        elif len(state.successors) > 1:
            print(f"  guards of {state.name}: {state.time}")
    for hold in subject.machine.holds:
        print(f"  holds the lock of {hold}")
    times = {one.job: one.response_ns for one in bound.jobs}
    for job in subject.task.jobs:
        response = f", response at most {in_ms(times[job])}" if job in times else ""
        print(f"  job {_job(job)}{response}")
    if not subject.obstacles:
        print(f"  response {_response(bound)}")
    for why in bound.too_long:
        print(f"  {why}")


def _limit(state: State) -> str:
    return f", faulted above {in_ms(state.limit_ns)}" if state.limit_ns else ""


def _thread(subject: Subject) -> str:
    machine = subject.machine
    where = f"CPU {', '.join(map(str, machine.cpus))}" if machine.cpus else "any CPU"
    if not machine.priority:
        held = ", ".join([*map(str, machine.holds), *machine.undeclared_locks])
        return f"thread '{machine.name}': holds the lock of {held}"
    cost_ns, often_ns = subject.task.largest_cost_ns, subject.task.shortest_separation_ns
    cost = "of unknown cost" if cost_ns is None else f"at most {in_ms(cost_ns)}"
    often = f" every {in_ms(often_ns)}" if often_ns != FOREVER_NS else ""
    return f"thread '{machine.name}': {where}, priority {machine.priority}, {cost}{often}"


def print_verdict(now: Study, assumptions: Sequence[str]) -> None:
    """Print it, with its conditions, or with what is missing."""
    verdict = now.verdict
    if verdict.outcome in (Outcome.SCHEDULABLE, Outcome.FORECAST):
        joined = "if" if verdict.outcome == Outcome.SCHEDULABLE else "and"
        _print_list(f"{verdict.sentence}, {joined}", assumptions)
    elif verdict.outcome == Outcome.NOT_SCHEDULABLE:
        _print_list(f"{verdict.sentence}, if", _REACHED)
    elif verdict.outcome == Outcome.NOT_PROVABLE:
        _print_list(verdict.sentence, now.missing)
    else:
        print(verdict.sentence)


def print_plan(plan: "Plan") -> None:
    """Print the verdicts on a change; of one with a name the worse one."""
    if plan.change:
        _print_list(*verdict_of_plan(plan))
    else:
        _print_study("during the change: ", plan.during)
        _print_study("after it: ", plan.after)


def verdict_of_plan(plan: "Plan") -> tuple[str, list[str]]:
    """Of a change with a name: the worse one of its verdicts, and what is missing."""
    is_sound = plan.after.verdict.outcome == Outcome.SCHEDULABLE
    worse = plan.during if is_sound else plan.after
    when = "while that is made: " if is_sound and worse.verdict.outcome != Outcome.SCHEDULABLE else ""
    return f"{plan.change}: {when}{worse.verdict.sentence}", worse.missing


def _print_study(head: str, study: Study) -> None:
    _print_list(f"{head}{study.verdict.sentence}", study.missing)


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
    return f"at most {in_ms(bound.response_ns)}{bound.how}, {deadline}{blocked}"


def _job(job: Job) -> str:
    way = " -> ".join([job.after or "the start", *job.states, job.until])
    cost = "of unknown cost" if job.cost_ns is None else f"at most {in_ms(job.cost_ns)}"
    after = (
        "none follows"
        if job.separation_ns == FOREVER_NS
        else f"the next one {in_ms(job.separation_ns)} later"
    )
    return f"{way}: {cost}, {after}"
