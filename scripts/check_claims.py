#!/usr/bin/env python3
"""Check that each test named by a claim of the pages passed or failed in a whole test run.

    scripts/check_claims.py FOLDER    FOLDER has the JUnit files of every stage of scripts/test

Prints `claim without a test that ran: PAGE:LINE NAME` for each test that was skipped with all its parameters
or did not run. Exit status 1 when there is one. A claim is a mark behind a sentence in README.md or docs/:
`<!-- claim: NAME, NAME -->`. CONTRIBUTING.md says which names there are.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

from count_results import cases_of, outcome

ROOT = Path(__file__).resolve().parents[1]
MARK = re.compile(r"<!-- (claim|measured|no claim)(?:: *([^>]*?))? *-->")
# program.Suite.Name, program.Suite.Name<type>, program.Prefix/Suite.Name/parameter: all readings are found.
GTEST = re.compile(r"(?=(?:^|[./])(\w+)\.(\w+)(?:[/<].*)?$)")


def pages(root: Path) -> dict[str, str]:
    """Return README.md and the pages of docs/, by their paths below the project."""
    files = (root / "README.md", *sorted((root / "docs").rglob("*.md")))
    return {file.relative_to(root).as_posix(): file.read_text(encoding="utf-8") for file in files}


def proofs_of(mark: re.Match[str]) -> list[str]:
    """Return the names in a mark; a mark of another kind than `claim` has none."""
    return [name.strip() for name in (mark[2] or "").split(",")] if mark[1] == "claim" else []


def is_test(proof: str) -> bool:
    """Return whether a proof is a test: not a constant of the sources, not a row of a benchmark."""
    name = proof.rpartition("::")[2]
    return not proof.startswith("bench: ") and ("::" not in proof or name.startswith("test_"))


def named_tests(text: str) -> Iterator[tuple[int, str]]:
    """Yield each test that a page names, with its line."""
    for mark in MARK.finditer(text):
        line = text.count("\n", 0, mark.start()) + 1
        yield from ((line, proof) for proof in proofs_of(mark) if is_test(proof))


def names_of(group: str, case: str) -> Iterator[str]:
    """Yield every name by which a mark may name a case of pytest or ctest."""
    if case == group:  # ctest repeats the name as the group
        yield f"ctest: {case}"
        yield from (".".join(found.groups()) for found in GTEST.finditer(case))
        return
    test, folders = case.partition("[")[0], group.split(".")
    yield test
    for begin in range(len(folders)):
        yield f"{'/'.join(folders[begin:])}.py::{test}"


def main() -> int:
    """Print the claims whose tests did not run, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--root", type=Path, default=ROOT, help="folder of README.md and docs/")
    parser.add_argument("folder", type=Path, help="folder of the JUnit files, such as build/test-results")
    arguments = parser.parse_args()
    ran = {
        name
        for _, case in cases_of(arguments.folder)
        if outcome(case) != "skipped"
        for name in names_of(case.get("classname") or "", case.get("name") or "")
    }
    missing = [
        f"{page}:{line} {test}"
        for page, text in pages(arguments.root).items()
        for line, test in named_tests(text)
        if test not in ran
    ]
    sys.stdout.write("".join(f"claim without a test that ran: {each}\n" for each in missing))
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
