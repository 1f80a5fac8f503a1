"""The messages, services and actions of mauve_msgs, with the comments of their files."""

import re
from pathlib import Path
from typing import NamedTuple

from _reference import ROOT
from _reference.tables import table

_DECLARED = re.compile(r"^(?P<type>\S+) +(?P<name>\w+)(?: *= *(?P<value>\S+))? *(?:# ?(?P<comment>.*))?$")

_SECTIONS = {".msg": ("",), ".srv": ("Request", "Reply"), ".action": ("Goal", "Result", "Feedback")}


class Declared(NamedTuple):
    """A field, or a constant with its value."""

    type: str
    name: str
    value: str
    comment: str


def messages() -> str:
    """All messages, by name."""
    return "\n".join(f"## {file.stem}\n\n{described(file)}" for file in files("msg"))


def services() -> str:
    """All services, by name."""
    return "\n".join(f"## {file.stem}\n\n{described(file)}" for file in files("srv"))


def actions() -> str:
    """All actions, by name."""
    return "\n".join(f"## {file.stem}\n\n{described(file)}" for file in files("action"))


def files(kind: str) -> list[Path]:
    """The files of a kind: msg, srv or action."""
    return sorted((ROOT / "mauve_msgs" / kind).glob(f"*.{kind}"))


def described(file: Path) -> str:
    """What the file says, then its fields: of a service or an action those of each section."""
    head, sections = parsed(file.read_text(encoding="utf-8"))
    titles = _SECTIONS[file.suffix]
    parts = [head] if head else []
    for title, fields in zip(titles, sections, strict=True):
        rows = [(f"`{_value(each)}`", f"`{each.type}`", each.comment) for each in fields]
        found = table(("field", "type", "meaning"), rows) if rows else "No fields.\n"
        parts.append(f"**{title}**\n\n{found}" if title else found)
    return "\n\n".join(parts)


def _value(each: Declared) -> str:
    return f"{each.name} = {each.value}" if each.value else each.name


def parsed(text: str) -> tuple[str, list[list[Declared]]]:
    """The comment at the top of a file, and the fields of each section between `---`."""
    head: list[str] = []
    sections: list[list[Declared]] = [[]]
    for line in text.splitlines():
        fields = sections[-1]
        if line.strip() == "---":
            sections.append([])
        elif found := _DECLARED.match(line):
            fields.append(Declared(**{name: value or "" for name, value in found.groupdict().items()}))
        elif line.startswith("#") and len(sections) == 1 and not fields:
            head.append(line.lstrip("# "))
        elif line.lstrip().startswith("#") and fields:  # a comment that goes on
            fields[-1] = fields[-1]._replace(comment=f"{fields[-1].comment} {line.lstrip('# ')}".strip())
        elif line.strip() and not line.startswith("#"):
            raise ValueError(f"expected a field, a constant or a comment, found: {line}")
    return "\n".join(head), sections
