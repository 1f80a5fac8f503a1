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
    r"<!-- figures: .*?<!-- end of the figures -->", re.DOTALL
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


NUMBER = re.compile(r"(?<![\w.])\d[\d,.]*\d|(?<![\w.])\d(?!\w)")
NO_FIGURE = re.compile(r"\]\([^)]*\)|`[^`]*`|ROS 2")  # links and code, which is run; a name


def _loose_numbers(sentence: str, quotes: Iterable[str]) -> list[str]:
    """Numbers of a sentence that no quote has: one could be changed, and nobody would see it."""
    text = NO_FIGURE.sub(lambda found: " " * len(found[0]), sentence)
    quoted = {
        place
        for words in quotes
        for found in re.finditer(re.escape(words), sentence)
        for place in range(*found.span())
    }
    return [found[0] for found in NUMBER.finditer(text) if not quoted >= set(range(*found.span()))]


# Its table of figures is typed: `scripts/bench --write-docs` is there to write it.
TYPED = "docs/concepts/performance.md"


@pytest.mark.parametrize("page", [page for page in PAGES_OF_CLAIMS if page != TYPED])
def test_each_number_is_quoted_in_the_table(page: str) -> None:
    quotes = (*CLAIMS, *PROMISE_NOTHING)
    loose = {
        text: numbers
        for text in _sentences(PAGES[page])
        if not COMMAND.match(text) and (numbers := _loose_numbers(text, quotes))
    }
    assert loose == {}, "quote the clause with the number in readme_claims.py"


def test_a_changed_number_is_found() -> None:
    quotes = ["a blackout of 14 us", "and misses no"]
    assert (
        _loose_numbers("It has a blackout of 14 us (`-p x:=3`, ROS 2), and misses no release.", quotes) == []
    )
    assert _loose_numbers("It has a blackout of 15 us, and misses no release of 100.", quotes) == [
        "15",
        "100",
    ]


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
