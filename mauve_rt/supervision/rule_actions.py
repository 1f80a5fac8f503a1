"""What rules do, as an executor makes it ready: steps in names and plain values. Knows no ROS."""

import re
from collections.abc import Collection, Iterator, Sequence

from mauve_rt._kernel import ActionStep, RuleActions
from mauve_rt.control.limits import RequestLimits
from mauve_rt.control.requests import RefusalError
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.steps import Plan
from mauve_rt.errors import ArchitectureFileError, Problem
from mauve_rt.file_schema.yaml_file import Location
from mauve_rt.model.plugins import PluginIndex
from mauve_rt.model.schema import PropertyValue
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.model.steps import Step
from mauve_rt.supervision.rules import Rule, RulesFile

UNPREPARED = "the executor cannot make a step of kind {} ready for a rule"
REMEDY = "give the rule `in: supervisor`, or do it by steps about what is there"
AT_ONCE = "a rule of the executor replaces a core at once: with neither a probation nor `bumpless`"
IN_PYTHON = (
    "core {} is written in Python: to put it in needs the interpreter's lock, which something else may hold "
    "for long, and then its component comes too late"
)
CPP_REMEDY = "write the core in C++, or give the rule `in: supervisor`"


class _Collected:
    """Steps as a plan adds them to a transaction."""

    def __init__(self) -> None:
        self.steps: list[ActionStep] = []

    def add(self, kind: str, target: str = "", name: str = "", value: PropertyValue | None = None) -> None:
        self.steps.append(ActionStep(kind, target, name, value))


def own_rules(file: RulesFile, *, left_out: Collection[str] = ()) -> list[Rule]:
    """Those that the executor runs."""
    return [rule for rule in file.rules.rules if rule.where == "executor" and rule.name not in left_out]


def unprepared(file: RulesFile, index: int, plugins: PluginIndex) -> Iterator[Problem]:
    """Steps of a rule of the executor that it cannot make ready, or not carry out in time."""
    rule = file.rules.rules[index]
    if rule.where != "executor":
        return
    for place, step in _placed(rule, index):
        if not STEP_KINDS[step.kind].is_prepared:
            yield file.problem(place, UNPREPARED.format(step.kind), remedy=REMEDY)
        if step.kind == "replace_core" and step.value:
            yield file.problem((*place, "value"), AT_ONCE, remedy="give the rule `in: supervisor`")
        core = plugins.find("core", step.name) if STEP_KINDS[step.kind].name == "core" else None
        if core is not None and core.is_python:
            yield file.problem((*place, "name"), IN_PYTHON.format(core.name), remedy=CPP_REMEDY)


def rule_actions(file: RulesFile, runtime: Runtime, *, left_out: Collection[str] = ()) -> list[RuleActions]:
    """Of the rules that the executor runs, held against the components that there are.

    Raises:
        ArchitectureFileError: at a step that the executor would refuse.
    """
    return [
        _actions(file, index, runtime)
        for index, rule in enumerate(file.rules.rules)
        if rule.where == "executor" and rule.name not in left_out
    ]


def _actions(file: RulesFile, index: int, runtime: Runtime) -> RuleActions:
    rule = file.rules.rules[index]
    if problems := list(unprepared(file, index, runtime.index)):
        raise ArchitectureFileError(file.path, problems)
    places, steps = zip(*_placed(rule, index), strict=True)
    done = _planned(file, places, rule.do, runtime)
    both = _planned(file, places, steps, runtime)  # what undoes is about what was done
    return RuleActions(
        done,
        undo=both[len(done) :],
        reserve=rule.otherwise or "stop",
        takes_over=rule.takes_over,
        whole=rule.whole,
    )


def _placed(rule: Rule, index: int) -> list[tuple[Location, Step]]:
    """Its steps, with where they stand."""
    undo = rule.steps("undo")
    placed: list[tuple[Location, Step]] = [
        (("rules", index, "do", at), step) for at, step in enumerate(rule.do)
    ]
    return placed + [(("rules", index, "undo", "do", at), step) for at, step in enumerate(undo)]


def _planned(
    file: RulesFile, places: Sequence[Location], steps: Sequence[Step], runtime: Runtime
) -> list[ActionStep]:
    collected = _Collected()
    try:
        Plan(steps, runtime, runtime.components(), limits=RequestLimits(), taken={}, transaction=collected)
    except RefusalError as refusal:
        number = re.match(r"step (\d+) \(", str(refusal))  # told where there are several
        place = places[int(number[1]) - 1 if number else 0]
        raise file.error(place, str(refusal)) from None
    return collected.steps
