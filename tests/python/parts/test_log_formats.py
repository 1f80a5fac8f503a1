"""A format of a log line is checked where it is compiled: what does not fit does not compile."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

INCLUDE = Path(__file__).parents[3] / "mauve_rt" / "kernel" / "include"
SOURCE = """\
#include "mauve_rt/base/log.hpp"
struct Pose { double x; };
void write(const mauve::Log& log, double error, int count, const char* name) {
  static_cast<void>(error); static_cast<void>(count); static_cast<void>(name);
  log.info(CALL);
}
"""


def compiled(call: str) -> tuple[bool, str]:
    compiler = shutil.which(os.environ.get("CXX", "c++"))
    assert compiler is not None
    ran = subprocess.run(
        [compiler, "-std=c++20", "-fsyntax-only", f"-I{INCLUDE}", "-x", "c++", "-"],
        input=SOURCE.replace("CALL", call),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    return ran.returncode == 0, ran.stderr


def test_a_format_that_fits_compiles():
    fits = '"{} m of {:.3f} m, {:x} of {}, {{all}}", error, 0.5, count, name'
    is_compiled, errors = compiled(fits)
    assert is_compiled, errors


@pytest.mark.parametrize(
    ("call", "why"),
    [
        ('"{} m"', "a_log_format_has_as_many_places_as_arguments"),
        ('"m", error', "a_log_format_has_as_many_places_as_arguments"),
        ('"{} { m", error', "a_brace_in_a_log_format_is_doubled_or_a_place"),
        ('"} m"', "a_brace_in_a_log_format_is_doubled_or_a_place"),
        ('"{:x}", error', "a_place_in_a_log_format_is_empty_or_has_a_precision_or_x"),
        ('"{:.2f}", count', "a_place_in_a_log_format_is_empty_or_has_a_precision_or_x"),
        ('"{:>9}", error', "a_place_in_a_log_format_is_empty_or_has_a_precision_or_x"),
        ('"{}", Pose{1.0}', "an argument of a log line is a number, a bool, an enum or a text"),
        ('"{}{}{}{}{}{}{}{}{}", 1, 2, 3, 4, 5, 6, 7, 8, 9', "a log line has at most 8 arguments"),
        ("name", "LogFormat"),
    ],
)
def test_a_wrong_format_does_not_compile(call: str, why: str):
    is_compiled, errors = compiled(call)
    assert not is_compiled
    assert why in errors
