"""Decisions of rules in a report: flags, places to go to, a table; and what the page makes of them."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from headless_browser import Browser, started_browser
from synthetic_traces import MS, ROOT, periodic_trace
from trace_decisions import said, trace_with_rules

from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report import write_report
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.decisions import decision_flags, decision_places
from mauve_rt.trace.report.timeline import interesting_instants, timeline_data

INKED = """(() => {
  const canvas = document.querySelector(".plot canvas");
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const context = copy.getContext("2d", {willReadFrequently: true});
  context.drawImage(canvas, 0, 0);
  const model = mauve.timeline.model;
  const top = mauve.AXIS_HEIGHT + model.rows.length * mauve.timeline.rowHeight;
  const data = context.getImageData(0, top + 2, canvas.width, mauve.rulesHeight(model) - 4).data;
  let inked = 0;
  for (let i = 3; i < data.length; i += 4) inked += data[i] > 60;
  return inked;
})()"""


@pytest.fixture
def trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Trace:
    shutil.copytree(ROOT / "mauve_msgs" / "msg", tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    return trace_with_rules(
        tmp_path / "bag",
        said(51, "do", "nothing on /scan for <0.10 s>", act="do"),
        said(60, "done", "do: replace_core", act="do", took_s=0.011, bound_s=0.02),
    )


@pytest.fixture
def browser() -> Iterator[Browser]:
    yield from started_browser()


def test_each_decision_has_a_flag_with_its_reason(trace: Trace) -> None:
    armed, _, do, done, no_undo = decision_flags(analyse(trace))
    assert do == {
        "time": 51 * MS,
        "rule": "lidar_lost",
        "decision": "do",
        "reason": "nothing on /scan for <0.10 s>",
        "level": "acts",
        "took": None,
        "bound": None,
    }
    assert (done["took"], done["bound"]) == (11 * MS, 20 * MS)
    assert (no_undo["level"], no_undo["reason"]) == ("waits", "cooldown")
    assert (armed["level"], armed["reason"]) == ("sees", "")


def test_decisions_are_places_to_go_to_below_the_components(trace: Trace) -> None:
    analysis = analyse(trace)
    assert decision_places(analysis)[2] == [1, 51 * MS, 0]
    described, _ = timeline_data(analysis)
    assert described["jumps"]["decision"] == decision_places(analysis)
    assert described["decisions"] == decision_flags(analysis)


def test_what_is_around_a_decision_is_kept_in_full(trace: Trace) -> None:
    analysis = analyse(trace)
    instants = interesting_instants(analysis, {"c": []})
    assert 51 * MS in instants.tolist()


def test_the_table_tells_time_rule_decision_reason_and_how_long_it_took(trace: Trace, tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", trace)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    section = page[page.index('<section id="decisions">') :]
    rows = re.findall(r"<tr>(.*?)</tr>", section[: section.index("</section>")])
    cells = [[re.sub("<[^>]*>", "", cell) for cell in re.findall(r"<td.*?</td>", row)] for row in rows]
    told = [[cell.replace("\N{NARROW NO-BREAK SPACE}", " ") for cell in row] for row in cells if row]
    assert told[2] == [
        "51 ms",
        "lidar_lost",
        "do",
        "nothing on /scan for &lt;0.10 s&gt;",
        "\N{EN DASH}",
        "\N{EN DASH}",
    ]
    assert told[3][4:] == ["11 ms", "20 ms"]
    assert len(told) == 5
    assert 'data-jump="decision"' in page
    assert "decision of a rule" in page


def test_a_trace_without_decisions_has_neither_row_nor_table_nor_button(tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", periodic_trace())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for part in ('id="decisions"', 'data-jump="decision"', '<div class="rules-name">', "decision of a rule"):
        assert part not in page


def middle_of_the_view(browser: Browser) -> float:
    """When it no longer moves."""
    middle, before = 0.0, -1.0
    while middle != before:
        browser.settle()
        before = middle
        middle = browser.evaluate("(mauve.timeline.view.begin + mauve.timeline.view.end) / 2")
    return middle


def test_flags_are_drawn_tell_why_and_are_reached_by_the_button(
    browser: Browser, trace: Trace, tmp_path: Path
) -> None:
    write_report(tmp_path / "report.html", trace)
    browser.open(tmp_path / "report.html")
    assert browser.evaluate(INKED) > 5 * 20
    for _ in range(3):
        browser.evaluate("document.querySelector('[data-jump=decision] button:last-child').click()")
        browser.settle()
    assert middle_of_the_view(browser) == pytest.approx(51 * MS, abs=MS)
    browser.evaluate("document.documentElement.style.scrollBehavior = 'auto'")
    browser.evaluate("document.getElementById('timeline').scrollIntoView({block: 'center'})")
    browser.evaluate(f"mauve.timeline.show({51 * MS - 100_000}, {51 * MS + 100_000})")
    browser.settle()
    box = "document.querySelector('.plot').getBoundingClientRect()"
    x, y = (browser.evaluate(f"{box}.left + {box}.width / 2"), browser.evaluate(f"{box}.bottom - 10"))
    browser.mouse("mouseMoved", x, y)
    browser.settle()
    tip = browser.evaluate("document.getElementById('tip').innerText")
    assert tip.startswith("lidar_lost: do: nothing on /scan for <0.10 s>")
    assert browser.complaints == []
