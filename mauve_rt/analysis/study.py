"""An architecture analyzed: its components, their bounds, and the verdict; and a change of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from mauve_rt.analysis.bounds import Bound, Subject, bounds_of, by_cpu
from mauve_rt.analysis.change_witness import change_witness
from mauve_rt.analysis.machines import Machine, in_ms
from mauve_rt.analysis.obstacles import unknown_costs
from mauve_rt.analysis.plan import Handovers, bounds_during, subjects_during
from mauve_rt.analysis.refutation import Measured, contradictions
from mauve_rt.analysis.threads import WATCHDOG, machines_of
from mauve_rt.analysis.time_limit import optional_part
from mauve_rt.analysis.verdict import Outcome, Verdict, judge, miss_text, missing_of

AT_AN_IDLE_INSTANT = "at an idle instant"


@dataclass(frozen=True)
class Study:
    """What is known of an architecture."""

    subjects: Sequence[Subject]
    """Components, then threads."""
    bounds: Mapping[str, Bound]
    """Of the components, by name."""
    verdict: Verdict
    unknown: Sequence[str]
    """What is not known beside them, in words."""

    @property
    def missing(self) -> list[str]:
        """What keeps it from being provable, each as `component: reason`; none where it is provable."""
        if self.verdict.outcome is not Outcome.NOT_PROVABLE:
            return []
        subjects = [f"{one.name}: {why}" for one in missing_of(self.subjects) for why in one.obstacles]
        return [*subjects, *(f"this computer: {why}" for why in self.unknown)]


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What runs beside the components, and what a release costs."""

    threads: Any
    """With the fields of mauve_msgs/msg/TaskList."""
    beside: tuple[Machine, ...] = ()
    """Threads of other executors on this computer."""
    unknown: tuple[str, ...] = ()
    """What nothing tells, in words."""
    measured: tuple[str, ...] = ()
    """Of what else times are measured."""

    @property
    def wakeup_ns(self) -> int:
        """How late a release is at most; 0: or it is not known."""
        return max(int(self.threads.wakeup_ns), 0)

    @property
    def overhead_ns(self) -> int:
        """Of a release; 0: or it is not known."""
        return max(int(self.threads.overhead_ns), 0)

    @property
    def overrun_ns(self) -> int:
        """CPU time beyond an enforced worst case: until the watchdog looks again, wakes up and has looked."""
        return sum(
            int(each.min_interarrival_ns) + int(each.wcet_ns) + self.wakeup_ns
            for each in self.threads.tasks
            if each.name == WATCHDOG
        )


def study(
    components: Sequence[Machine],
    surroundings: Surroundings,
    *,
    measured: Mapping[str, Measured] | None = None,
) -> Study:
    """An architecture; `measured`: what a recording of it shows, by component."""
    threads = machines_of(surroundings.threads.tasks, components)
    machines = [*components, *threads, *surroundings.beside]
    costs = {"overhead_ns": surroundings.overhead_ns, "overrun_ns": surroundings.overrun_ns}
    subjects = [Subject.of(machine, machines, **costs) for machine in machines]
    wakeup_ns = surroundings.wakeup_ns
    bounds = bounds_of(subjects, wakeup_ns=wakeup_ns)
    unknown = [*unknown_costs(surroundings.threads), *surroundings.unknown]
    verdict = judge(
        subjects,
        bounds,
        wakeup_ns=wakeup_ns,
        unknown=unknown,
        measured=surroundings.measured,
        contradictions=[*contradictions(subjects, bounds, measured or {}, wakeup_ns=wakeup_ns)],
    )
    return Study(subjects, bounds, verdict, unknown)


def study_of_change(
    before: Study, after: Study, handovers: Handovers, surroundings: Surroundings, *, is_idle: bool = False
) -> Study:
    """What holds while the change from the one to the other is made, whenever that is.

    Args:
        before: the architecture before the change.
        after: the architecture after it.
        handovers: of components that get a new core.
        surroundings: what runs beside them.
        is_idle: the change is made only while no job of a participant is pending.

    """
    subjects = subjects_during(before.subjects, after.subjects, handovers)
    wakeup_ns = surroundings.wakeup_ns
    bounds = bounds_during(
        subjects,
        before.subjects,
        after.subjects,
        handovers,
        known=before.bounds,
        wakeup_ns=wakeup_ns,
        is_idle=is_idle,
    )
    verdict = judge(subjects, bounds, unknown=before.unknown, measured=surroundings.measured, searches=False)
    joined = Study(subjects, bounds, verdict, before.unknown)
    if is_idle:
        return replace(
            joined, verdict=replace(verdict, why=f"{verdict.why}, with the change {AT_AN_IDLE_INSTANT}")
        )
    if found := _run_during(before, after, joined, handovers, wakeup_ns):
        joined = replace(joined, verdict=found)
    return joined


def _run_during(
    before: Study, after: Study, joined: Study, handovers: Handovers, wakeup_ns: int
) -> Verdict | None:
    """Not schedulable, by a run on a CPU where a bound is above its deadline."""
    for cpu in by_cpu(joined.subjects):
        names = {one.name for one in cpu}
        if all(joined.bounds[name].meets_deadline for name in names & joined.bounds.keys()):
            continue
        old, new = ({one.name: one for one in side.subjects if one.name in names} for side in (before, after))
        times = {name: ns for name, ns in handovers.items() if name in names and ns is not None}
        found = None
        with optional_part():
            found = change_witness(old, new, times, wakeup_ns=wakeup_ns)
        if found is not None and found[0].missed is not None:
            schedule, change_ns = found
            priorities = {one.name: one.machine.priority for one in cpu}
            why = miss_text(schedule, found[0].missed, priorities)
            change = f", with the change at {in_ms(change_ns)}"
            return Verdict(Outcome.NOT_SCHEDULABLE, f"{why}{change}", schedule)
    return None
