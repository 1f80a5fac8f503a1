"""The keys of rules files, steps files and scripts, with the kinds of conditions and steps."""

from _reference.tables import section_table, shown, table
from mauve_rt.file_schema.section import Section
from mauve_rt.file_schema.setting_words import limits, sentence
from mauve_rt.model import steps as steps_of_files
from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.supervision.condition_table import choices, conditions
from mauve_rt.supervision.rules import Rule, Rules, Undo
from mauve_rt.supervision.script import Heard, Script
from mauve_rt.supervision.when import COMBINATIONS, TIMES

_TYPES = {
    "bool": "boolean",
    "int": "integer",
    "float": "number",
    "str": "text",
    "topic": "name of a topic",
    "message_type": "message type",
    "component": "name of a component",
    "resource": "name of a resource",
    "executor": "namespace or full name of an executor",
    "field": "field of a message, as `pose.position.x`",
}


def rules() -> str:
    """The sections of a rules file, then its conditions."""
    links = {Rules: "the-file", Rule: "rule", Undo: "undo"}
    titles = {Rules: "The file", Rule: "rule", Undo: "undo"}
    parts = [f"## {title}\n\n{section_table(section, links)}" for section, title in titles.items()]
    combined = [*COMBINATIONS.items(), *TIMES.items()]
    head = (
        "## Conditions\n\n`when` has one condition, or one combination of conditions. The keys `for_s` and "
        "`within_s` may stand next to each of them.\n\n### Combinations\n"
    )
    return "\n".join(
        [
            *parts,
            head,
            table(("key", "holds while"), [(f"`{key}`", what) for key, what in combined]),
            *map(_condition, conditions()),
        ]
    )


def _condition(name: str) -> str:
    kind = conditions()[name]
    rows = []
    for each in kind.parameters:
        kind_of, bounds = _TYPES.get(each.type, "word"), limits(each.minimum, each.maximum)
        allowed = ", ".join(f"`{word}`" for word in choices(each)) or bounds
        default = "required" if each.required else shown(each.initial)
        rows.append((f"`{each.name}`", kind_of, each.unit, allowed, default))
    keys = table(("key", "type", "unit", "range", "default"), rows)
    return f"### {name}\n\nHolds while {kind.summary}.\n\n{keys}"


def steps() -> str:
    """The sections of a steps file, then the kinds of steps."""
    step, change = steps_of_files.StepForm, steps_of_files.Change
    rows = [
        (
            f"`{name}`",
            kind.target if kind.target != "all" else "",
            kind.name,
            kind.value,
            "executor, supervisor" if kind.is_prepared else "supervisor",
            _meaning(name),
        )
        for name, kind in STEP_KINDS.items()
    ]
    return "\n".join(
        [
            f"## The file\n\n{section_table(change, {})}",
            f"## Step\n\n{section_table(step, {})}",
            "## Kinds of steps\n\nA step may stand in the rules of the processes that the table names.\n",
            table(("kind", "target", "name", "value", "in rules of", "effect"), rows),
        ]
    )


def _meaning(name: str) -> str:
    if not STEP_KINDS[name].what:
        raise ValueError(f"step {name}: expected a description, found none; give STEP_KINDS one")
    return sentence(STEP_KINDS[name].what)


def script() -> str:
    """The sections of a script of `mauve rules try`."""
    links: dict[type[Section], str] = {Heard: "event"}
    return f"### The script\n\n{section_table(Script, links)}\n### Event\n\n{section_table(Heard, links)}"
