"""The rules file of a supervisor: schema, loading, checks.

    mauve: 1
    executor: executor              # relative to the supervisor's namespace
    rules:
      - name: link_lost
        when: {silence: {topic: radio/in, type: mauve_msgs/msg/PeerMessage, longer_than_s: 1.0}}
        for_s: 0.0                  # the condition must hold so long before `do`
        do: [{kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}]
        undo: {for_s: 3.0, do: [{kind: replace_core, target: exploration, name: mauve_examples/Exploration}]}
        cooldown_s: 0.0             # from the outcome of an action to the next action of the rule

Names of topics and of the executor are resolved against the supervisor's namespace, as ROS 2 does.
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model.schema import Identifier, RosName
from mauve_rt.model.steps import Step, form_problem
from mauve_rt.model.yaml_file import Location, YamlFile

Seconds = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
MessageType = Annotated[str, Field(pattern=r"^[a-z]\w*/msg/[A-Z]\w*$")]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Silence(_Model):
    """Holds while the last sample on `topic` (before a first one: the arming) is older than a limit."""

    topic: RosName
    type: MessageType
    longer_than_s: Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class When(_Model):
    """What a rule waits for: exactly one kind of condition."""

    silence: Silence


class Undo(_Model):
    """What a rule does once its condition has been false for `for_s` seconds without a break."""

    for_s: Seconds = 0.0
    do: Annotated[list[Step], Field(min_length=1)]


class Rule(_Model):
    """One condition and what to do about it. Times in seconds."""

    name: Identifier
    when: When
    for_s: Seconds = 0.0
    do: Annotated[list[Step], Field(min_length=1)]
    undo: Undo | None = None
    cooldown_s: Seconds = 0.0

    def targets(self) -> set[str]:
        """Components that must run before the rule is armed: those of which it replaces or sets something."""
        kinds = ("replace_core", "replace_fsm", "replace_shell", "set_property")
        return {step.target for step in self.do if step.kind in kinds}


class Rules(_Model):
    """A whole rules file."""

    mauve: Literal[1]
    executor: RosName = "executor"
    rules: Annotated[list[Rule], Field(min_length=1)]


class RulesFile:
    """A checked rules file: `rules`, and `error()` for what only its user can check, e.g. installed types."""

    def __init__(self, path: str | Path) -> None:
        """Read and check a rules file.

        Raises:
            ArchitectureFileError: it cannot be read, is no YAML or breaks the schema;
                `FILE:LINE:COLUMN: what`, one line.
        """
        self._file = YamlFile(path)
        try:
            self.rules = Rules.model_validate(self._file.data)
        except ValidationError as error:
            problems = [form_problem(self._file, item) for item in error.errors(include_url=False)]
            raise ArchitectureFileError(self._file.path, problems) from None
        seen: set[str] = set()
        for index, rule in enumerate(self.rules.rules):
            if rule.name in seen:
                raise self.error(("rules", index, "name"), f"a second rule named '{rule.name}'")
            seen.add(rule.name)

    @property
    def path(self) -> Path:
        """The file."""
        return self._file.path

    def error(self, location: Location, what: str, *, remedy: str = "") -> ArchitectureFileError:
        """An error about one element, e.g. ("rules", 0, "when", "silence", "type")."""
        return ArchitectureFileError(self.path, [self._file.problem(location, what, remedy=remedy)])
