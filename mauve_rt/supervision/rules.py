"""The rules file of a supervisor: schema, loading, checks.

    mauve: 1
    executor: executor              # relative to the supervisor's namespace
    rules:
      - name: link_lost
        when: {silence: {topic: radio/in, type: mauve_msgs/msg/PeerMessage, longer_than_s: 1.0}}
        in: supervisor              # who runs it; there is nobody else yet
        priority: 0                 # of several that hold, the highest decides
        for_s: 0.0                  # the condition must hold so long before `do`
        do: [{kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}]
        undo: {for_s: 3.0, do: [{kind: replace_core, target: exploration, name: mauve_examples/Exploration}]}
        cooldown_s: 0.0             # from the outcome of an action to the next action of the rule
        max_missed: 0               # releases that each component may miss for `do`; in undo: for that

What may stand in `when`: see supervision/when.py. Names of topics and of the executor are resolved
against the supervisor's namespace, as ROS 2 does.
"""

from pathlib import Path
from typing import Literal

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.model.kinds import Choice, Faults, ListOf, Real, Whole
from mauve_rt.model.schema import IDENTIFIER, ROS_NAME
from mauve_rt.model.section import Part, Section, setting
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import MISSED, STEPS, Step, form_error
from mauve_rt.model.yaml_file import Location, YamlFile
from mauve_rt.supervision.when import When, WhenPart

_SECONDS = Real(least=0)
MOST_PRIORITY = 1000


class Undo(Section):
    """What a rule does once its condition has been false for `for_s` seconds without a break."""

    for_s: float = setting(_SECONDS, default=0.0)
    do: list[Step] = setting(STEPS)
    max_missed: int = setting(MISSED, default=0)


class Rule(Section):
    """One condition and what to do about it. Times in seconds."""

    name: str = setting(IDENTIFIER)
    when: When = setting(WhenPart())
    where: Literal["supervisor"] = setting(Choice("supervisor"), default="supervisor", key="in")
    priority: int = setting(Whole(0, MOST_PRIORITY), default=0)
    for_s: float = setting(_SECONDS, default=0.0)
    do: list[Step] = setting(STEPS)
    undo: Undo | None = setting(Part(Undo), default=None)
    cooldown_s: float = setting(_SECONDS, default=0.0)
    max_missed: int = setting(MISSED, default=0)

    def targets(self) -> set[str]:
        """Components that must run before the rule is armed: those of which it replaces or sets something."""
        return {step.target for step in self.do if STEP_KINDS[step.kind].needs_running}


class Rules(Section):
    """A whole rules file."""

    mauve: Literal[1] = setting(Choice(1))
    executor: str = setting(ROS_NAME, default="executor")
    rules: list[Rule] = setting(ListOf(Part(Rule), few=1))


class RulesFile:
    """A checked rules file: `rules`, and `error()` for what only its user can check, e.g. installed types."""

    def __init__(self, path: str | Path) -> None:
        """Read and check a rules file.

        Raises:
            ArchitectureFileError: it cannot be read, is no YAML or breaks the schema;
                `FILE:LINE:COLUMN: what`, one line.
        """
        self._file = YamlFile(path)
        faults: Faults = []
        self.rules = Rules.read(self._file.data, (), faults)
        if faults:
            raise form_error(self._file, faults)
        seen: set[str] = set()
        for index, rule in enumerate(self.rules.rules):
            if rule.name in seen:
                raise self.error(("rules", index, "name"), f"a second rule named '{rule.name}'")
            seen.add(rule.name)

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    def problem(self, location: Location, what: str, **facts: str) -> Problem:
        """A problem at one element, e.g. ("rules", 0, "when", "silence", "type")."""
        return self._file.problem(location, what, **facts)

    def error(self, location: Location, what: str, *, remedy: str = "") -> ArchitectureFileError:
        """An error about one element, e.g. ("rules", 0, "when", "silence", "type")."""
        return ArchitectureFileError(self.path, [self.problem(location, what, remedy=remedy)])
