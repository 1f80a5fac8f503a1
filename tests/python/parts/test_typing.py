"""The types of the public API: used strictly, true to the compiled module, and there for who installs it."""

import re
import subprocess
import sys
from pathlib import Path

import mauve_rt
from mauve_rt import _kernel, api

ROOT = Path(__file__).parents[3]


def mypy(module: str, *arguments: str) -> str:
    """What a tool of mypy finds; empty when nothing."""
    command = [sys.executable, "-m", module, *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    return "" if done.returncode == 0 else done.stdout + done.stderr


def test_a_program_that_uses_all_of_it_is_typed(tmp_path: Path):
    file = Path(__file__).with_name("typed_api.py")
    arguments = ("--strict", "--config-file", "pyproject.toml", "--cache-dir", str(tmp_path))
    assert mypy("mypy", *arguments, "--enable-error-code", "unused-ignore", str(file)) == ""


def test_the_typed_program_names_all_of_the_api():
    text = Path(__file__).with_name("typed_api.py").read_text()
    only_inside_others = {"ExecutionTimeDescription", "NativeShell", "PortDescription", "PropertyDescription"}
    only_inside_others |= {"ResourceDescription", "ServiceDescription"}
    assert {name for name in api.__all__ if f"    {name}," not in text} == only_inside_others


# What pybind11's classes are like, whatever they bind: a metaclass of its own, and constructors that take
# anything to refuse it.
OF_PYBIND11 = re.compile(
    r".*( is inconsistent, metaclass differs"
    r"|__init__ is inconsistent, stub does not have \*args parameter \"args\")"
)


def test_the_stubs_are_true_to_the_compiled_modules():
    modules = ("mauve_rt._kernel", "mauve_rt._bridge", "mauve_examples._mission")
    found = mypy("mypy.stubtest", *modules, "--mypy-config-file", "pyproject.toml", "--concise")
    assert "metaclass differs" in found, "it did look"
    assert [line for line in found.splitlines() if not OF_PYBIND11.fullmatch(line)] == []


def test_it_tells_type_checkers_that_it_is_typed():
    for module in (mauve_rt, _kernel):
        assert (Path(str(module.__file__)).parent / "py.typed").is_file()


def test_everything_that_is_offered_is_there():
    assert [name for name in api.__all__ if not hasattr(api, name)] == []
