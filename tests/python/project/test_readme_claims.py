"""Each claim has a test or a benchmark row: the table is held to the pages, and these to the table."""

import re
from collections.abc import Iterable, Iterator

import pytest
from page_blocks import blocks
from pages import ALL, PAGES
from proofs import is_there
from readme_claims import CLAIMS, PAGES_OF_CLAIMS, PROMISE_NOTHING

COMMAND = re.compile(r"(mauve|ros2|scripts/\w+|install/lib/\S+) ")


GENERATED = re.compile(
    r"<!-- figures: .*?<!-- end of the figures[^>]*-->", re.DOTALL
)  # test_bench_docs.py holds it


def _plain(text: str) -> str:
    return " ".join(text.split())


def _sentences(page: str) -> Iterator[str]:
    """Sentences, rows of tables and commands of a page; no other code, no heading, nothing generated."""
    page = GENERATED.sub("", page)
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


LINK = re.compile(r"!?\[[^\]]*\]\([^)]*\)")  # test_docs.py looks behind each


def _loose_words(sentence: str, quotes: Iterable[str]) -> list[str]:
    """Words of a sentence that no quote has: one could be changed, or added, and no test would fail."""
    quoted = {
        place
        for words in (*quotes, *LINK.findall(sentence))
        if words in sentence
        for found in re.finditer(re.escape(words), sentence)
        for place in range(*found.span())
    }
    return [found[0] for found in re.finditer(r"\w+", sentence) if not quoted >= set(range(*found.span()))]


@pytest.mark.parametrize("page", PAGES_OF_CLAIMS)
def test_each_word_is_quoted_in_the_table(page: str) -> None:
    quotes = (*CLAIMS, *PROMISE_NOTHING)
    loose = {text: words for text in _sentences(PAGES[page]) if (words := _loose_words(text, quotes))}
    assert loose == {}, "quote the clause in readme_claims.py, with its tests"


def test_a_changed_word_is_found() -> None:
    quotes = ["It has a blackout of 14 us", "and misses no"]
    assert _loose_words("It has a blackout of 14 us, and misses no [release](a.md).", quotes) == []
    assert _loose_words("It never has a blackout of 14 us, and misses no deadline of 100.", quotes) == [
        *("It", "never", "has", "a", "blackout", "of", "14", "us"),
        *("deadline", "of", "100"),
    ]


def test_each_claim_has_a_proof_that_each_run_of_the_tests_looks_at() -> None:
    """A row of a benchmark is run by hand, unless it counts what must be zero."""
    assert [words for words, proofs in CLAIMS.items() if all(p.startswith("bench: ") for p in proofs)] == []


def test_a_proof_that_is_not_there_is_found_out() -> None:
    for proof in (
        "python/cli/test_none.py::test_x",
        "python/cli/test_check.py::test_none",
        "Rule1Clock.None",
        "bench: none",
    ):
        assert not is_there(proof)
    assert not is_there("ctest: none")
