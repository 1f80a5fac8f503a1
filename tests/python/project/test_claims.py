"""Each promise and each figure of the pages of claims has a proof that is there, and a false one is found."""

import subprocess
import sys
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from claims import PAGES_OF_CLAIMS, PROMISE, problems, sentences
from pages import PAGES, ROOT

OPERATE, RECORD, SEE = "docs/howto/operate.md", "docs/howto/record_and_report.md", "docs/howto/see_values.md"
DEPLOYMENT = "docs/concepts/deployment.md"


@pytest.mark.parametrize("name", PAGES_OF_CLAIMS)
def test_each_claim_of_the_page_has_a_proof(name: str) -> None:
    assert problems(name, PAGES[name]) == []


def test_the_marks_of_all_other_pages_are_right() -> None:
    assert [each for name in PAGES.keys() - PAGES_OF_CLAIMS for each in problems(name, PAGES[name])] == []


def test_words_of_a_promise() -> None:
    for promise in (
        *("It never waits.", "All steps are prepared.", "It misses no release.", "It cannot fail."),
        *("Only this port writes.", "It does not wait.", "A request is refused.", "It stops at once."),
        *(
            "At most 3.",
            "Every write is there.",
            "Without a copy.",
            "None is lost.",
            "Together or not at all.",
        ),
    ):
        assert PROMISE.search(promise), promise
    for other in (
        *("A state that does not end is an error.", "No, or not alone, where:", "It is late.", "A notation."),
        *("Nonetheless it goes on.", "Wait for all of them.", "The list of each component is long."),
    ):
        assert not PROMISE.search(other), other


@pytest.mark.parametrize(
    ("name", "words", "false"),
    [
        (OPERATE, "given up after 0.5 s", "given up after 0.7 s"),
        (OPERATE, "`node_silent_after_s` (5 s)", "`node_silent_after_s` (5 ms)"),
        (OPERATE, "unread for 0.2 s", "unread for 0.3 s"),
        (OPERATE, "for 10 s is refused", "for 11 s is refused"),
        (OPERATE, "for 10 periods, 1 s at least", "for 10 periods, 2 s at least"),
        (RECORD, "Ten times a second", "Six times a second"),
        (RECORD, "up to 24 values", "up to 32 values"),
        (SEE, "polls 10 times a second", "polls 20 times a second"),
        (SEE, "at most 50 times a second", "at most 60 times a second"),
        (DEPLOYMENT, "one epoch, 20 ms ahead", "one epoch, 20 us ahead"),
        (DEPLOYMENT, "(512 KiB unless declared)", "(256 KiB unless declared)"),
        ("README.md", "a component at 200 Hz", "a component at 250 Hz"),
    ],
)
def test_a_false_figure_is_found(name: str, words: str, false: str) -> None:
    page = PAGES[name]
    assert page.count(words) == 1
    (found,) = problems(name, page.replace(words, false))
    assert "no proof has the figure" in found


MARKED = "The commit has 2 steps. <!-- claim: test_words_of_a_promise -->"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("A commit never waits.", "a promise without a mark"),
        (
            "A first sentence. <!-- claim: test_words_of_a_promise --> It misses no release.",
            "a promise without",
        ),
        ("| a commit | misses no release |", "a promise without a mark"),
        ("1. A commit\n   takes 14 us.", "the figure '14 us' has no mark"),
        ("- It takes about two minutes.", "the figure '2 minutes' has no mark"),
        ("A commit waits. <!-- claim: test_that_is_not_there -->", "found 0"),
        ("A commit waits. <!-- claim: Suite.NotThere -->", "found 0"),
        ("A commit waits. <!-- claim: bench: no such row -->", "found 0"),
        ("A commit waits. <!-- claim: bench: , releases missed -->", "found 0"),
        ("A commit waits. <!-- claim: bench: bytes of a record in the bag -->", "no proof of the mark runs"),
        ("A commit waits. <!-- claim: service_thread.py::PATIENCE_S -->", "no proof of the mark runs"),
        ("A commit waits. <!-- claim: test_it_starts -->", "expected 1 test"),
        (f"{MARKED.replace('2', '77')}", "no proof has the figure '77'"),
        ("It takes 3 s. <!-- measured: by hand -->", "and the day"),
        ("It takes long. <!-- measured: 2026-11-26 -->", "expected a figure"),
        ("It takes 3 s at most. <!-- measured: 2026-11-26, by hand -->", "a promise without a mark"),
        ("It waits. <!-- no claim -->", "Remove the mark"),
        ("It waits. <!-- claims: test_words_of_a_promise -->", "malformed"),
        ("It waits.\n<!-- claim: test_words_of_a_promise -->", "at the beginning of a line"),
    ],
)
def test_a_mark_that_is_missing_or_wrong_is_found(text: str, problem: str) -> None:
    assert any(problem in each for each in problems("README.md", f"# Never\n\n{text}\n"))


def test_a_problem_says_where_it_is() -> None:
    (found,) = problems("README.md", "# A\n\nFirst. Then it\nnever\nends.\n\n    it never ends\n")
    assert found.startswith("README.md:3: 'Then it never ends.': a promise without a mark.")


def test_code_headings_names_and_days_have_no_figures() -> None:
    page = (
        "# At most 3\n\nROS 2 of 2026-11-26, #2452, `{cpus: [1]}`, [a](b_3.md), Fig. 3, 5 and 6.\n\n    5 s\n"
    )
    assert [sentence.figures for sentence in sentences(page)] == [[]]
    (code,) = sentences("| `does not end within 10 s` |")
    assert code.figures == [("10 s", 10.0, "s")]


# ---- the tests that ran ---------------------------------------------------------------------------------


def test_a_claim_whose_test_did_not_run_is_told(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(
        "A. <!-- claim: test_a, f/test_x.py::test_b -->\n"
        "B. <!-- claim: Ring.Whole, Typed.Whole, Own.Each -->\n"
        "C. <!-- claim: ctest: gps_lost, node.py::AFTER_S, bench: a row -->\n"
        "D. <!-- claim: test_skipped, test_nowhere, g/test_x.py::test_b, ctest: listings, Ring.Half -->\n"
    )
    results = tmp_path / "results"
    results.mkdir()
    (results / "python.xml").write_text(
        "<testsuites><testsuite><testcase classname='tests.f.test_x' name='test_a[1]'><skipped/></testcase>"
        "<testcase classname='tests.f.test_x' name='test_a[2-b.c]'/>"
        "<testcase classname='tests.f.test_x' name='test_b'><failure/></testcase>"
        "<testcase classname='tests.f.test_x' name='test_skipped[1]'><skipped/></testcase>"
        "</testsuite></testsuites>"
    )
    names = (
        "test_ring.Ring.Whole",
        "test_ring.Typed.Whole<a::B<c.d>/e>",
        "test_ring.All/Own.Each/3  # GetParam() = 3",
        "gps_lost",
    )
    (results / "kernel.xml").write_text(
        "<testsuite>"
        + "".join(
            f"<testcase name={quoteattr(name)} classname={quoteattr(name)} status='run'/>" for name in names
        )
        + "<testcase name='listings' classname='listings' status='notrun'><skipped message=''/></testcase>"
        "</testsuite>"
    )
    program = [sys.executable, ROOT / "scripts" / "check_claims.py", "--root", tmp_path, results]
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    told = [
        line.removeprefix("claim without a test that ran: README.md:4 ") for line in done.stdout.splitlines()
    ]
    assert told == ["test_skipped", "test_nowhere", "g/test_x.py::test_b", "ctest: listings", "Ring.Half"]
    assert (done.returncode, done.stderr) == (1, "")
    (tmp_path / "README.md").write_text("A. <!-- claim: test_a -->\n")
    assert subprocess.run(program, capture_output=True, check=False).returncode == 0
