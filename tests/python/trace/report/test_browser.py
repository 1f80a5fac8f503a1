"""The report in a headless Chromium: it draws, zooms, tells what is under the pointer, without complaint."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from headless_browser import Browser, started_browser
from synthetic_traces import deploy, long_trace, overrun, run, swap, trace_of

from mauve_rt.trace.format.records import DEADLINE_MISSED, Kind
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import write_report

SCHEMES = ("light", "dark")
INK = """(() => {
  const canvas = document.querySelector(".plot canvas");
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const context = copy.getContext("2d", {willReadFrequently: true});
  context.drawImage(canvas, 0, 0);
  const row = mauve.timeline.rowHeight * devicePixelRatio;
  const top = mauve.AXIS_HEIGHT * devicePixelRatio;
  return mauve.timeline.model.rows.map((_, index) => {
    const data = context.getImageData(0, top + index * row + 2, canvas.width, row - 6).data;
    let inked = 0;
    for (let i = 3; i < data.length; i += 4) inked += data[i] > 60;
    return inked;
  });
})()"""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    source = SyntheticSource(["control", "guidance"])
    for component in source.components:
        deploy(source, component)
    pending = overrun(source, "control", run(source, "control", 200))
    swap(source, "control", pending)
    run(source, "control", 200, begin_ns=pending)
    run(source, "guidance", 402)
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_report(path, trace_of(source), title="A page to be tried")
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from started_browser(fineness=1.5)


@pytest.fixture(autouse=True)
def _no_complaints_of_others(browser: Browser) -> None:
    browser.complaints.clear()
    browser.requests.clear()


def view(browser: Browser) -> tuple[float, float]:
    found = json.loads(browser.evaluate("JSON.stringify(mauve.timeline.view)"))
    return found["begin"], found["end"]


def plot(browser: Browser) -> tuple[float, float, float, float]:
    """Left, top, width and height of the plot, brought into view."""
    browser.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
    browser.evaluate("document.getElementById('timeline').scrollIntoView({block: 'center'})")
    browser.settle()
    box = "document.querySelector('.plot').getBoundingClientRect()"
    return tuple(
        json.loads(browser.evaluate(f"JSON.stringify([{box}.left, {box}.top, {box}.width, {box}.height])"))
    )


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_page_works_and_nobody_complains(browser: Browser, page: Path, scheme: str):
    browser.scheme(scheme)
    browser.open(page)
    assert browser.evaluate("document.documentElement.dataset.ready") == "yes"
    assert min(browser.evaluate(INK)) > 200  # something is drawn in every row

    left, top, width, _ = plot(browser)
    row = top + browser.evaluate("mauve.AXIS_HEIGHT + mauve.timeline.rowHeight / 2")
    whole = view(browser)
    for _ in range(20):
        browser.wheel(left + width / 4, row, -240)
    begin, end = view(browser)
    assert end - begin < (whole[1] - whole[0]) / 50
    quarter = whole[0] + (whole[1] - whole[0]) / 4
    assert begin < quarter < end  # zoomed at the pointer
    assert max(browser.evaluate(INK)) > 200

    browser.drag((left + width / 2, row), (left + width / 4, row))
    assert view(browser)[0] == pytest.approx(begin + (end - begin) / 4, rel=0.01)
    browser.key("ArrowLeft")
    assert view(browser)[0] < begin + (end - begin) / 4
    browser.double_click(left + width / 2, row)
    assert view(browser) == pytest.approx(whole)

    assert browser.complaints == []
    assert [one for one in browser.requests if not one.startswith(("file:", "data:"))] == []


def test_a_single_overrun_is_seen_from_afar_and_reached_by_its_button(browser: Browser, page: Path):
    browser.scheme("light")
    browser.open(page)
    left, top, width, _ = plot(browser)
    whole = view(browser)
    browser.evaluate("document.querySelector('[data-jump=overrun] button:last-child').click()")
    browser.settle()
    begin, end = view(browser)
    assert end - begin < (whole[1] - whole[0]) / 20
    time = browser.evaluate("mauve.timeline.model.rows[0].markers.find(one => one.kind == 'overrun').time[0]")
    assert begin < time < end
    browser.evaluate("document.querySelector('[data-zoom=all]').click()")
    browser.settle()
    x = left + width * (time - whole[0]) / (whole[1] - whole[0])
    browser.mouse("mouseMoved", x, top + browser.evaluate("mauve.AXIS_HEIGHT + 12"))
    browser.settle()
    tip = browser.evaluate("document.getElementById('tip').innerText")
    assert "overrun" in tip
    assert "late by" in tip


def test_a_page_about_a_missed_deadline_opens_there(browser: Browser, tmp_path: Path):
    source = SyntheticSource(["control", "guidance"])
    for component in source.components:
        deploy(source, component)
        run(source, component, 400)
    source.add("guidance", Kind.MARK, source.now_ns, name=DEADLINE_MISSED, a=1_000_000)
    path = tmp_path / "report.html"
    write_report(path, trace_of(source))
    browser.open(path)
    begin, end = view(browser)
    time = browser.evaluate("mauve.timeline.model.rows[1].markers.find(one => one.kind == 'mark').time[0]")
    whole = browser.evaluate("mauve.timeline.model.duration")
    assert begin < time < end
    assert end - begin < whole / 4
    assert not browser.complaints


def test_hovering_tells_a_state_and_its_times(browser: Browser, page: Path):
    browser.scheme("dark")
    browser.open(page)
    begin = browser.evaluate("mauve.timeline.model.rows[1].states[0].begin[7]")
    browser.evaluate(f"mauve.timeline.show({begin} - 100000, {begin} + 700000)")
    browser.settle()
    left, top, width, _ = plot(browser)
    browser.mouse(
        "mouseMoved",
        left + width / 5,
        top + browser.evaluate("mauve.AXIS_HEIGHT + mauve.timeline.rowHeight * 1.6"),
    )
    browser.settle()
    tip = browser.evaluate("document.getElementById('tip').innerText").replace("\u202f", " ")
    assert not browser.evaluate("document.getElementById('tip').hidden")
    for word in (
        "guidance",
        "sense",
        "execution time",
        "200 \N{MICRO SIGN}s",
        "wake-up latency",
        "10.0 \N{MICRO SIGN}s",
    ):
        assert word in tip
    browser.mouse("mouseMoved", 2, 2)
    browser.settle()
    assert browser.evaluate("document.getElementById('tip').hidden")


def test_the_theme_button_changes_the_colours(browser: Browser, page: Path):
    browser.scheme("light")
    browser.open(page)
    paper = "getComputedStyle(document.body).backgroundColor"
    light = browser.evaluate(paper)
    browser.evaluate("document.getElementById('theme').click()")
    browser.settle()
    assert browser.evaluate(paper) != light
    assert min(browser.evaluate(INK)) > 200


def test_a_canvas_of_a_new_size_is_drawn_in_the_same_frame(browser: Browser, page: Path):
    browser.open(page)
    assert min(browser.evaluate(f"(mauve.timeline.resize(), {INK})")) > 200


def test_what_is_merged_says_so(browser: Browser, tmp_path: Path):
    write_report(tmp_path / "report.html", long_trace(["c"], 5_000, late=[4_000]), budget=1_000)
    browser.open(tmp_path / "report.html")
    merged = "mauve.timeline.model.rows[0].states[0]"
    assert browser.evaluate(f"{merged}.number.some(number => number > 1)")
    begin, extent = browser.evaluate(
        f"(() => {{ const i = {merged}.number.findIndex(n => n > 1);"
        f"return [{merged}.begin[i], {merged}.extent[i]]; }})()"
    )
    browser.evaluate(f"mauve.timeline.show({begin}, {begin + extent})")
    left, top, width, _ = plot(browser)
    browser.mouse("mouseMoved", left + width / 2, top + browser.evaluate("mauve.AXIS_HEIGHT + 30"))
    browser.settle()
    tip = browser.evaluate("document.getElementById('tip').innerText")
    assert "merged" in tip
    assert "kept in full" in tip
    assert min(browser.evaluate(INK)) > 200
    assert browser.complaints == []


def test_hovering_a_histogram_tells_counts(browser: Browser, page: Path):
    browser.open(page)
    browser.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
    browser.evaluate(
        "document.querySelector('#distributions [data-histogram]').scrollIntoView({block: 'center'})"
    )
    browser.settle()
    box = json.loads(
        browser.evaluate(
            "(() => { const b = document.querySelector('#distributions .bars').getBoundingClientRect();"
            "return JSON.stringify([b.right - 1, b.top + b.height / 2]); })()"
        )
    )
    browser.mouse("mouseMoved", *box)
    browser.settle()
    tip = browser.evaluate("document.getElementById('tip').innerText").replace("\u202f", " ")
    assert re.search(r"\d \N{MICRO SIGN}s to .*\d \N{MICRO SIGN}s\s+count\s+\d+ \([\d.]+ %\)", tip)
    assert browser.complaints == []


def test_one_chooses_which_reconfiguration_is_shown(browser: Browser, tmp_path: Path):
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 10)
    for _ in range(2):
        swap(source, "c", pending)
        pending = run(source, "c", 10, begin_ns=pending)
    write_report(tmp_path / "report.html", trace_of(source))
    browser.open(tmp_path / "report.html")
    shown = "[...document.querySelectorAll('.swap')].map(one => one.checkVisibility())"
    assert browser.evaluate(shown) == [True, False]
    browser.evaluate(
        "(() => { const s = document.querySelector('[data-chooser=swap]'); s.value = '1';"
        "s.dispatchEvent(new Event('change')); })()"
    )
    assert browser.evaluate(shown) == [False, True]


def test_a_trace_without_records_is_shown_without_complaint(browser: Browser, tmp_path: Path):
    write_report(tmp_path / "report.html", trace_of(SyntheticSource(["silent"])))
    browser.open(tmp_path / "report.html")
    assert browser.evaluate("document.documentElement.dataset.ready") == "yes"
    assert browser.complaints == []


def test_a_view_goes_down_to_single_microseconds_and_no_further_than_the_trace(browser: Browser, page: Path):
    browser.open(page)
    browser.evaluate("mauve.timeline.show(1e9, 1e9 + 1000)")
    browser.settle()
    assert view(browser) == (1e9, 1e9 + 1000)
    assert "1 \N{MICRO SIGN}s in view" in browser.evaluate(
        "document.querySelector('.where').textContent"
    ).replace("\u202f", " ")
    browser.evaluate("mauve.timeline.show(-1e15, 1e15)")
    browser.settle()
    begin, end = view(browser)
    duration = browser.evaluate("mauve.timeline.model.duration")
    assert (begin, end) == pytest.approx((-0.01 * duration, 1.01 * duration))
