"""A rules file: schema, loading, checks.

    mauve: 1
    executor: executor              # relative to the supervisor's namespace
    on_supervisor_loss: keep        # or release: what its rules have in force ends when it is gone
    rules:
      - name: link_lost
        when: {silence: {topic: radio/in, type: mauve_msgs/msg/PeerMessage, longer_than_s: 1.0}}
        in: executor                # who runs it: the executor itself, or its supervisor
        priority: 0                 # of several that hold, the highest decides
        for_s: 0.0                  # the condition must hold so long before `do`
        do: [{kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}]
        undo: {for_s: 3.0}          # what was there before comes back
        cooldown_s: 0.0             # from the outcome of an action to the next action of the rule
        otherwise: stop             # where `do` does not come about: stop, or safe_outputs
        otherwise_after_s: 0.1      # from the instant at which `do` is due
        safety: false               # above all rules that are not, and above what persons put over rules
        latch: false                # it ends by `mauve rules reset` only
        whole: false                # it does nothing while another rule or a person has taken a part of it
        snapshot: false             # when `do` begins, the executor writes the last seconds of its recording

What may stand in `when`: see supervision/when.py. One file serves both: the executor runs the rules that are
`in: executor`; its supervisor runs the others, and those too where the executor does not. Names of topics and
of the executor are resolved against the namespace of who runs the rule, as ROS 2 does.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.kinds import Choice, Faults, Flag, ListOf, Real, Whole
from mauve_rt.file_schema.section import Part, Section, setting
from mauve_rt.file_schema.yaml_file import Location, YamlFile
from mauve_rt.model.schema import IDENTIFIER, ROS_NAME
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import ANY_STEPS, STEPS, Step, dotted, form_error
from mauve_rt.supervision.outside import inside_only
from mauve_rt.supervision.when import When, WhenPart
from mauve_rt.supervision.when_spec import refusal

_SECONDS = Real(least=0)
MOST_PRIORITY = 1000


class Undo(Section):
    """What a rule does once its condition has been false for `for_s` seconds without a break."""

    for_s: float = setting(_SECONDS, "the condition must be false for so long without a break", default=0.0)
    do: list[Step] = setting(
        ANY_STEPS,
        "what is in force from then on, unless a person gave the element its value; without the key what was "
        "there before",
        default=[],
    )


class Rule(Section):
    """One condition and what to do about it. Times in seconds."""

    name: str = setting(IDENTIFIER, "name of the rule, unique in the file")
    when: When = setting(WhenPart(), "the condition")
    where: Literal["executor", "supervisor"] = setting(
        Choice("executor", "supervisor"), "process that runs the rule", default="executor", key="in"
    )
    priority: int = setting(
        Whole(0, MOST_PRIORITY),
        "of several rules that hold for one component, the highest priority decides",
        default=0,
    )
    for_s: float = setting(_SECONDS, "the condition must hold for so long without a break", default=0.0)
    do: list[Step] = setting(STEPS, "the action: steps as in a steps file")
    undo: Undo | None = setting(
        Part(Undo), "when the action is undone; without the key what it did stays", default=None
    )
    cooldown_s: float = setting(
        _SECONDS, "shortest time from the outcome of an action to the next action of the rule", default=0.0
    )
    otherwise: Literal["stop", "safe_outputs"] | None = setting(
        Choice("stop", "safe_outputs"),
        "reserve action where `do` does not take effect; only for rules of an executor",
        default=None,
    )
    otherwise_after_s: float = setting(
        _SECONDS, "time from the instant at which `do` is due to the reserve action", default=0.1
    )

    takes_over: bool = setting(
        Flag(),
        "whether the steps of `undo` are in force at its end also where a person gave the element its value",
        default=False,
    )
    safety: bool = setting(
        Flag(),
        "ranks above all rules that are not safety rules, and above what persons put over rules; needs "
        "`otherwise`",
        default=False,
    )
    latch: bool = setting(
        Flag(), "stays active until `mauve rules reset`, once its condition is false", default=False
    )
    whole: bool = setting(
        Flag(), "does nothing while a rule of higher rank or a person has taken a part of it", default=False
    )
    snapshot: bool = setting(
        Flag(),
        "when `do` begins, the executor writes the last seconds of its recording as a bag (bag_snapshot_s)",
        default=False,
    )

    def steps(self, act: str) -> list[Step]:
        """The transaction of `do` or `undo`."""
        if act == "do":
            return self.do
        return self.undo.do if self.undo is not None else []

    def targets(self) -> set[str]:
        """Components that must run before the rule is armed: those of which it replaces or sets something.

        One that it starts or stops itself need not run.
        """
        own = {step.target for step in self.do if step.kind in ("start", "stop")}
        return {step.target for step in self.do if STEP_KINDS[step.kind].needs_running} - own


class Rules(Section):
    """A whole rules file."""

    mauve: Literal[1] = setting(Choice(1), "version of the schema")
    executor: str = setting(
        ROS_NAME, "node of the executor, relative to the namespace of the supervisor", default="executor"
    )
    on_supervisor_loss: Literal["keep", "release"] = setting(
        Choice("keep", "release"),
        "what the supervisor's rules have in force when it is gone: keep it for a later supervisor of its "
        "name, or bring back what was there before",
        default="keep",
    )
    rules: list[Rule] = setting(ListOf(Part(Rule), few=1), "the rules")


def lacks_type(leaf: When) -> bool:
    """Whether a condition listens to a topic and does not say of which type."""
    told = leaf.parameters
    return bool(told.get("topic")) and not told.get("type")


class RulesFile:
    """A checked rules file: `rules`, and `error()` for what only its user can check, e.g. installed types."""

    def __init__(self, path: str | Path, *, waits: bool = True) -> None:
        """Read and check a rules file; `waits` as of YamlFile.

        Raises:
            ArchitectureFileError: it cannot be read, is no YAML or breaks the schema;
                `FILE:LINE:COLUMN: what`, one line.
        """
        self._file = YamlFile(path, waits=waits)
        faults: Faults = []
        self.rules = Rules.read(self._file.data, (), faults)
        if faults:
            raise form_error(self._file, faults)
        if problems := list(self._refused()):
            raise ArchitectureFileError(self.path, problems)
        seen: set[str] = set()
        for index, rule in enumerate(self.rules.rules):
            if rule.name in seen:
                raise self.error(("rules", index, "name"), f"a second rule named '{rule.name}'")
            seen.add(rule.name)

    def _refused(self) -> Iterator[Problem]:
        """What may be so each by itself, but not together."""
        for index, rule in enumerate(self.rules.rules):
            if rule.otherwise is not None and rule.where == "supervisor":
                what = "only an executor has a reserve action: a supervisor's request may not come through"
                remedy = "let the executor run the rule, `in: executor`"
                yield self.problem(("rules", index, "otherwise"), what, remedy=remedy)
            yield from self._misfits(rule, index)
            for leaf in rule.when.leaves():
                place = (*leaf.place, leaf.kind)
                if (error := refusal(leaf)) is not None:
                    yield self.problem(
                        (*place, error.element),
                        f"bad {dotted(place)}: {error.statement}",
                        expected=error.expected,
                        found=error.found,
                        remedy=error.remedy,
                    )
                elif rule.where == "supervisor" and lacks_type(leaf):
                    yield self.untyped(leaf)
                elif rule.where == "supervisor" and (what := inside_only(leaf)):
                    remedy = "let the executor run the rule, `in: executor`"
                    yield self.problem((*place,), f"only in the executor {what}", remedy=remedy)

    def _misfits(self, rule: Rule, index: int) -> Iterator[Problem]:
        """Keys that make no sense together."""
        for key in ("safety", "latch", "whole", "takes_over"):
            if getattr(rule, key) and rule.where == "supervisor":
                what = f"only a rule of the executor can have `{key}`: a supervisor may come to its end"
                yield self.problem(("rules", index, key), what, remedy="write `in: executor`")
        if rule.safety and rule.otherwise is None:
            what = f"safety rule '{rule.name}' has no `otherwise`: nothing happens where its `do` fails"
            yield self.problem(("rules", index, "safety"), what, remedy="add otherwise: stop")
        if rule.safety and rule.whole:
            what = f"safety rule '{rule.name}' may not be `whole`: it would do nothing while a part is taken"
            yield self.problem(("rules", index, "whole"), what, remedy="leave `whole` out")

    def untyped(self, leaf: When) -> Problem:
        """That a condition in the supervisor lacks the type of the topic to which it listens."""
        place = (*leaf.place, leaf.kind)
        what = f"{dotted((*place, 'type'))} is missing: a supervisor has nothing else to tell it the type"
        remedy = "add the type of the topic, as type: std_msgs/msg/Float64"
        return self.problem((*place, "topic"), what, remedy=remedy)

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
