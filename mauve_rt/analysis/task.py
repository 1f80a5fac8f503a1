"""The parameters of a component that decide its response time."""

from dataclasses import dataclass

from mauve_rt.analysis.errors import AnalysisError

LOWEST_PRIORITY, HIGHEST_PRIORITY = 1, 99  # of SCHED_FIFO


@dataclass(frozen=True, kw_only=True)
class CriticalSection:
    """The longest time for which a job holds one resource.

    A job must not wait for a ROS service while it holds a resource: no bound on blocking covers such a wait.

    Attributes:
        resource: name of the resource, whose mutex inherits priorities.
        length_ns: longest execution from lock to unlock, nested sections included.
        inside: name of the resource that the job already holds when it locks this one; empty if there is
        none.

    Raises:
        AnalysisError: the length is not positive, or the section is inside itself.

    """

    resource: str
    length_ns: int
    inside: str = ""

    def __post_init__(self) -> None:
        _check(f"section of {self.resource}", "length_ns", self.length_ns, least=1)
        if self.inside == self.resource:
            raise AnalysisError(
                f"section of {self.resource}",
                "inside",
                expected="another resource",
                found=self.inside,
                remedy="Lock a resource once",
            )


@dataclass(frozen=True, kw_only=True)
class Task:
    """A periodic or sporadic component: one thread under SCHED_FIFO, pinned to one CPU.

    A call port runs the callee on the caller, so the callee's execution is part of the caller's `cost_ns`.

    Attributes:
        name: unique among the tasks of an analysis.
        cpu: number of the CPU the thread is pinned to.
        priority: 1 to 99 as for SCHED_FIFO; a larger number is more urgent.
        separation_ns: period, or least time between two arrivals.
        cost_ns: longest execution of a job, critical sections and callees included, waits excluded.
        deadline_ns: from arrival to finish; may exceed `separation_ns`.
        jitter_ns: longest delay from arrival to release, such as the wake-up latency of the machine.
        waits_ns: longest duration of each call of a job that waits for a ROS service (a self-suspension).
        sections: the critical sections of a job.

    Raises:
        AnalysisError: a number is not a whole number or out of its range; a section is longer than the job,
        or inside a resource that the task does not lock.

    """

    name: str
    cpu: int
    priority: int
    separation_ns: int
    cost_ns: int
    deadline_ns: int
    jitter_ns: int = 0
    waits_ns: tuple[int, ...] = ()
    sections: tuple[CriticalSection, ...] = ()

    def __post_init__(self) -> None:
        where = f"task {self.name}"
        _check(where, "cpu", self.cpu, least=0)
        _check(where, "priority", self.priority, least=LOWEST_PRIORITY, most=HIGHEST_PRIORITY)
        _check(where, "separation_ns", self.separation_ns, least=1)
        _check(where, "cost_ns", self.cost_ns, least=1)
        _check(where, "deadline_ns", self.deadline_ns, least=1)
        _check(where, "jitter_ns", self.jitter_ns, least=0)
        for wait_ns in self.waits_ns:
            _check(where, "waits_ns", wait_ns, least=1)
        for section in self.sections:
            _check(
                f"{where}, section of {section.resource}", "length_ns", section.length_ns, most=self.cost_ns
            )
        locked = {section.resource for section in self.sections}
        for section in self.sections:
            if section.inside and section.inside not in locked:
                raise AnalysisError(
                    f"{where}, section of {section.resource}",
                    "inside",
                    expected="a resource that the task locks",
                    found=section.inside,
                    remedy=f"Add the section of {section.inside}",
                )

    @property
    def resources(self) -> set[str]:
        """The names of the resources that a job locks."""
        return {section.resource for section in self.sections}


def _check(
    where: str, field: str, value: object, *, least: int | None = None, most: int | None = None
) -> None:
    limits = [f">= {least}"] if least is not None else []
    limits += [f"<= {most}"] if most is not None else []
    whole = isinstance(value, int) and not isinstance(value, bool)
    if whole and (least is None or value >= least) and (most is None or value <= most):  # type: ignore[operator]
        return
    remedy = "Choose a number in this range" if whole else "Use whole numbers; times are in nanoseconds"
    expected = f"a whole number {' and '.join(limits)}"
    raise AnalysisError(where, field, expected=expected, found=repr(value), remedy=remedy)
