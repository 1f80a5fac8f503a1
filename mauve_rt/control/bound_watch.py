"""Watched bounds of a running executor: computed for each revision, compared with each job by the kernel.

Import this module only to watch: it loads the analysis.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from mauve_rt._kernel import BoundViolation, JobBound
from mauve_rt.analysis.bounds import jobs_by_waits
from mauve_rt.analysis.digraph_times import JobTime
from mauve_rt.analysis.excess import Excess, Term, largest_excess
from mauve_rt.analysis.machines import in_ms
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.timing import Timed, Timing
from mauve_rt.counts import counted
from mauve_rt.trace.format.jobs import traced_jobs

_Key = tuple[str, str, str]
"""Component, the wait before a job (of a first job the initial state), the wait after it."""


@dataclass(frozen=True, kw_only=True)
class WatchedBound:
    """The bound of one kind of job and measured times, with the fields of mauve_msgs/msg/JobBound."""

    after: str
    states: tuple[str, ...]
    until: str
    bound_ns: int
    deadline_ns: int
    longest_ns: int
    jobs: int
    violations: int


class Violation(NamedTuple):
    """Jobs of a component above their bound since the last look; the times are those of the worst one."""

    component: str
    after: str
    until: str
    instant_ns: int
    response_ns: int
    bound_ns: int
    jobs: int
    excess: Excess

    @property
    def message(self) -> str:
        """In words."""
        took = f"{self.after} -> {self.until} took {in_ms(self.response_ns)}"
        more = f"; {counted(self.jobs, 'job')} above the bound since the last message"
        return (
            f"component '{self.component}': {took} (bound {in_ms(self.bound_ns)}): {self.excess.text}"
            f"{more if self.jobs > 1 else ''}"
        )


class BoundWatch:
    """The bounds of one runtime. look() is for one thread, bounds() for any.

    | member   | written by | guarded by      |
    | -------- | ---------- | --------------- |
    | `_timed` | look()     |                 |
    | `_jobs`  | look()     | exchanged whole |
    """

    def __init__(self, runtime: Runtime, timing: Timing) -> None:
        """`timing`: of that runtime."""
        self._runtime = runtime
        self._timing = timing
        self._timed: Timed | None = None
        self._jobs: Mapping[_Key, JobTime] = {}

    def look(self) -> list[Violation]:
        """Violations since the last look; after a change the bounds of what runs now are watched."""
        found = [self._violation(one) for one in self._runtime.host.take_violations()]
        self._watch()
        return found

    def end(self) -> list[Violation]:
        """As look(), and watch no longer."""
        found = [self._violation(one) for one in self._runtime.host.take_violations()]
        self._runtime.host.end_job_watch()
        return found

    def bounds(self) -> dict[str, list[WatchedBound]]:
        """By component; none from a change until its bounds are computed."""
        jobs = self._jobs
        found: dict[str, list[WatchedBound]] = {}
        for figures in self._runtime.host.job_figures():
            known = jobs.get((figures.job.component, figures.job.after, figures.job.until))
            if known is not None:
                bound = WatchedBound(
                    after=figures.job.after,
                    states=known.job.states,
                    until=figures.job.until,
                    bound_ns=figures.job.bound_ns,
                    deadline_ns=known.job.deadline_ns,
                    longest_ns=figures.longest_ns,
                    jobs=figures.jobs,
                    violations=figures.violations,
                )
                found.setdefault(figures.job.component, []).append(bound)
        return found

    def _watch(self) -> None:
        runtime = self._runtime
        revision = runtime.kernel_revision()  # first: bounds of an earlier revision are refused
        timed = self._timing.now()
        if timed is self._timed and (runtime.host.watches_jobs() or not self._jobs):
            return
        machines = {one.name: one for one in timed.components}
        is_known = not timed.study.unknown
        self._jobs = {
            (name, *waits): one
            for name, bound in (timed.study.bounds.items() if is_known else ())
            for waits, one in jobs_by_waits(machines[name], bound).items()
        }
        bounds = [
            JobBound(component=component, after=after, until=until, bound_ns=one.response_ns)
            for (component, after, until), one in self._jobs.items()
        ]
        self._timed = timed
        if bounds:
            runtime.host.watch_jobs(
                bounds, revision
            )  # refused while a change is open: the next look asks again
        else:
            runtime.host.end_job_watch()

    def _violation(self, found: BoundViolation) -> Violation:
        job = found.job
        key = (job.component, job.after, job.until, found.instant_ns, found.response_ns, job.bound_ns)
        return Violation(*key, found.count, self._excess(found))

    def _excess(self, found: BoundViolation) -> Excess:
        host, timed = self._runtime.host, self._timed
        jobs = [*traced_jobs(found.records, host.trace_components(), host.trace_names())]
        own = [each for each in jobs if each.component == found.job.component]
        job = next((each for each in own if each.instant_ns == found.instant_ns), None)
        machines = {} if timed is None else {each.name: each for each in timed.components}
        if timed is None or job is None or job.component not in machines:  # a change has removed it since
            return Excess(Term.REST, "", found.response_ns - found.job.bound_ns, 0)
        wakeup_ns = timed.surroundings.wakeup_ns
        return largest_excess(job, jobs, machines, bound_ns=found.job.bound_ns, wakeup_ns=wakeup_ns)
