"""README's claims each have a test or a benchmark row: the table is held to README and to what there is."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from readme_claims import CLAIMS, PROMISE_NOTHING

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMAND = re.compile(r"(mauve|ros2|scripts/\w+|install/lib/\S+) ")


def _plain(text: str) -> str:
    return " ".join(text.split())


def _sentences() -> Iterator[str]:
    """Sentences, rows of tables and commands of README; no other code, no heading, no picture."""
    paragraph: list[str] = []
    is_fenced = False
    for line in [*README.splitlines(), ""]:
        if line.startswith("```"):
            is_fenced = not is_fenced
        is_code = is_fenced or line.startswith(("    ", "```"))
        if not is_code and line.strip() and not line.startswith(("#", "![", "|")):
            paragraph.append(line)
            continue
        yield from re.split(r"(?<=[.!?:])\s+(?=[A-Z`*\[(~])", _plain(" ".join(paragraph)))
        paragraph.clear()
        if line.startswith("|") or (is_code and not is_fenced and COMMAND.match(line.strip())):
            yield _plain(line)


@cache
def _tests_of(file: Path) -> frozenset[str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef))


@cache
def _kernel_cases() -> frozenset[str]:
    pattern = re.compile(r"^(?:TYPED_)?TEST(?:_[FP])?\((\w+),\s*(\w+)\)", re.MULTILINE)
    tests = ROOT / "tests"
    alone = [file for folder in ("rules", "models") for file in (tests / folder).glob("test_*.cpp")]
    sources = [*(tests / "kernel").glob("*/test_*.cpp"), *alone]
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


def _is_there(proof: str) -> bool:
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
    return proof in _kernel_cases()


@pytest.mark.parametrize("words", [*CLAIMS, *PROMISE_NOTHING])
def test_what_the_table_quotes_is_in_readme(words: str) -> None:
    assert words in _plain(README), "README does not say so any more: correct the quote, or remove the entry"


@pytest.mark.parametrize("words", CLAIMS)
def test_each_claim_has_a_proof_that_is_there(words: str) -> None:
    assert CLAIMS[words], "a claim without a proof: write the test, or take the words back"
    assert [proof for proof in CLAIMS[words] if not _is_there(proof)] == []


def test_each_sentence_of_readme_is_in_the_table() -> None:
    quotes = (*CLAIMS, *PROMISE_NOTHING)
    unknown = [text for text in _sentences() if text and not any(words in text for words in quotes)]
    assert unknown == [], "name the tests of these in readme_claims.py"


def test_a_proof_that_is_not_there_is_found_out() -> None:
    for proof in (
        "python/cli/test_none.py::test_x",
        "python/cli/test_check.py::test_none",
        "Rule1Clock.None",
        "bench: none",
    ):
        assert not _is_there(proof)
    assert not _is_there("ctest: none")
