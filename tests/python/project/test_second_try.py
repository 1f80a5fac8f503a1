"""scripts/test: a failed case runs again alone, three times. The tests plant cases in a clone of scripts/."""

import importlib
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path
from types import ModuleType

import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"

CASES = """
from pathlib import Path

import pytest

HERE = Path(__file__).parent


def runs_so_far(name):
    log = HERE / name
    log.write_text(log.read_text() + "x" if log.exists() else "x")
    return len(log.read_text())

"""


class Clone:
    """A clone whose set-up is done."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.results = root / "build" / "test-results"
        shutil.copytree(SCRIPTS, root / "scripts", ignore=shutil.ignore_patterns("__pycache__"))
        (root / "scripts" / "setup").write_text("#!/bin/sh\n")
        (root / "install").mkdir()
        (root / "install" / "setup.bash").touch()
        (root / "pyproject.toml").write_text(
            "[tool.pytest.ini_options]\naddopts = '--import-mode=importlib'\n"
        )
        self.plant("python", "def test_good(): pass")

    def plant(self, stage: str, *cases: str) -> None:
        folder = self.root / "tests" / stage
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "test_planted.py").write_text(CASES + "\n\n".join(cases) + "\n")

    def plant_program(self, *scripts: str) -> None:
        """Programs of ctest: planted_0, planted_1 ..."""
        folder = self.root / "build" / "tests" / "kernel"
        folder.mkdir(parents=True)
        lines = [f'add_test(planted_{i} /bin/sh -c "{script}")' for i, script in enumerate(scripts)]
        (folder / "CTestTestfile.cmake").write_text("\n".join(lines) + "\n")
        (self.root / "build" / "CTestTestfile.cmake").write_text("subdirs(tests/kernel)\n")

    def test(self, *arguments: str) -> tuple[int, str]:
        """The exit status and the output of scripts/test."""
        done = subprocess.run(
            [self.root / "scripts" / "test", *arguments],
            env=os.environ | {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},  # which take most of the time
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        return done.returncode, done.stdout

    def runs(self, stage: str, name: str) -> int:
        return len((self.root / "tests" / stage / name).read_text())


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    return Clone(tmp_path / "clone")


def fails_in(name: str, *runs: int, by: str = "it was late") -> str:
    """A case that fails in these runs, the first one is 1."""
    return f"def test_{name}(): assert runs_so_far('{name}') not in {runs}, '{by}'"


def second_try() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(SCRIPTS))
        return importlib.import_module("second_try")


def last_line(output: str) -> str:
    return output.splitlines()[-1]


def test_a_case_that_fails_once_is_unstable(clone: Clone):
    crash_in_source = "def test_source():\n    text = 'SIGSEGV'\n    assert runs_so_far('source') > 1"
    clone.plant("python", "def test_good(): pass", fails_in("once", 1), crash_in_source)
    status, output = clone.test("python")
    assert (status, last_line(output)) == (0, "3 passed, 0 failed, 0 skipped"), output
    assert clone.runs("python", "once") == 4
    assert "\n2 unstable: failed at first, passed alone (test-results/unstable.txt)\n" in output
    name = r"UNSTABLE python: tests\.python\.test_planted::test_once, load average \d+\.\d to \d+\.\d"
    found = re.search(f"^{name}$", output, re.MULTILINE)
    assert found is not None, output
    assert "failed stage" not in output
    kept = (clone.results / "unstable.txt").read_text()
    assert found[0] in kept
    assert "it was late" in kept
    clone.plant("python", fails_in("strict", 1))
    status, output = clone.test("--strict", "python")
    assert (status, last_line(output)) == (1, "0 passed, 1 failed, 0 skipped"), output
    assert clone.runs("python", "strict") == 1
    assert (clone.results / "unstable.txt").read_text() == kept  # from run to run


def test_a_case_that_fails_again_fails_the_run(clone: Clone):
    cases = {"second": (1, 2), "third": (1, 3), "fourth": (1, 4), "always": range(1, 9)}
    clone.plant("python", *(fails_in(name, *runs) for name, runs in cases.items()))
    status, output = clone.test("python")
    assert (status, last_line(output)) == (1, "0 passed, 4 failed, 0 skipped"), output
    assert [clone.runs("python", name) for name in cases] == [2, 3, 4, 2]
    assert "failed stage: python" in output
    assert "UNSTABLE" not in output


def test_more_than_five_cases_are_not_excused(clone: Clone):
    clone.plant("python", *(fails_in(f"once_{number}", 1) for number in range(6)))
    status, output = clone.test("python")
    assert (status, last_line(output)) == (1, "0 passed, 6 failed, 0 skipped"), output
    assert "6 cases failed: more than 5 do not run again." in output


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("E   WARNING: ThreadSanitizer: data race", "a report of a sanitizer"),
        ("E   AssertionError: a.cpp:3:1: runtime error: overflow", "a report of a sanitizer"),
        ("E   CalledProcessError: died with <Signals.SIGSEGV: 11>", "a crash"),
        ("E   assert -6 == 0", "a crash"),
        ("E   Failed: Timeout (>600.0s) from pytest-timeout.", "a process that had to be killed"),
        ("E   AssertionError: these had to be killed", "a process that had to be killed"),
        ("E   mcap.exceptions.EndOfFile", "a torn bag"),
        ("tests/bag_rules.py:41: AssertionError", "a torn bag"),
        ("    assert end == signal.SIGSEGV\nE   assert 3 == 11", ""),
        ("E   AssertionError: gave up waiting for: a reply", ""),
    ],
)
def test_grave_failures_are_known_by_their_output(text: str, reason: str):
    case = ET.Element("testcase", name="x")
    ET.SubElement(case, "failure").text = text
    assert second_try().grave_reason(case, "") == reason


def test_a_grave_failure_stays_one(clone: Clone):
    clone.plant("python", fails_in("bad", 1, by="WARNING: ThreadSanitizer: data race"))
    status, output = clone.test("python")
    assert (status, last_line(output)) == (1, "0 passed, 1 failed, 0 skipped"), output
    assert "It passes now, and stays failed: a report of a sanitizer." in output


def test_a_program_that_crashed_once_fails_the_run(clone: Clone):
    crash = "test -e {0} || { touch {0}; kill -{1} \\$\\$; }"
    signals = ("SEGV", "ABRT", "KILL")
    clone.plant_program(*(crash.replace("{0}", f"{clone.root}/{s}").replace("{1}", s) for s in signals))
    status, output = clone.test("kernel")
    assert (status, last_line(output)) == (1, "0 passed, 3 failed, 0 skipped"), output
    assert output.count("It passes now, and stays failed: the program ended by S") == 3


def test_each_stage_has_its_second_try_after_everything_else(clone: Clone):
    """A parameter and a class are found again; `doors`, which builds, runs once more."""
    clone.plant_program(f"test -e {clone.root}/once || {{ touch {clone.root}/once; exit 1; }}")
    is_over = "(HERE.parent / 'ros' / 'over').exists()"
    clone.plant("python", f"def test_once(): assert runs_so_far('once') > 1 and {is_over}")
    clone.plant("ros", "def test_slow():\n    __import__('time').sleep(5)\n    (HERE / 'over').touch()")
    parameter = "@pytest.mark.parametrize('a', ['b.c-d/1'])\n    def test_x(self, a):"
    clone.plant("system", "class TestIt:\n    " + fails_in("x", 1).replace("def test_x():", parameter))
    clone.plant("doors", fails_in("once", 1))
    status, output = clone.test("kernel", "python", "ros", "system", "doors")
    assert (status, last_line(output)) == (0, "5 passed, 0 failed, 0 skipped"), output
    assert re.findall(r"^UNSTABLE (\w+): ", output, re.MULTILINE) == ["doors", "kernel", "python", "system"]
    assert clone.runs("doors", "once") == 2


def test_a_stage_that_breaks_fails_the_run(clone: Clone):
    """As by exit(): the cases that it did not run are not excused."""
    clone.plant("python", fails_in("once", 1), "def test_end(): pytest.exit('enough', returncode=3)")
    status, output = clone.test("python")
    assert status == 1, output
    assert "failed stage: python" in output
