"""The public headers of C++: each declaration with a `///` comment, and its first sentence."""

import re
from collections.abc import Iterator
from pathlib import Path

from _reference import ROOT
from _reference.tables import table

_INCLUDE = ROOT / "mauve_rt/kernel/include"
_DOOR = _INCLUDE / "mauve_rt/mauve_rt.hpp"
_SECTION = re.compile(r"^ (public|protected|private):$")
_LONGEST = 120  # characters of a declaration


def public_headers() -> list[str]:
    """The headers that mauve_rt/mauve_rt.hpp includes."""
    return re.findall(r'^#include "(.*)"$', _DOOR.read_text(encoding="utf-8"), re.MULTILINE)


def text() -> str:
    """A section for each header."""
    return "\n".join(_header(name) for name in public_headers())


def _header(name: str) -> str:
    lines = (_INCLUDE / name).read_text(encoding="utf-8").splitlines()
    says = " ".join(line.removeprefix("// ") for line in lines[1 : lines.index("#pragma once")])
    rows = [(f"`{declaration}`", sentence) for declaration, sentence in declarations(_INCLUDE / name)]
    return f"## {name}\n\n{says}\n\n" + (table(("declaration", "meaning"), rows) if rows else "")


def declarations(header: Path) -> Iterator[tuple[str, str]]:
    """Each commented declaration that others may use, and what the first sentence of its comment says."""
    lines = header.read_text(encoding="utf-8").splitlines()
    is_public = True
    comment: list[str] = []
    for number, line in enumerate(lines):
        if found := _SECTION.match(line):
            is_public = found[1] == "public"
        elif line.startswith(("struct", "enum", "}", "class")):
            is_public = not line.startswith("class")
        if line.lstrip().startswith("///"):
            comment.append(line.lstrip("/ "))
        elif comment:
            is_member = line.startswith("  ")
            if (is_public or not is_member) and not line.startswith("   "):
                yield _declaration(lines[number:]), _first_sentence(comment)
            comment = []


def _declaration(lines: list[str]) -> str:
    """Up to its body, in one line."""
    text = ""
    for line in lines:
        text += " " + line.partition("//")[0].strip()
        if re.search(r"[{;]", text):
            break
    short = re.split(r" = default| *[{;]| : (?=\w+[_(])", " ".join(text.split()))[0].removesuffix(" =")
    return short if len(short) <= _LONGEST else f"{short[:_LONGEST]}..."


def _first_sentence(comment: list[str]) -> str:
    words = " ".join(" ".join(line for line in comment if not line.startswith("|")).split())
    return re.split(r"(?<=[.;]) (?=[A-Z])", words)[0]
