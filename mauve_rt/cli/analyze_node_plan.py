"""`mauve analyze NODE --plan FILE`: the verdicts of a running executor on changes, by dry runs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import Reconfigure
from mauve_rt.analysis.bounds import Subject
from mauve_rt.analysis.study import Study
from mauve_rt.analysis.verdict import Outcome, Verdict
from mauve_rt.analysis.witness_json import witness_of_json
from mauve_rt.cli.analyze_plan import Plan
from mauve_rt.cli.client import Client, connected
from mauve_rt.control.requests import Code
from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.file_kind import FileKind
from mauve_rt.model.file_kinds import file_kind
from mauve_rt.model.steps import Change, load_change
from mauve_rt.supervision.rehearsal import RefusedStepError, refusals_at
from mauve_rt.supervision.rules import RulesFile


@dataclass(frozen=True)
class ReportedStudy(Study):
    """What an executor reports of its study: no bounds."""

    reported: Sequence[str] = ()

    @property
    def missing(self) -> list[str]:
        """As Study."""
        return [*self.reported]


def plans_of_node(node: str, path: Path) -> Iterator[Plan]:
    """The changes of a file of steps, or of the action of each rule.

    Raises:
        ArchitectureFileError: it is no such file, or the executor refuses a step.
    """
    kind = file_kind(path)
    with connected(first=True) as client:
        if kind is FileKind.RULES:
            file = RulesFile(path)
            for index, rule in enumerate(file.rules.rules):
                try:
                    yield _plan(client, node, f"when rule {rule.name} acts", Change(steps=list(rule.do)))
                except RefusedStepError as error:
                    raise file.error(("rules", index, "do", error.index), str(error)) from None
        elif kind is FileKind.STEPS:
            with refusals_at(path):
                yield _plan(client, node, "", load_change(path))
        else:
            what = "--plan: a running executor takes steps or rules"
            problem = Problem(line=1, column=1, what=what, found="an architecture file")
            raise ArchitectureFileError(path, [problem])


def _plan(client: Client, node: str, words: str, change: Change) -> Plan:
    listed = [ReconfigurationStep(**vars(step)) for step in change.steps]
    request = Reconfigure.Request(steps=listed, dry_run=True, idle=change.idle, requested_by="mauve analyze")
    reply = client.call(Reconfigure, f"{node}/reconfigure", request)
    if not reply.success and reply.code != Code.NOT_SCHEDULABLE:
        raise RefusedStepError(reply.message)
    during, after = [_study(verdict) for verdict in reply.timing][-2:] * (1 if len(reply.timing) > 1 else 2)
    return Plan(words, during, after)


def _study(told: Any) -> ReportedStudy:
    machines, schedule = witness_of_json(told.witness) if told.witness else ([], None)
    outcome = Outcome(told.outcome)
    verdict = Verdict(outcome, told.sentence.removeprefix(f"{outcome}: "), schedule)
    subjects = [Subject.of(machine) for machine in machines]
    return ReportedStudy(subjects, {}, verdict, (), tuple(told.missing))
