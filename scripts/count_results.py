#!/usr/bin/env python3
"""Add up the JUnit files of a test run and print its failed cases and `N passed, N failed, N skipped`.

    scripts/count_results.py [--failed-stages N] FOLDER
    scripts/count_results.py --skipped FILE     print the skipped cases of a ctest run and why
    scripts/count_results.py --excused FILE     exit status 0 when all failed cases passed their second try
    scripts/count_results.py --slowest N FOLDER print the N slowest cases: seconds, stage, name

Exit status 1 when a case failed or a stage did. Stages that failed when no case did (they did not build, say)
count as failed cases. Cases that passed the second try (scripts/second_try.py) count as passed. The line
before the last one counts them.
"""

from __future__ import annotations

import argparse
import contextlib
import re
import sys
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

MOST_LINES, MOST_CHARACTERS = 40, 300  # of a failed case's output


def outcome(case: ET.Element) -> str:
    """Return "passed", "failed" or "skipped" for one `testcase` of pytest or ctest."""
    if case.find("failure") is not None or case.find("error") is not None:
        return "failed"
    skipped = case.find("skipped")
    if skipped is not None:
        # ctest reports a program it could not start as skipped too.
        return "failed" if "Unable to find executable" in (skipped.get("message") or "") else "skipped"
    return "failed" if case.get("status") == "fail" else "passed"


def gtest_skip_reason(case: ET.Element) -> str:
    """Return the text given to GTEST_SKIP(): ctest keeps it in the case's output only."""
    output = case.findtext("system-out") or ""
    match = re.search(r": Skipped\n(.*?)\n+\[  SKIPPED \]", output, re.DOTALL)
    return match.group(1).strip() if match else "no reason given"


def print_skipped(path: Path) -> None:
    """Print one line per skipped case of a ctest run, with its reason."""
    for case in ET.parse(path).getroot().iter("testcase"):
        if outcome(case) == "skipped":
            sys.stdout.write(f"SKIPPED {case.get('name')}: {gtest_skip_reason(case)}\n")


def cases_of(folder: Path) -> Iterator[tuple[str, ET.Element]]:
    """Yield each case of a test run with its stage."""
    for path in sorted(folder.glob("*.xml")):
        for case in ET.parse(path).getroot().iter("testcase"):
            yield path.stem, case


def name_of(case: ET.Element) -> str:
    """Return the name of a case with its group: ctest repeats the name as the group."""
    group, name = case.get("classname") or "", case.get("name") or ""
    return name if group in ("", name) else f"{group}::{name}"


def print_slowest(folder: Path, count: int) -> None:
    """Print one line per case, the slowest first."""
    cases = [(float(case.get("time") or 0), stage, name_of(case)) for stage, case in cases_of(folder)]
    for seconds, stage, name in sorted(cases, reverse=True)[:count]:
        sys.stdout.write(f"{seconds:7.1f} s  {stage:7} {name}\n")


def end_of_output(case: ET.Element) -> list[str]:
    """Return the last lines that a failed case printed, indented; of pytest the traceback."""
    texts = [case.findtext("failure"), case.findtext("error")]
    told = "\n".join(text for text in texts if text) or case.findtext("system-out") or ""
    return [f"    {line[:MOST_CHARACTERS]}" for line in told.splitlines()[-MOST_LINES:]]


def print_failed(folder: Path) -> None:
    """Print each failed case with the end of its output: the log of a long run may be cut before it."""
    for stage, case in cases_of(folder):
        if outcome(case) == "failed":
            sys.stdout.write("\n".join([f"FAILED {stage}: {name_of(case)}", *end_of_output(case)]) + "\n")


def is_unstable(case: ET.Element) -> bool:
    """Whether the case failed at first and passed its second try."""
    return case.get("unstable") is not None


def is_excused(path: Path) -> bool:
    """Whether the failed cases of a stage all passed their second try; False without a failed case."""
    cases = list(ET.parse(path).getroot().iter("testcase")) if path.is_file() else []
    return any(is_unstable(case) for case in cases) and all(outcome(case) != "failed" for case in cases)


def main() -> int:
    """Count, print, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--failed-stages", type=int, default=0)
    parser.add_argument("--skipped", action="store_true")
    parser.add_argument("--excused", action="store_true")
    parser.add_argument("--slowest", type=int)
    parser.add_argument("path", type=Path)
    arguments = parser.parse_args()
    if arguments.skipped:
        print_skipped(arguments.path)
        return 0
    if arguments.excused:
        return 0 if is_excused(arguments.path) else 1
    if arguments.slowest is not None:
        with contextlib.suppress(BrokenPipeError):  # `| head`
            print_slowest(arguments.path, arguments.slowest)
        return 0
    print_failed(arguments.path)
    counts = Counter(outcome(case) for _, case in cases_of(arguments.path))
    if arguments.failed_stages and not counts["failed"]:
        counts["failed"] = arguments.failed_stages
    unstable = sum(is_unstable(case) for _, case in cases_of(arguments.path))
    if unstable:
        sys.stdout.write(f"{unstable} unstable: failed at first, passed alone (test-results/unstable.txt)\n")
    sys.stdout.write(f"{counts['passed']} passed, {counts['failed']} failed, {counts['skipped']} skipped\n")
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
