"""Unexpected exceptions of a program: one line with a remedy, the traceback for developers only."""

import argparse
import errno
import os
import subprocess
import sys

import pytest

from mauve_rt.cli.verb import BAD_USAGE, Verb, run
from mauve_rt.errors import ParameterError
from mauve_rt.node.shared.failures import TRACEBACK, failure_text

RAISES = """
from mauve_rt.node.shared.first_steps import take_first_steps
take_first_steps("program")
raise ValueError("two\\nlines")
"""
WORK_RAISES = """
from mauve_rt.node.shared.process import leave_now, run_until_signalled
def work(stop):
    stop.begin()
    raise ValueError("two\\nlines")
leave_now(run_until_signalled(work, program="program"))
"""
LINE = "program: unexpected error: ValueError: two lines (<string>:"


def system_error(number: int, file: str | None = "/some/file") -> OSError:
    return OSError(number, os.strerror(number), file)


@pytest.mark.parametrize(
    ("error", "parts"),
    [
        (ParameterError("a clear line"), ["a clear line"]),
        (MemoryError(), ["not enough memory", "ulimit -v"]),
        (system_error(errno.EMFILE), ["/some/file: Too many open files", "ulimit -n 1024"]),
        (system_error(errno.ENOSPC), ["/some/file: No space left", "Free space there"]),
        (system_error(errno.ENOSPC, None), ["No space left", "Free space there"]),
        (system_error(errno.EROFS), ["/some/file: Read-only", "choose another path"]),
        (system_error(errno.EIO), ["unexpected error: /some/file: Input", f"{TRACEBACK}=1"]),
        (
            KeyError("x"),
            ["unexpected error: KeyError: 'x'", f"Please report this with the output with {TRACEBACK}=1."],
        ),
    ],
)
def test_a_line_says_what_was_wrong_and_what_to_do(error: BaseException, parts: list[str]):
    text = failure_text(error)
    assert "\n" not in text
    assert [part for part in parts if part not in text] == [], text


@pytest.mark.parametrize("program", [RAISES, WORK_RAISES], ids=["main", "work"])
@pytest.mark.parametrize("traceback", ["", "1"])
def test_a_user_sees_one_line_and_a_developer_the_traceback(program: str, traceback: str):
    given = os.environ | {TRACEBACK: traceback}
    done = subprocess.run(
        [sys.executable, "-c", program], env=given, capture_output=True, text=True, check=False
    )
    line, *rest = done.stderr.splitlines()
    assert (done.returncode, line[: len(LINE)]) == (1, LINE)
    assert bool(rest) == bool(traceback)
    assert ("Traceback" in done.stderr) == bool(traceback)


def test_a_verb_that_fails_says_so_in_a_line(capsys: pytest.CaptureFixture[str]):
    def main(_: argparse.Namespace) -> int:
        raise RuntimeError("nobody expected it")

    verb = Verb(name="v", help="", add_arguments=lambda _: None, main=main)
    assert run(verb, argparse.Namespace()) == BAD_USAGE
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("mauve: unexpected error: RuntimeError: nobody expected it (test_failures.py:")
    assert said.err.count("\n") == 1
