"""The timing of a running executor, as its own analysis sees it.

Import this module only to judge: it loads the analysis, which an executor that judges nothing does without.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from mauve_rt._kernel import ComponentDescription
from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.analysis.time_limit import time_limit
from mauve_rt.control.change_timing import (
    JudgedChange,
    handovers_of,
    judged_change,
    with_blends,
    with_times_of_core,
)
from mauve_rt.control.changed_parts import ChangedParts
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.threads import threads_of
from mauve_rt.model.component_machines import component_machines
from mauve_rt.model.steps import Step
from mauve_rt.model.threads import ThreadInfo, ThreadList, is_named

VERDICT_NS = 100_000_000
"""CPU time for the verdicts on one change: other requests wait until its reply."""


class Timed(NamedTuple):
    """What runs now, and what is known of its timing."""

    components: list[Machine]
    surroundings: Surroundings
    study: Study


class Timing:
    """The study of what runs; computed again when that has changed.

    A component that is stopped counts as if it ran: a start by itself is not judged.
    """

    def __init__(
        self,
        runtime: Runtime,
        *,
        uses: Callable[[], Mapping[str, Collection[str]]] = dict,
        others: Callable[[], Iterable[ThreadInfo]] = tuple,
    ) -> None:
        """`uses` and `others`: as for `threads_of`."""
        self._runtime = runtime
        self._uses, self._others = uses, others
        self._timed: Timed | None = None

    def now(self) -> Timed:
        """What `mauve analyze` says of the executor's node."""
        parts = self._runtime.components()
        return self._now(self._components(parts), self._uses())

    def _components(self, parts: Sequence[ComponentDescription]) -> list[Machine]:
        runtime = self._runtime
        kinds = {resource.name: resource.kind for resource in runtime.described_resources()}
        return [
            with_times_of_core(machine, part, runtime.declared(part.name), runtime.registry)
            for machine, part in zip(component_machines(parts, kinds, runtime.index), parts, strict=True)
        ]

    def _now(self, components: list[Machine], uses: Mapping[str, Collection[str]]) -> Timed:
        others = self._others()
        surroundings = Surroundings(threads=self._threads(components, uses, others))
        known = self._timed
        if known is None or (known.components, known.surroundings) != (components, surroundings):
            known = self._timed = Timed(components, surroundings, study(components, surroundings))
        return known

    def _threads(
        self, components: Sequence[Machine], uses: Mapping[str, Collection[str]], others: Iterable[ThreadInfo]
    ) -> ThreadList:
        has_bounds = any(state.is_watched for machine in components for state in machine.states)
        return threads_of(self._runtime, components, uses, has_bounds=has_bounds, others=others)

    def of_change(
        self,
        steps: Sequence[Step],
        *,
        always: bool = True,
        is_idle: bool = False,
        awaits_idle: bool = False,
    ) -> "TimedChange | None":
        """What steps do that the executor accepts; unless `always`, None where no demand grows.

        `is_idle` and `awaits_idle`: as for `judged_change`.

        Raises:
            NoVerdictError: the verdicts would take longer than VERDICT_NS.
            MauveError: the states of a component cannot be so.
        """
        runtime = self._runtime
        parts, uses = runtime.components(), self._uses()
        with time_limit(VERDICT_NS):
            components = self._components(parts)
            known = {machine.name: machine for machine in components}
            changed = ChangedParts(steps, runtime, parts, uses)
            machines = with_blends(changed.machines(known), known, steps)
            handovers = handovers_of(steps, changed.cores(), runtime.registry)
            lowers = not handovers and all(_is_within(one, known.get(one.name)) for one in machines)
            if lowers and not always:
                return None
            now = self._now(components, uses)
            # Threads that are no component's stay; those of removed components end.
            others = [each for each in self._others() if not is_named(each.name, known)]
            threads = self._threads(machines, changed.uses, others)
            judged = judged_change(
                now.study,
                now.surroundings,
                machines,
                threads,
                handovers,
                is_idle=is_idle,
                awaits_idle=awaits_idle,
            )
        return TimedChange(now.study, judged, lowers_demand=lowers)


class TimedChange(NamedTuple):
    """What is known of a change."""

    now: Study
    judged: JudgedChange
    lowers_demand: bool
    """Whether each component asks for no more than before, at any instant."""


def _is_within(after: Machine, before: Machine | None) -> bool:
    """Whether a component asks for no more than before: the same, with no other locks."""
    if before is None:
        return False
    same = replace(
        after, holds=before.holds, undeclared_locks=before.undeclared_locks, clients=before.clients
    )
    return (
        same == before
        and {*after.holds} <= {*before.holds}
        and {*after.undeclared_locks} <= {*before.undeclared_locks}
        and {*after.clients} <= {*before.clients}
    )
