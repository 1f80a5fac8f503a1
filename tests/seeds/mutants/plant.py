#!/usr/bin/env python3
# SPDX-License-Identifier: LGPL-3.0-or-later
"""Write a copy of kernel, rules and bridge with each fault of the tables behind a run-time switch.

    plant.py --source ROOT --to FOLDER --table mutants.yaml [--table more.yaml]

Exit code 1: a table does not fit the sources.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

PARTS = ("mauve_rt/kernel", "mauve_rt/rules", "mauve_rt/bridge")
INDEX = "planted_mutants.inc"
COMMENTS_AND_TEXTS = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.DOTALL)
KEYS = {"number", "name", "file", "after", "original", "mutant", "fault"}


class TableError(Exception):
    """The table does not fit the sources."""


@dataclass(frozen=True)
class Mutant:
    """One fault of a table."""

    number: int
    name: str
    file: str
    original: str
    mutant: str
    after: str

    @property
    def where(self) -> str:
        """How messages name the mutant."""
        return f"{self.file}: mutant {self.number} ({self.name})"

    @property
    def is_statement(self) -> bool:
        """Whether the original text is one or more whole statements."""
        return self.original.rstrip().endswith((";", "}"))


@dataclass(frozen=True)
class Compact:
    """A text without blanks and comments, and where in the whole text each of its characters stands."""

    text: str
    places: list[int]

    @classmethod
    def of(cls, whole: str) -> Compact:
        """Leave out the comments, then the blanks."""
        comments: set[int] = set()
        for found in COMMENTS_AND_TEXTS.finditer(whole):
            if found[0].startswith("/"):
                comments.update(range(*found.span()))
        places = [at for at, each in enumerate(whole) if not each.isspace() and at not in comments]
        return cls("".join(whole[at] for at in places), places)

    def find_all(self, part: str, whole: str) -> list[tuple[int, int]]:
        """Find each place of the part in the whole text, from its first character to behind its last."""
        wanted = Compact.of(part).text
        spans = []
        at = self.text.find(wanted)
        while at >= 0:
            first, last = self.places[at], self.places[at + len(wanted) - 1]
            if not _is_in_word(whole, first) and not _is_in_word(whole, last + 1):
                spans.append((first, last + 1))
            at = self.text.find(wanted, at + 1)
        return spans


def _is_in_word(text: str, at: int) -> bool:
    return 0 < at < len(text) and re.fullmatch(r"\w\w", text[at - 1 : at + 1]) is not None


def read_table(path: Path) -> list[Mutant]:
    """Read the mutants of one table."""
    mutants = []
    entries: list[dict[str, Any]] = yaml.safe_load(path.read_text(encoding="utf-8"))
    for entry in entries:
        if unknown := set(entry) - KEYS:
            raise TableError(f"{path}: mutant {entry.get('number')}: unknown keys {sorted(unknown)}")
        if missing := KEYS - {"after"} - set(entry):
            raise TableError(f"{path}: mutant {entry.get('number')}: missing keys {sorted(missing)}")
        mutants.append(
            Mutant(
                number=entry["number"],
                name=entry["name"],
                file=entry["file"],
                original=str(entry["original"]).strip(),
                mutant=str(entry["mutant"] or "").strip(),
                after=str(entry.get("after", "")).strip(),
            )
        )
    return mutants


def find_original(mutant: Mutant, source: str) -> tuple[int, int]:
    """Find the one place of the original text; with `after`, the first one behind that text."""
    compact = Compact.of(source)
    begin = 0
    if mutant.after:
        befores = compact.find_all(mutant.after, source)
        if len(befores) != 1:
            raise TableError(
                f"{mutant.where}: expected once, found {len(befores)} times:\n    {mutant.after}"
            )
        begin = befores[0][1]
    spans = [span for span in compact.find_all(mutant.original, source) if span[0] >= begin]
    if not spans or (len(spans) > 1 and not mutant.after):
        raise TableError(f"{mutant.where}: expected once, found {len(spans)} times:\n    {mutant.original}")
    return spans[0]


def switched(mutant: Mutant, original: str) -> str:
    """Word the switch between both texts, in as many lines as the original has."""
    condition = f"::mauve::seeds::is_planted({mutant.number})"
    if "//" in mutant.mutant:
        raise TableError(f"{mutant.where}: the mutant has a comment, which ends its line")
    planted = " ".join(mutant.mutant.split())
    if mutant.is_statement:
        return f"{{ if ({condition}) {{ {planted} }} else {{ {original} }} }}"
    return f"({condition} ? ({planted}) : ({original}))"


def plant(source: str, mutants: list[Mutant], path: str) -> str:
    """Put the switches into one source."""
    places = sorted(((find_original(each, source), each) for each in mutants), key=lambda place: place[0])
    text, at = "", 0
    for (first, end), mutant in places:
        if first < at:
            raise TableError(f"{mutant.where}: its original text overlaps with that of another mutant")
        text += source[at:first] + switched(mutant, source[first:end])
        at = end
    return f'#include "seeds/planted.hpp"\n#line 1 "{path}"\n' + text + source[at:]


def write_if_changed(path: Path, text: str) -> None:
    """Leave a file alone that has this text already, so that nothing is compiled again for it."""
    if path.exists() and path.read_text(encoding="utf-8") == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def main() -> int:
    """Write the planted tree."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--source", type=Path, required=True, help="folder of the repository")
    parser.add_argument("--to", type=Path, required=True, help="folder of the copies")
    parser.add_argument("--table", type=Path, action="append", required=True, help="table of mutants")
    arguments = parser.parse_args()
    problems: list[str] = []
    mutants: list[Mutant] = []
    try:
        for table in arguments.table:
            mutants += read_table(table)
    except TableError as error:
        problems.append(str(error))
    numbers = [each.number for each in mutants]
    problems += [
        f"mutant {number}: the number stands twice" for number in set(numbers) if numbers.count(number) > 1
    ]
    by_file: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        by_file.setdefault(mutant.file, []).append(mutant)
    for part in PARTS:
        for path in sorted((arguments.source / part).rglob("*.[hc]pp")):
            name = str(path.relative_to(arguments.source))
            text = path.read_text(encoding="utf-8")
            try:
                write_if_changed(arguments.to / name, plant(text, by_file.pop(name, []), name))
            except TableError as error:
                problems.append(str(error))
    problems += [f"{each.where}: no such file" for left in by_file.values() for each in left]
    rows = [f'{{{each.number}, "{each.name}"}},\n' for each in sorted(mutants, key=lambda each: each.number)]
    write_if_changed(arguments.to / INDEX, "".join(rows))
    if problems:
        sys.stderr.write("The table of mutants does not fit the sources:\n" + "\n".join(problems) + "\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
