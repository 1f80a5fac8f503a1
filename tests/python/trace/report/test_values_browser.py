"""Curves of values in a headless Chromium: they are drawn, and share cursor and zoom with the timeline."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from headless_browser import Browser, started_browser
from synthetic_traces import (
    EPOCH_NS,
    MS,
    PERIOD_NS,
    Pose,
    deploy,
    long_trace,
    run,
    swap,
    trace_of,
    with_values,
)

from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import write_report

POSE = "/robot_1/executor/values/pose"
LONG = "/robot_1/executor/values/a_resource_whose_name_is_much_longer_than_the_column_of_names"
CYCLES = 100
PIXELS = """((top, height, of) => {
  const canvas = document.querySelector("#values-view canvas");
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const context = copy.getContext("2d", {willReadFrequently: true});
  context.drawImage(canvas, 0, 0);
  const probe = document.createElement("canvas").getContext("2d");
  probe.fillStyle = mauve.timeline.colours[of];
  probe.fillRect(0, 0, 1, 1);
  const wanted = probe.getImageData(0, 0, 1, 1).data;
  const fine = devicePixelRatio;
  const data = context.getImageData(0, top * fine, canvas.width, height * fine).data;
  const columns = new Set();
  for (let i = 0; i < data.length; i += 4) {
    const near = [0, 1, 2].every((k) => Math.abs(data[i + k] - wanted[k]) < 60);
    if (near && data[i + 3] > 100) columns.add((i / 4) % canvas.width);
  }
  return columns.size / canvas.width;
})"""
"""Share of the canvas' columns of pixels that have a colour, between two heights."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from started_browser(size=(1400, 1000), fineness=1.5)


@pytest.fixture(autouse=True)
def _no_complaints_of_others(browser: Browser) -> None:
    browser.resize(1400, 1000)
    browser.complaints.clear()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """pose.x counts the periods; pose.y is NaN in the second quarter."""
    source = SyntheticSource(["control"])
    deploy(source, "control")
    pending = run(source, "control", CYCLES)
    swap(source, "control", pending)
    run(source, "control", CYCLES, begin_ns=pending)
    source.add("control", Kind.FAULT, source.now_ns, name="act")
    poses = [
        (EPOCH_NS + n * PERIOD_NS, Pose(n, math.nan if 50 <= n < 100 else math.sin(n / 9)))
        for n in range(2 * CYCLES)
    ]
    path = tmp_path_factory.mktemp("page") / "report.html"
    write_report(path, with_values(trace_of(source), {POSE: poses, LONG: poses, "/still": poses[:1]}))
    return path


def box(browser: Browser, selector: str) -> tuple[float, float, float, float]:
    """Left, top, width and height of an element, brought into view."""
    browser.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
    browser.evaluate(f"document.querySelector('{selector}').scrollIntoView({{block: 'center'}})")
    browser.settle()
    found = browser.evaluate(
        f"(() => {{ const b = document.querySelector('{selector}').getBoundingClientRect();"
        "return JSON.stringify([b.left, b.top, b.width, b.height]); })()"
    )
    return tuple(json.loads(found))


def outputs(browser: Browser) -> list[str]:
    return browser.evaluate(
        "[...document.querySelectorAll('#values-view output')].map(one => one.textContent)"
    )


def place(browser: Browser, time_ns: float) -> float:
    """Of an instant in a plot, in px from its left."""
    return browser.evaluate(f"mauve.timeline.scale().x({time_ns})")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_curves_gaps_and_marks_are_drawn(browser: Browser, page: Path, scheme: str):
    browser.scheme(scheme)
    browser.open(page)
    row = "24 + 72 * {}"
    full, gaps = (browser.evaluate(f"{PIXELS}({row.format(index)}, 70, 'accent')") for index in (0, 1))
    assert full > 0.95
    assert gaps == pytest.approx(0.75 * full, abs=0.05)
    for mark in ("swap", "bad"):
        assert 0 < browser.evaluate(f"{PIXELS}({row.format(5)}, 70, '{mark}')") < 0.02
    assert browser.complaints == []


def test_the_cursor_is_common(browser: Browser, page: Path):
    browser.scheme("light")
    browser.open(page)
    assert set(outputs(browser)) == {"\N{EN DASH}"}
    begin = browser.evaluate("mauve.values.curves[0].time[0]")
    x = place(browser, begin + 30.5 * PERIOD_NS)
    left, top, _, _ = box(browser, "#timeline-view .plot")
    browser.mouse("mouseMoved", left + x, top + 60)
    browser.settle()
    assert outputs(browser)[0] == "30"
    left, top, _, _ = box(browser, "#values-view .plot")
    crosses = (
        "[...document.querySelectorAll('.cross')].map(one => one.hidden ? null : parseFloat(one.style.left))"
    )
    x = place(browser, begin + 70.5 * PERIOD_NS)
    browser.mouse("mouseMoved", left + x, top + 60)
    browser.settle()
    assert outputs(browser)[:2] == ["70", "no number"]
    assert browser.evaluate(crosses) == pytest.approx([x, x], abs=1)
    tip = browser.evaluate("document.getElementById('tip').innerText")
    assert "pose.x" in tip
    assert "70" in tip
    browser.mouse("mouseMoved", 2, 2)
    browser.settle()
    assert browser.evaluate(crosses) == [None, None]
    assert set(outputs(browser)) == {"\N{EN DASH}"}
    assert browser.complaints == []


def test_zoom_is_common(browser: Browser, page: Path):
    browser.open(page)
    view = "JSON.stringify(mauve.timeline.view)"
    whole = json.loads(browser.evaluate(view))
    left, top, width, _ = box(browser, "#values-view .plot")
    for _ in range(10):
        browser.wheel(left + width / 4, top + 60, -240)
    browser.settle()
    zoomed = json.loads(browser.evaluate(view))
    assert zoomed["end"] - zoomed["begin"] < (whole["end"] - whole["begin"]) / 10
    assert "in view" in browser.evaluate("document.querySelector('.where').textContent")
    before = browser.evaluate("document.querySelector('#values-view canvas').toDataURL()")
    browser.evaluate("mauve.timeline.showAll()")
    browser.settle()
    assert browser.evaluate("document.querySelector('#values-view canvas').toDataURL()") != before
    browser.drag((left + width / 2, top + 60), (left + width / 4, top + 60))
    browser.key("+")
    assert json.loads(browser.evaluate(view)) != whole
    browser.key("0")
    assert json.loads(browser.evaluate(view)) == pytest.approx(whole)
    assert browser.complaints == []


def test_the_plots_have_the_same_width(browser: Browser, page: Path):
    browser.open(page)
    assert box(browser, "#values-view .plot")[2] == box(browser, "#timeline-view .plot")[2]


def test_a_narrow_window_does_not_scroll_sideways(browser: Browser, page: Path):
    browser.resize(400, 800)
    browser.open(page)
    assert browser.evaluate("document.documentElement.scrollWidth") <= 400
    assert browser.evaluate(f"{PIXELS}(24, 70, 'accent')") > 0.9
    assert browser.complaints == []


def test_merged_samples_are_shown_as_a_range(browser: Browser, tmp_path: Path):
    poses = [(EPOCH_NS + n * MS, Pose(n % 2, n)) for n in range(50_000)]
    path = tmp_path / "report.html"
    write_report(path, with_values(long_trace(["c"], 5_000), {POSE: poses}))
    browser.open(path)
    text = browser.evaluate(
        "(() => { const c = mauve.values.curves[0];"
        "return c.text(c.time[c.number.findIndex((n) => n > 1)]); })()"
    )
    assert text == "0 to 1"
    assert browser.evaluate(f"{PIXELS}(24, 70, 'accent')") > 0.95
    assert browser.complaints == []
