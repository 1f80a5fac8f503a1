"""Faults, noticed once each."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from mauve_rt._kernel import ComponentDescription
from mauve_rt.control.requests import Code, Outcome, Report, Request
from mauve_rt.model.steps import Step


class NewFault(NamedTuple):
    """A fault that was not there before."""

    part: ComponentDescription
    core_before: str

    @property
    def message(self) -> str:
        """What became of the component."""
        if self.part.fell_back:
            return f"component '{self.part.name}' runs its fallback core {self.part.fallback} after a fault"
        return f"component '{self.part.name}' is faulted"

    def event(self, revision: int) -> tuple[Request, Outcome]:
        """What ~/events tells of a fallback core that took over: nobody asked for it but the kernel."""
        part = self.part
        step = Step("replace_core", part.name, part.fallback)
        request = Request(steps=(step,), requested_by="kernel", cause=part.fault)
        report = Report(
            step=f"replace_core {part.fallback}",
            component=part.name,
            from_core=self.core_before,
            to_core=part.fallback,
        )
        outcome = Outcome(
            code=Code.OK,
            message=self.message,
            revision=revision,
            report=(report,),
            from_core=report.from_core,
            to_core=report.to_core,
        )
        return request, outcome


class FaultWatch:
    """Compares the components with what they were.

    A fault that a watchdog found while the state lasts is told twice: the component is faulted first, and its
    fallback core takes over when the state ends.
    """

    def __init__(self) -> None:
        self._told: dict[str, tuple[str, bool]] = {}
        self._cores: dict[str, str] = {}

    def look(self, parts: Sequence[ComponentDescription]) -> Iterator[NewFault]:
        """Yield the faults, and the fallback cores that took over, that are new since the last look."""
        told = self._told
        self._told = {part.name: (part.fault, part.fell_back) for part in parts}
        self._cores |= {part.name: part.core for part in parts if not part.fault}
        for part in parts:
            if part.fault and told.get(part.name) != (part.fault, part.fell_back):
                yield NewFault(part, self._cores.get(part.name, ""))
