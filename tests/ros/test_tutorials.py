"""Each tutorial in docs/ is done as its reader does it: its files are written, its commands typed."""

import os
from pathlib import Path

import pytest
from tutorial_pages import PAGES, Reader, commands, needed, pattern


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory, domain: int) -> Reader:
    """One folder for all pages: what a page needs of an earlier one is done once."""
    generator = os.environ.get("CMAKE_GENERATOR", "Ninja")  # CMake's own choice, make, may be missing
    environment = {"ROS_DOMAIN_ID": str(domain), "CMAKE_GENERATOR": generator}
    return Reader(tmp_path_factory.mktemp("tutorials"), environment)


@pytest.mark.parametrize("page", sorted(page.name for page in PAGES.glob("*.md")))
def test_the_page_does_what_it_says(page: str, reader: Reader) -> None:
    reader.do(page)


def test_a_tutorial_is_done_after_those_that_it_needs() -> None:
    page = "## What you need\n\n- [one](01_one.md), [two](02_two.md)\n\n## 1.\n\nNext: [4](04_four.md)\n"
    assert needed(page) == ["01_one.md", "02_two.md"]


def test_commands_are_told_from_their_output() -> None:
    text = "$ one \\\n    two\nout\n\n$ three &\n"
    assert list(commands(text)) == [("one two", "out\n\n"), ("three &", "")]


@pytest.mark.parametrize(
    ("shown", "output", "fits"),
    [
        ("a 1\n", "a   1\n", True),
        ("a 1\n", "a 2\n", False),
        ("a ... c\n", "a b c\n", True),
        ("a\n", "a\nb\n", False),
        ("a\n...\n", "a\nb\nc\n", True),
        ("...\nc\n", "a\nb\nc\n", True),
        ("...\nc\n", "a\nb\n", False),
    ],
)
def test_output_is_held_against_what_the_page_shows(shown: str, output: str, *, fits: bool) -> None:
    assert (pattern(shown).fullmatch(output) is not None) == fits


def test_output_that_differs_fails_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "01_wrong.md").write_text("```console\n$ echo yes\nno\n```\n", encoding="utf-8")
    monkeypatch.setattr("tutorial_pages.PAGES", tmp_path)
    with pytest.raises(AssertionError, match=r"01_wrong.md, line 1: echo yes: status 0\nyes"):
        Reader(tmp_path, {}).do("01_wrong.md")
