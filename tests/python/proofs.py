"""What proves a claim or runs a block: whether there is such a test, program or row of a benchmark.

Tests are `stage/room/test_file.py::test_name` below tests/ or mauve_examples/tests/, or `Suite.Name` in
C++; programs that ctest runs are `ctest: NAME`, rows of scripts/bench `bench: WORDS`.
"""

import ast
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]


@cache
def _tests_of(file: Path) -> frozenset[str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef))


@cache
def _cpp_cases() -> frozenset[str]:
    pattern = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\((\w+),\s*(\w+)\)", re.MULTILINE)
    tests = ROOT / "tests"
    alone = [file for folder in ("rules", "models") for file in (tests / folder).glob("test_*.cpp")]
    mission = (ROOT / "mauve_examples" / "tests").glob("test_*.cpp")
    sources = [*(tests / "kernel").glob("*/test_*.cpp"), *alone, *mission]
    return frozenset(
        ".".join(found) for file in sources for found in pattern.findall(file.read_text("utf-8"))
    )


@cache
def _bench_words() -> frozenset[str]:
    """Every text in benchmarks/, of an f-string the pieces between its values."""
    files = (ROOT / "benchmarks").glob("*.py")
    nodes = (node for file in files for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))))
    return frozenset(
        node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


@cache
def _programs_of_ctest() -> str:
    return "".join(file.read_text("utf-8") for file in (ROOT / "mauve_examples").glob("*/CMakeLists.txt"))


def is_there(proof: str) -> bool:
    """Whether the sources have it."""
    if proof.startswith("bench: "):
        return proof.removeprefix("bench: ") in _bench_words()
    if proof.startswith("ctest: "):
        name = proof.removeprefix("ctest: ")
        text = _programs_of_ctest()
        return f"add_test(NAME {name} " in text or ("add_test(NAME ${name} " in text and name in text)
    file, is_python, name = proof.partition("::")
    if is_python:
        paths = (ROOT / "tests" / file, ROOT / "mauve_examples" / "tests" / file)
        return any(path.is_file() and name in _tests_of(path) for path in paths)
    return proof in _cpp_cases()
