#!/usr/bin/env python3
"""Run each failed case of a test run again, alone.

    scripts/second_try.py FOLDER

Call it after all else has ended. FOLDER has the JUnit file of each stage, STAGE.xml, and the command that ran
the stage, STAGE.command: words that end with NUL. A case runs again three times, a case of the stage doors
once. If it passes each time, the case is unstable: the program prints it, appends it to FOLDER/unstable.txt,
and counts it as passed in the JUnit file, with the attribute `unstable`.

These stay failed, also where they pass now: reports of sanitizers, crashes, processes that had to be killed,
and torn bags. With more than five failed cases nothing runs again. Exit status 1 when a case stays failed.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from count_results import end_of_output, name_of, outcome

MOST_UNSTABLE = 5
TRIES, TRIES_OF_BUILDS = 3, 1
BUILDS = "doors"
MARGIN_S = 10.0  # around a case: scripts/test writes the load every 5 s

# In the output of a program, and in the lines of pytest that tell an error: its other lines are source code.
GRAVE_OUTPUT = {
    "a report of a sanitizer": r"(Thread|Address|Leak|Realtime|UndefinedBehavior)Sanitizer|: runtime error: ",
    "a crash": r"SIG(SEGV|ABRT|BUS|ILL|FPE)|Segmentation fault|Fatal Python error|terminate called"
    r"|assert -(4|6|7|8|11) ==",
    "a process that had to be killed": r"had to be killed|from pytest-timeout|TimeoutExpired",
    "a torn bag": r"mcap\.exceptions\.|rosbags\.\S+ReaderError",
}
TORN_BAG = r"bag_rules\.py:\d+: "  # where pytest names the assertion that failed
# ctest's list of failed programs: how each ended. Others are SEGFAULT, Subprocess aborted, Timeout ...
END_OF_PROGRAM = r"^\s+\d+ - (\S+) \(([^)]*)\)"
ORDINARY_END = "Failed"


@dataclass(frozen=True)
class FailedCase:
    """A failed case of a stage."""

    stage: str
    element: ET.Element
    begin_s: float  # since the epoch
    end_s: float

    @property
    def name(self) -> str:
        """As the list of failed cases has it."""
        return f"{self.stage}: {name_of(self.element)}"


def failed_cases(stage: str, root: ET.Element) -> list[FailedCase]:
    """Return the failed cases of a stage. The cases of a suite ran one after the other."""
    found = []
    for suite in root.iter("testsuite"):
        clock_s = datetime.fromisoformat(suite.get("timestamp") or "1970-01-01").timestamp()
        for element in suite.iter("testcase"):
            begin_s = clock_s
            clock_s += float(element.get("time") or 0)
            if outcome(element) == "failed":
                found.append(FailedCase(stage, element, begin_s, clock_s))
    return found


def grave_reason(case: ET.Element, log_of_ctest: str) -> str:
    """Return why a case stays failed; empty: a second try may excuse it."""
    ends = dict(re.findall(END_OF_PROGRAM, log_of_ctest, re.MULTILINE))
    end = ends.get(case.get("name"), ORDINARY_END)
    if end != ORDINARY_END:
        return f"the program ended by {end}"
    told = [element.text or "" for element in case if element.tag in {"failure", "error"}]
    errors = [line for text in told for line in text.splitlines() if line.startswith("E ")]
    output = [case.findtext("system-out") or "", case.findtext("system-err") or ""]
    everything = "\n".join([*errors, *output])
    for reason, pattern in GRAVE_OUTPUT.items():
        if re.search(pattern, everything):
            return reason
    return "a torn bag" if any(re.search(TORN_BAG, text) for text in told) else ""


def selection(command: list[str], case: ET.Element) -> list[str]:
    """Return the words that reduce a stage's command to one case."""
    if "ctest" in command:
        escaped = re.sub(r"([][.+*?()^$|\\])", r"\\\1", case.get("name") or "")
        return ["-R", f"^{escaped}$", "--no-tests=error"]
    words = (case.get("classname") or "").split(".")
    # `tests.python.test_x.TestClass` stands for tests/python/test_x.py::TestClass.
    for length in range(len(words), 0, -1):
        file = Path(*words[:length]).with_suffix(".py")
        if file.is_file():
            return ["::".join([str(file), *words[length:], case.get("name") or ""])]
    return [case.get("name") or ""]  # a file that could not be collected


def passes_alone(case: FailedCase, folder: Path) -> bool:
    """Run the case again, alone, up to its first failure. The output goes to FOLDER/again."""
    words = [word for word in (folder / f"{case.stage}.command").read_text().split("\0") if word]
    command = [*words, *selection(words, case.element)]
    logs = folder / "again"
    logs.mkdir(exist_ok=True)
    for number in range(TRIES_OF_BUILDS if case.stage == BUILDS else TRIES):
        log = logs / f"{re.sub(r'[^A-Za-z0-9_.-]+', '_', case.name)[:150]}.{number + 1}.log"
        with log.open("wb") as output:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, check=False
            )
        if done.returncode != 0:
            return False
    return True


def load_around(case: FailedCase, folder: Path) -> str:
    """Return the load of the computer while the case ran the first time, in words."""
    loads = []
    log = folder / "load.txt"
    for line in log.read_text().splitlines() if log.is_file() else []:
        when, load = map(float, line.split())
        if case.begin_s - MARGIN_S <= when <= case.end_s + MARGIN_S:
            loads.append(load)
    return f"load average {min(loads):.1f} to {max(loads):.1f}" if loads else "load average unknown"


def excuse(case: FailedCase, folder: Path) -> None:
    """Count the case as passed, and tell that it is unstable."""
    lines = [f"UNSTABLE {case.name}, {load_around(case, folder)}", *end_of_output(case.element)]
    text = "\n".join(lines) + "\n"
    sys.stdout.write(text)
    with (folder / "unstable.txt").open("a", encoding="utf-8") as log:
        log.write(f"{datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC {text}")
    for told in [element for element in case.element if element.tag in {"failure", "error"}]:
        case.element.remove(told)
    if case.element.get("status") == "fail":
        case.element.set("status", "run")
    case.element.set("unstable", "true")


def main() -> int:
    """Try again, and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    folder: Path = parser.parse_args().folder
    trees = {path.stem: ET.parse(path) for path in sorted(folder.glob("*.xml"))}
    failed = [case for stage, tree in trees.items() for case in failed_cases(stage, tree.getroot())]
    if not failed:
        return 0
    if len(failed) > MOST_UNSTABLE:
        sys.stdout.write(f"{len(failed)} cases failed: more than {MOST_UNSTABLE} do not run again.\n")
        return 1
    status = 0
    for case in failed:
        sys.stdout.write(f"again, alone: {case.name}\n")
        sys.stdout.flush()
        passed = (folder / f"{case.stage}.command").is_file() and passes_alone(case, folder)
        log = folder / f"{case.stage}.log"
        reason = grave_reason(case.element, log.read_text(errors="replace") if log.is_file() else "")
        if passed and not reason:
            excuse(case, folder)
            trees[case.stage].write(folder / f"{case.stage}.xml", encoding="utf-8", xml_declaration=True)
            continue
        status = 1
        if passed:
            sys.stdout.write(f"    It passes now, and stays failed: {reason}.\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
