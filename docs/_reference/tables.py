"""Tables of settings in Markdown: type, unit, range and default of a key in words."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from mauve_rt.file_schema import kinds
from mauve_rt.file_schema.section import Part, Section, Setting
from mauve_rt.file_schema.setting_words import range_of, sentence, unit_of

_WORDS = {  # of kinds without bounds; a new kind needs a line
    "Flag": "boolean",
    "_Requirement": "boolean, or the word `warn`",
    "Scalar": "boolean, number or text",
    "WhenPart": "[condition](#conditions)",
    "_TypeName": "[type](#types)",
    "_Duration": "[time](#times)",
    "_Type": "mapping of fields to [types](#types), or [a struct in C++](#type-in-c)",
    "_Call": "a service's type, or [a call in C++](#call-in-c)",
    "_Next": "a state, or a list of `{if: GUARD, to: STATE}` and a state",
    "_StepPart": "[step](steps_file.md#step)",
}
HEAD = ("key", "type", "unit", "range", "default", "meaning")


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown, without the columns that are empty in each row."""
    cells = [[cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    filled = [column for column in range(len(head)) if any(row[column] for row in cells)]
    lines = [[row[column] for column in filled] for row in (head, ["---"] * len(head), *cells)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def section_table(section: type[Section], links: Mapping[type[Section], str]) -> str:
    """The keys of a section. `links` has the headings of the sections within it."""
    return table(HEAD, [setting_row(key, each, links) for key, each in section.settings.items()])


def setting_row(
    key: str, setting: Setting, links: Mapping[type[Section], str], *, unit: str = ""
) -> list[str]:
    """A row of HEAD.

    Raises:
        ValueError: the key has no description.
    """
    if not setting.what:
        raise ValueError(f"{key}: expected a description, found none; give the setting one")
    kind, bounds = words(setting.kind, links)
    default = "required" if setting.is_required else shown(setting.default)
    return [f"`{key}`", kind, unit or unit_of(key), bounds, default, sentence(setting.what)]


def words(kind: kinds.Kind, links: Mapping[type[Section], str]) -> tuple[str, str]:
    """The type and the range of a value."""
    match kind:
        case kinds.ListOf():
            inner, bounds = words(kind.kind, links)
            return f"list of {_several(inner)}", "; ".join(part for part in (_count(kind), bounds) if part)
        case kinds.TableOf():
            inner, bounds = words(kind.kind, links)
            return f"mapping of names to {_several(inner)}", bounds
        case Part():
            return f"[mapping](#{links[kind.section]})", ""
        case _:
            return _plain_words(kind)


def _several(kind: str) -> str:
    for word in ("mapping", "integer", "number", "list", "step"):
        kind = re.sub(rf"^(\[?){word}\b", rf"\1{word}s", kind)
    return kind


def _plain_words(kind: kinds.Kind) -> tuple[str, str]:
    match kind:
        case kinds.Whole():
            return "integer", range_of(kind)
        case kinds.Real():
            return "number", range_of(kind)
        case kinds.Choice():
            return "word" if isinstance(kind.values[0], str) else "integer", ", ".join(
                f"`{value}`" for value in kind.values
            )
        case kinds.Text():
            return "text", kind.expected
        case _:
            return _WORDS[type(kind).__name__], ""


def _count(kind: kinds.ListOf) -> str:
    if kind.few == kind.many:
        return f"exactly {kind.few} elements"
    if kind.many is None:
        return f"at least {kind.few} element" if kind.few else ""
    return f"{kind.few} to {kind.many} elements"


def shown(value: Any) -> str:
    """A default as a file has it."""
    if value is None or value == "":
        return "none"
    if isinstance(value, Section):
        return "`{}`"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    return f"`{value}`"
