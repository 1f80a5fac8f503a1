"""docs/concepts/kernel_rules.md has each rule that the kernel cites, and each rule has its tests."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from check_claims import named_tests
from pages import PAGES, ROOT
from proofs import GTEST

NAME = "docs/concepts/kernel_rules.md"
PAGE = PAGES[NAME]
KERNEL_TESTS = ROOT / "tests" / "kernel"
SECTION = re.compile(r"^## (\d+)\. ", re.MULTILINE)
NUMBERED = re.compile(r"Rule(\d+)")
CITED = re.compile(r"\b[Rr]ules? (\d+(?:(?:, | and )\d+)*)\b")
# A description of the project that its readers do not have. The brackets keep this file out.
UNAVAILABLE = re.compile(r"\b[D]ESIGN\b")
SUFFIXES = (
    *(".cmake", ".cpp", ".hpp", ".in", ".json", ".md", ".msg", ".py", ".pyi", ".rs", ".rst", ".sh", ".srv"),
    *(".toml", ".txt", ".xml", ".yaml", ".yml", ""),
)
FOLDERS = ("benchmarks", "cmake", "docs", "mauve_examples", "mauve_msgs", "mauve_rt", "scripts", "tests")


def _sources(*folders: Path) -> Iterator[Path]:
    return (file for folder in folders for file in sorted(folder.rglob("*.[ch]pp")))


def _fixtures() -> dict[int, set[str]]:
    """The fixtures of the kernel's tests that are named after a rule, by its number."""
    found: dict[int, set[str]] = {}
    for file in _sources(KERNEL_TESTS):
        for fixture, _ in GTEST.findall(file.read_text(encoding="utf-8")):
            if number := NUMBERED.match(fixture):
                found.setdefault(int(number[1]), set()).add(fixture)
    return found


def _sections(page: str) -> dict[int, str]:
    """The sections of the rules, by their numbers."""
    numbers, texts = [int(each) for each in SECTION.findall(page)], SECTION.split(page)[2::2]
    assert numbers == list(range(1, len(numbers) + 1))
    return dict(zip(numbers, texts, strict=True))


def _problems(page: str, fixtures: dict[int, set[str]]) -> list[str]:
    """What the page lacks of the tests, and the tests of the page."""
    sections = _sections(page)
    missing = [
        f"{NAME}: expected a section of rule {number} for {', '.join(sorted(fixtures[number]))}. Write it."
        for number in sorted(fixtures.keys() - sections.keys())
    ]
    for number, text in sections.items():
        named = {test.partition(".")[0] for _, test in named_tests(text)}
        if number not in fixtures:
            missing.append(
                f"{NAME}: rule {number}: expected a fixture Rule{number}... in tests/kernel. Add it."
            )
        elif not named & fixtures[number]:
            missing.append(f"{NAME}: rule {number}: expected a mark with a test of Rule{number}... Add it.")
    return missing


def test_each_rule_has_its_tests_and_each_test_its_rule() -> None:
    assert _fixtures().keys() >= {1, 10}
    assert _problems(PAGE, _fixtures()) == []


@pytest.mark.parametrize(
    ("page", "fixtures", "problem"),
    [
        ("## 1. A\n\nB. <!-- claim: Rule1A.B -->\n", {1: {"Rule1A"}, 2: {"Rule2A"}}, "a section of rule 2"),
        ("## 1. A\n\nB. <!-- claim: Rule1A.B -->\n", {}, "rule 1: expected a fixture"),
        ("## 1. A\n\nB. <!-- claim: Rule10A.B -->\n", {1: {"Rule1A"}}, "rule 1: expected a mark"),
    ],
)
def test_what_is_missing_is_found(page: str, fixtures: dict[int, set[str]], problem: str) -> None:
    (found,) = _problems(page, fixtures)
    assert problem in found


def test_the_rules_that_comments_of_the_kernel_cite_are_there() -> None:
    cited = {
        int(number)
        for file in _sources(ROOT / "mauve_rt" / "kernel", KERNEL_TESTS)
        for found in CITED.finditer(file.read_text(encoding="utf-8"))
        for number in re.findall(r"\d+", found[1])
    }
    assert len(cited) > 5
    assert cited <= _sections(PAGE).keys()


def test_no_file_cites_a_page_that_readers_do_not_have() -> None:
    files = [
        *(file for file in ROOT.iterdir() if file.is_file()),
        *(file for folder in FOLDERS for file in (ROOT / folder).rglob("*")),
    ]
    texts = [file for file in files if file.suffix in SUFFIXES and file.is_file()]
    assert len(texts) > 1000
    citing = [file for file in texts if UNAVAILABLE.search(file.read_text("utf-8", errors="replace"))]
    assert [file.relative_to(ROOT).as_posix() for file in citing] == []
