"""What keeps the rules of a file from being run: names, what cannot be heard, what cannot be made ready."""

from mauve_rt.errors import Problem
from mauve_rt.model import ArchitectureModel, PluginIndex
from mauve_rt.supervision.rule_actions import unprepared
from mauve_rt.supervision.rule_hearing import only_outside
from mauve_rt.supervision.rule_names import name_findings
from mauve_rt.supervision.rules import RulesFile


def all_findings(file: RulesFile, model: ArchitectureModel | None) -> list[Problem]:
    """Those of standing_findings(), and what the executor of `model` would refuse.

    Raises:
        ArchitectureFileError: the architecture cannot be built or configured.
    """
    found = standing_findings(file, model)
    if model is not None:
        from mauve_rt.supervision.rehearsal import rehearsal_problems  # noqa: PLC0415 - it needs a simulation

        found += rehearsal_problems(file, model)
    return found


def standing_findings(file: RulesFile, model: ArchitectureModel | None) -> list[Problem]:
    """Names that are not there, and what who runs a rule can neither hear nor make ready."""
    parts = model.parts if model is not None else None
    plugins = PluginIndex.installed() if parts is None else parts.index
    steps = (
        problem for index in range(len(file.rules.rules)) for problem in unprepared(file, index, plugins)
    )
    return [*name_findings(file, model), *only_outside(file), *steps]
