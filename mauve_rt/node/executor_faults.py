"""Faults, noticed once each."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from mauve_rt._kernel import ComponentDescription
from mauve_rt.node.executor_requests import Code, Outcome, Request, Step


class NewFault(NamedTuple):
    """A fault that was not there before."""

    part: ComponentDescription
    core_before: str

    @property
    def message(self) -> str:
        """What became of the component."""
        if self.part.fell_back:
            return f"component '{self.part.name}' runs its fallback core {self.part.core} after a fault"
        return f"component '{self.part.name}' is faulted"

    def event(self, revision: int) -> tuple[Request, Outcome]:
        """What ~/events tells of a fallback core that took over: nobody asked for it but the kernel."""
        part = self.part
        step = Step("replace_core", part.name, part.core)
        request = Request(steps=(step,), requested_by="kernel", cause=part.fault)
        outcome = Outcome(
            code=Code.OK,
            message=self.message,
            revision=revision,
            from_core=self.core_before,
            to_core=part.core,
        )
        return request, outcome


class FaultWatch:
    """Compares the components with what they were."""

    def __init__(self) -> None:
        self._told: dict[str, str] = {}
        self._cores: dict[str, str] = {}

    def look(self, parts: Sequence[ComponentDescription]) -> Iterator[NewFault]:
        """Yield the faults that are new since the last look."""
        told, cores = self._told, self._cores
        self._told = {part.name: part.fault for part in parts}
        self._cores = {part.name: part.core for part in parts}
        for part in parts:
            if part.fault and told.get(part.name) != part.fault:
                yield NewFault(part, cores.get(part.name, ""))
