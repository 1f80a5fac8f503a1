"""Verdicts about cores on probation, noticed once each."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from mauve_rt._kernel import ProbationRecord
from mauve_rt.control.requests import Code, Outcome, Report, Request
from mauve_rt.counts import counted
from mauve_rt.model.steps import Step


class Verdict(NamedTuple):
    """A probation that was decided since the last look."""

    record: ProbationRecord

    @property
    def is_reverted(self) -> bool:
        """Whether the old core is back."""
        return self.record.verdict == "reverted"

    @property
    def message(self) -> str:
        """What came of the probation."""
        record = self.record
        releases = counted(record.releases, "release")
        text = f"probation of {record.to_core} in component '{record.component}': {record.verdict}"
        text += f" after {releases}"
        if record.reason:
            text += f": {record.reason}"
        stays = f"{record.from_core} is back" if self.is_reverted else f"{record.to_core} stays"
        return f"{text}; {stays}"

    def event(self, revision: int) -> tuple[Request, Outcome]:
        """What ~/events says of it: the kernel decided."""
        record = self.record
        step = Step("revert_core" if self.is_reverted else "probation", record.component)
        request = Request(steps=(step,), requested_by="kernel", cause=record.reason)
        cores = (record.to_core, record.from_core) if self.is_reverted else ("", "")
        report = Report(step=str(step), component=record.component, from_core=cores[0], to_core=cores[1])
        outcome = Outcome(
            code=Code.OK,
            message=self.message,
            revision=revision,
            report=(report,),
            from_core=cores[0],
            to_core=cores[1],
        )
        return request, outcome


class ProbationWatch:
    """Compares the probations with those that were told."""

    def __init__(self) -> None:
        self._told: dict[str, int] = {}  # by component: when the one that was told last began

    def look(self, records: Sequence[ProbationRecord]) -> Iterator[Verdict]:
        """Yield the verdicts that are new since the last look."""
        for record in records:
            if record.verdict != "running" and self._told.get(record.component, -1) < record.begin_ns:
                self._told[record.component] = record.begin_ns
                yield Verdict(record)
