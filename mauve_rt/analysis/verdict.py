"""Does each component meet its deadline? Yes, no, or not proved, in one sentence."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from mauve_rt.analysis.bounds import Bound, Subject, by_cpu, delaying
from mauve_rt.analysis.machines import in_ms
from mauve_rt.analysis.schedule import Cycle, Schedule
from mauve_rt.analysis.time_limit import optional_part
from mauve_rt.analysis.witness import RUNS, member_of, witness_of


class Outcome(StrEnum):
    """What is known."""

    SCHEDULABLE = "schedulable"
    FORECAST = "forecast"
    REFUTED = "model refuted"
    NOT_SCHEDULABLE = "not schedulable"
    NOT_PROVABLE = "not provable"
    NOT_PROVED = "not proved"


@dataclass(frozen=True)
class Verdict:
    """The answer."""

    outcome: Outcome
    why: str
    """What stands behind the outcome's word in the sentence."""
    witness: Schedule | None = None
    """Of what is not schedulable: a run in which a deadline is missed."""

    @property
    def sentence(self) -> str:
        """As `schedulable: every component meets its deadline`."""
        return f"{self.outcome}: {self.why}"


def judge(
    subjects: Sequence[Subject],
    bounds: Mapping[str, Bound],
    *,
    wakeup_ns: int = 0,
    unknown: Sequence[str] = (),
    measured: Sequence[str] = (),
    contradictions: Sequence[str] = (),
    searches: bool = True,
) -> Verdict:
    """The verdict on components and their bounds; both with the same `wakeup_ns`.

    `unknown`: what is not known beside them, in words: nothing is proved then. `measured`: of what else times
    are measured. `contradictions`: what a recording says against the bounds. `searches`: whether to look for
    a run that misses a deadline.
    """
    components = [subject for subject in subjects if subject.machine.is_component]
    late = [subject for subject in components if not bounds[subject.name].meets_deadline]
    late_cpus = [here for here in by_cpu(subjects) if any(subject in late for subject in here)]
    searched = 0
    for here in late_cpus if searches else ():
        found = None
        with optional_part():
            found = witness_of([member_of(subject) for subject in here], wakeup_ns=wakeup_ns)
            searched += 1
        if found is not None and found.missed is not None:
            priorities = {subject.name: subject.machine.priority for subject in here}
            return Verdict(Outcome.NOT_SCHEDULABLE, miss_text(found, found.missed, priorities), found)
    missing = [subject.name for subject in missing_of(subjects)]
    missing += ["this computer"] if unknown else []
    if missing:
        return Verdict(Outcome.NOT_PROVABLE, f"something is missing of {', '.join(missing)}")
    if late:
        reasons = "; ".join(_too_long(subject.name, bounds[subject.name]) for subject in late)
        runs = f"; none of {RUNS} runs misses a deadline" if searched == len(late_cpus) else ""
        return Verdict(Outcome.NOT_PROVED, f"{reasons}{runs}")
    if contradictions:
        return Verdict(Outcome.REFUTED, "; ".join(contradictions))
    names = ", ".join([*(one.name for one in components if one.machine.measured), *measured])
    if names:
        why = f"every component meets its deadline, if no time of {names} is above the measured one"
        return Verdict(Outcome.FORECAST, why)
    return Verdict(Outcome.SCHEDULABLE, "every component meets its deadline")


def missing_of(subjects: Sequence[Subject]) -> list[Subject]:
    """Components of which something is missing, and threads that may delay one and of which it is."""
    components = [subject for subject in subjects if subject.machine.is_component]
    delaying_one = [other for one in components for other in delaying(one, subjects)]
    return [
        subject
        for subject in subjects
        if subject.obstacles and (subject.machine.is_component or subject in delaying_one)
    ]


def miss_text(schedule: Schedule, missed: Cycle, priorities: Mapping[str, int]) -> str:
    """Which component misses which deadline, and through what."""
    own_ns, blocking, others = 0, Counter[str](), Counter[str]()
    for (name, resource), share_ns in schedule.shares_ns(missed).items():
        if name == missed.component:
            own_ns += share_ns
        elif resource and priorities[name] < priorities[missed.component]:
            blocking[f"blocking by {resource}, which {name} holds"] += share_ns
        else:
            others[f"of {name}"] += share_ns
    parts = [f"{in_ms(share_ns)} {what}" for what, share_ns in (others + blocking).most_common()]
    parts.append(f"{in_ms(own_ns)} of its own")
    idle_ns = missed.finish_ns - missed.nominal_ns - own_ns - sum((others + blocking).values())
    parts += [f"{in_ms(idle_ns)} until its thread begins"] if idle_ns else []
    if missed.too_long:
        begin_ns = next(begin for name, begin, _ in missed.states if name == missed.too_long)
        return (
            f"{missed.component} is faulted: {missed.too_long} lasts {in_ms(missed.finish_ns - begin_ns)}, "
            f"above its max_execution_ns; from the release on: {' + '.join(parts)}"
        )
    return (
        f"{missed.component} misses its deadline at {in_ms(missed.deadline_ns)} after the start and ends "
        f"at {in_ms(missed.finish_ns)}: {' + '.join(parts)}"
    )


def _too_long(name: str, bound: Bound) -> str:
    if bound.response_ns is None:
        return f"{name} has no bound ({bound.reason})"
    if bound.too_long:
        return f"{name}: {'; '.join(bound.too_long)}"
    found = f"{in_ms(bound.response_ns)}{bound.how}"
    return f"{name} has a bound of {found} and a deadline of {in_ms(bound.deadline_ns)}"
