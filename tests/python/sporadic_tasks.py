"""Sporadic tasks for tests of the analysis: a sporadic task is a digraph with one vertex."""

from collections.abc import Sequence
from dataclasses import dataclass

from mauve_rt.analysis.critical_section import CriticalSection
from mauve_rt.analysis.digraph import DigraphTask, Job
from mauve_rt.analysis.digraph_times import Component, DigraphTimes, digraph_times


@dataclass(frozen=True, kw_only=True)
class SporadicTask:
    """A thread under SCHED_FIFO: jobs of one kind, each at least the separation after the one before."""

    name: str
    priority: int
    separation_ns: int
    cost_ns: int
    deadline_ns: int
    jitter_ns: int = 0
    sections: tuple[CriticalSection, ...] = ()

    def component(self, *, waits_for_services: bool = False) -> Component:
        job = Job("Wait", (), self.cost_ns, "Wait", self.separation_ns, self.deadline_ns)
        return Component(
            DigraphTask(self.name, (job,)),
            self.priority,
            jitter_ns=self.jitter_ns,
            sections=self.sections,
            waits_for_services=waits_for_services,
        )


def response_times(tasks: Sequence[SporadicTask]) -> list[DigraphTimes]:
    """The bounds of the tasks of one CPU, in their order."""
    found = digraph_times([task.component() for task in tasks])
    return [found[task.name] for task in tasks]
