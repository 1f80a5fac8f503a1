"""Each claim has a test or a benchmark row: the table is held to the pages, and these to the table."""

import re
from collections.abc import Iterator

import pytest
from page_blocks import blocks
from pages import ALL, PAGES
from proofs import is_there
from readme_claims import CLAIMS, PAGES_OF_CLAIMS, PROMISE_NOTHING

COMMAND = re.compile(r"(mauve|ros2|scripts/\w+|install/lib/\S+) ")


def _plain(text: str) -> str:
    return " ".join(text.split())


def _sentences(page: str) -> Iterator[str]:
    """Sentences, rows of tables and commands of a page; no other code, no heading, no picture."""
    commands = {line for block in blocks(page) if not block.is_fenced for line in block.lines}
    code = {line for block in blocks(page) for line in block.lines}
    paragraph: list[str] = []
    for number, text in enumerate([*page.splitlines(), ""]):
        line = re.sub(r"^\d+\. +", "", text)
        if number not in code and line.strip() and not line.startswith(("#", "![", "|", "<!--")):
            paragraph.append(line)
            continue
        yield from re.split(r"(?<=[.!?:])\s+(?=[A-Z`*\[(~])", _plain(" ".join(paragraph)))
        paragraph.clear()
        if line.startswith("|") or (number in commands and COMMAND.match(line.strip())):
            yield _plain(line)


EVERYTHING = _plain(ALL)


@pytest.mark.parametrize("words", [*CLAIMS, *PROMISE_NOTHING])
def test_what_the_table_quotes_is_in_a_page(words: str) -> None:
    assert words in EVERYTHING, "no page says so any more: correct the quote, or remove the entry"


@pytest.mark.parametrize("words", CLAIMS)
def test_each_claim_has_a_proof_that_is_there(words: str) -> None:
    assert CLAIMS[words], "a claim without a proof: write the test, or take the words back"
    assert [proof for proof in CLAIMS[words] if not is_there(proof)] == []


@pytest.mark.parametrize("page", PAGES_OF_CLAIMS)
def test_each_sentence_is_in_the_table(page: str) -> None:
    quotes = (*CLAIMS, *PROMISE_NOTHING)
    unknown = [
        text for text in _sentences(PAGES[page]) if text and not any(words in text for words in quotes)
    ]
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
