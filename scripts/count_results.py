#!/usr/bin/env python3
"""Add up the JUnit files of a test run and print `N passed, N failed, N skipped`.

    scripts/count_results.py [--failed-stages N] FOLDER
    scripts/count_results.py --skipped FILE     print the skipped cases of a ctest run and why

Exit status 1 when a case failed or a stage did. Stages that failed when no case did (they did not build, say)
count as failed cases.
"""

from __future__ import annotations

import argparse
import re
import sys
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path


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


def main() -> int:
    """Count, print, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--failed-stages", type=int, default=0)
    parser.add_argument("--skipped", action="store_true")
    parser.add_argument("path", type=Path)
    arguments = parser.parse_args()
    if arguments.skipped:
        print_skipped(arguments.path)
        return 0
    counts: Counter[str] = Counter()
    for path in sorted(arguments.path.glob("*.xml")):
        counts.update(outcome(case) for case in ET.parse(path).getroot().iter("testcase"))
    if arguments.failed_stages and not counts["failed"]:
        counts["failed"] = arguments.failed_stages
    sys.stdout.write(f"{counts['passed']} passed, {counts['failed']} failed, {counts['skipped']} skipped\n")
    return 1 if counts["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
