"""README's claims each have a test or a benchmark row: the table is held to README and to what there is."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from page_blocks import blocks
from proofs import is_there
from readme_claims import CLAIMS, PROMISE_NOTHING

ROOT = Path(__file__).parents[3]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMAND = re.compile(r"(mauve|ros2|scripts/\w+|install/lib/\S+) ")


def _plain(text: str) -> str:
    return " ".join(text.split())


def _sentences() -> Iterator[str]:
    """Sentences, rows of tables and commands of README; no other code, no heading, no picture."""
    commands = {line for block in blocks(README) if not block.is_fenced for line in block.lines}
    code = {line for block in blocks(README) for line in block.lines}
    paragraph: list[str] = []
    for number, line in enumerate([*README.splitlines(), ""]):
        if number not in code and line.strip() and not line.startswith(("#", "![", "|", "<!--")):
            paragraph.append(line)
            continue
        yield from re.split(r"(?<=[.!?:])\s+(?=[A-Z`*\[(~])", _plain(" ".join(paragraph)))
        paragraph.clear()
        if line.startswith("|") or (number in commands and COMMAND.match(line.strip())):
            yield _plain(line)


@pytest.mark.parametrize("words", [*CLAIMS, *PROMISE_NOTHING])
def test_what_the_table_quotes_is_in_readme(words: str) -> None:
    assert words in _plain(README), "README does not say so any more: correct the quote, or remove the entry"


@pytest.mark.parametrize("words", CLAIMS)
def test_each_claim_has_a_proof_thatis_there(words: str) -> None:
    assert CLAIMS[words], "a claim without a proof: write the test, or take the words back"
    assert [proof for proof in CLAIMS[words] if not is_there(proof)] == []


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
        assert not is_there(proof)
    assert not is_there("ctest: none")
