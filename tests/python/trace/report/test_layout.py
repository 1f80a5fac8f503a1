"""The report's outcome as a person sees it: numbers in one piece at any width, the verdict unscrolled."""

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from headless_browser import Browser, started_browser
from synthetic_traces import deploy, overrun, run, swap, trace_of

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import Card, write_report

WIDTHS = (320, 400, 800, 1200, 1920)
FOLD = (1200, 800)
LONG_NAME = "a_component_whose_name_is_much_longer_than_any_tile_is_wide_number"
MICROSECONDS = "\N{MICRO SIGN}s"
LONG_VALUES = (
    "12,345,678,901",
    f"1,234,567.8 {MICROSECONDS}",
    f"1 234 567 {MICROSECONDS}",
    "119 min 59 s",
    "\N{MINUS SIGN}12,345.6 %",
)
NUMBERS = ".card b, .marks span, td.number, .jump small"
BROKEN = f"""JSON.stringify([...document.querySelectorAll("{NUMBERS}")].filter(
  one => one.checkVisibility()).flatMap(function (one) {{
    const range = document.createRange();
    const faults = [];
    const texts = document.createTreeWalker(one, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {{
      range.selectNodeContents(texts.currentNode);
      const boxes = [...range.getClientRects()];
      const frame = one.closest(".card, figure, td, .jump").getBoundingClientRect();
      const text = texts.currentNode.textContent;
      if (new Set(boxes.map(box => Math.round(box.top))).size > 1) faults.push("broken: " + text);
      if (boxes.some(box => box.right > frame.right + 0.5)) faults.push("runs out of its frame: " + text);
    }}
    return faults;
  }}))"""
"""What each number is set in: a text node that has boxes at several heights is broken over lines."""
WIDEST = "document.documentElement.scrollWidth"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from started_browser(size=FOLD)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight components with long names, every one of which overran, was reconfigured and faulted."""
    source = SyntheticSource([f"{LONG_NAME}_{index}" for index in range(8)])
    for component in source.components:
        deploy(source, component)
        pending = overrun(source, component, run(source, component, 20))
        swap(source, component, pending)
        pending = run(source, component, 20, begin_ns=pending)
        source.add(component, Kind.FAULT, pending, name="act")
    path = tmp_path_factory.mktemp("page") / "report.html"
    figures = [Card(value, f"{LONG_NAME}_{value}") for value in LONG_VALUES]
    write_report(path, trace_of(source), title=LONG_NAME, figures=figures)
    return path


@pytest.mark.parametrize("width", WIDTHS)
def test_no_number_is_broken_over_lines_or_runs_out_of_its_frame(browser: Browser, page: Path, width: int):
    browser.resize(width, FOLD[1])
    browser.open(page)
    shown = browser.evaluate("[...document.querySelectorAll('.card b')].map(one => one.innerText)")
    for value in LONG_VALUES:
        assert value in [one.replace("\N{NARROW NO-BREAK SPACE}", " ") for one in shown]
    assert json.loads(browser.evaluate(BROKEN)) == []
    assert browser.evaluate(WIDEST) == width


def test_the_check_of_numbers_finds_a_broken_one(browser: Browser, page: Path):
    browser.resize(400, FOLD[1])
    browser.open(page)
    browser.evaluate("document.querySelector('.card b').style = 'white-space: normal; width: 5em'")
    assert json.loads(browser.evaluate(BROKEN)) == [f"broken: {LONG_VALUES[0]}"]
    browser.evaluate("document.querySelector('.card b').style = 'font-size: 5rem'")
    browser.evaluate("document.querySelector('.card').style = 'min-width: 0'")
    assert json.loads(browser.evaluate(BROKEN)) == [f"runs out of its frame: {LONG_VALUES[0]}"]


def test_the_outcome_is_read_without_scrolling(browser: Browser, page: Path):
    browser.resize(*FOLD)
    browser.open(page)
    first = "document.body.querySelector('*:not(header, div)').parentElement.className"
    assert browser.evaluate(first).startswith("verdict")
    bottoms = [
        browser.evaluate(f"document.querySelector('{what}').getBoundingClientRect().bottom")
        for what in ("h1", ".verdict .sentences", ".verdict details", ".card")
    ]
    assert bottoms == sorted(bottoms)
    assert bottoms[-1] <= FOLD[1]
    assert browser.evaluate("document.querySelector('h1').innerText").startswith(
        "No: 8 faults and 8 overruns in "
    )


def test_what_is_folded_unfolds(browser: Browser, page: Path):
    browser.open(page)
    last = "[...document.querySelectorAll('.verdict li')].at(-1).checkVisibility()"
    assert not browser.evaluate(last)
    browser.evaluate("document.querySelector('.verdict summary').click()")
    assert browser.evaluate(last)


def test_a_usual_page_shows_all_tiles_without_scrolling(browser: Browser, tmp_path: Path):
    source = SyntheticSource(["control", "guidance"])
    for component in source.components:
        deploy(source, component)
    pending = run(source, "control", 200)
    swap(source, "control", pending)
    run(source, "control", 200, begin_ns=pending)
    run(source, "guidance", 400)
    write_report(tmp_path / "report.html", trace_of(source))
    browser.resize(*FOLD)
    browser.open(tmp_path / "report.html")
    assert browser.evaluate("document.querySelector('.cards').getBoundingClientRect().bottom") <= FOLD[1]
    assert browser.evaluate("document.querySelector('h1').innerText").startswith("Yes: ")
    assert browser.complaints == []


WORDS_CUT = """[...document.querySelectorAll("td.words")].filter(one => one.checkVisibility()).filter(
  one => one.scrollWidth > one.clientWidth || one.getBoundingClientRect().right > innerWidth).length"""


def test_a_reason_is_read_whole_on_a_phone(browser: Browser, tmp_path: Path):
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 20)
    swap(source, "c", pending)
    run(source, "c", 20, begin_ns=pending)
    step = SimpleNamespace(component="c", blackout_ns=-1, step="replace_core p/B", to_core="", prepare_ns=0)
    cause = "the operator saw that the arm does not follow, and chose the core that follows more slowly"
    event = SimpleNamespace(success=True, requested_by="mauve", cause=cause, report=[step])
    told = Message(topic="/executor/events", monotonic_ns=pending + 10**9, log_time_ns=0, msg=event)
    path = tmp_path / "report.html"
    write_report(path, trace_of(source), events=[told])
    browser.resize(400, 800)
    browser.open(path)
    shown = browser.evaluate("document.querySelector('#reconfigurations table').innerText")
    assert cause in shown
    assert browser.evaluate(WORDS_CUT) == 0
    label = "getComputedStyle(document.querySelector('td[data-label=why]'), '::before').content"
    assert browser.evaluate(label) == '"why"'
    browser.evaluate("document.querySelectorAll('table').forEach(one => one.classList.remove('stacks'))")
    assert browser.evaluate(WORDS_CUT) > 0, "it was the list that makes it so"
