"""The timing of a running executor, as its own analysis sees it.

Import this module only to judge: it loads the analysis, which an executor that judges nothing does without.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import NamedTuple

from mauve_rt.analysis.machines import Machine
from mauve_rt.analysis.study import Study, Surroundings, study
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.threads import threads_of
from mauve_rt.model.component_machines import component_machines
from mauve_rt.model.threads import ThreadInfo


class Timed(NamedTuple):
    """What runs now, and what is known of its timing."""

    components: list[Machine]
    surroundings: Surroundings
    study: Study


class Timing:
    """The study of what runs; computed again when that has changed. For one thread at a time.

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
        runtime = self._runtime
        parts = runtime.components()
        kinds = {resource.name: resource.kind for resource in runtime.described_resources()}
        components = component_machines(parts, kinds, runtime.index)
        surroundings = Surroundings(threads=threads_of(runtime, parts, self._uses(), others=self._others()))
        known = self._timed
        if known is None or (known.components, known.surroundings) != (components, surroundings):
            known = self._timed = Timed(components, surroundings, study(components, surroundings))
        return known
