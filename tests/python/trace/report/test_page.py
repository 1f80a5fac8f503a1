"""The page as a whole: whatever the trace, it is one file, safe, and not too large."""

import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_traces import (
    EPOCH_NS,
    PERIOD_NS,
    deploy,
    long_trace,
    overrun,
    periodic_trace,
    run,
    swap,
    trace_of,
)

from mauve_rt.cli.main import main
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.architecture import ComponentInfo, PortInfo
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.trace import Trace, merge_traces
from mauve_rt.trace.recording.ledger import Entry
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report import Card, Section, Sentence, Verdict, judge, write_report
from mauve_rt.trace.report.analysis import analyse
from mauve_rt.trace.report.bags import bag_names
from mauve_rt.trace.report.blocks import prose
from mauve_rt.trace.report.verdict import verdict_html

HOSTILE = "</script><script>alert(1)</script><!--\"'&amp;"


def page_of(trace: Trace, folder: Path, **more: object) -> str:
    path = folder / "report.html"
    write_report(path, trace, **more)  # type: ignore[arg-type]
    return path.read_text(encoding="utf-8")


def eventful_trace(name: str = "c") -> Trace:
    source = SyntheticSource([name, "other"])
    for component in source.components:
        deploy(source, component)
    run(source, "other", 80)
    pending = overrun(source, name, run(source, name, 20))
    swap(source, name, pending)
    pending = run(source, name, 20, begin_ns=pending)
    source.add(name, Kind.MARK, pending, name="the user's mark", a=2**62)
    source.add(name, Kind.FAULT, pending, name="act")
    return trace_of(source)


def architecture(components: int) -> tuple[ComponentInfo, ...]:
    """A ring of components, each writing what the next one reads, with a resource of all."""
    return tuple(
        ComponentInfo(
            *(f"c{index}", "p/Shell", "p/Core", "p/Fsm", PERIOD_NS, 0, "SCHED_FIFO", index, (0, 1)),
            (
                PortInfo("out", "write", "p/T", f"data{index}", "write"),
                PortInfo("in", "read", "p/T", f"data{(index - 1) % components}", "read"),
                PortInfo("map", "call", "p/Map", "map", "get"),
                PortInfo("free", "read", "p/T", "", ""),
            ),
        )
        for index in range(components)
    )


def test_a_page_needs_nothing_but_itself(tmp_path: Path):
    page = page_of(eventful_trace(), tmp_path)
    assert page.startswith("<!DOCTYPE html>")
    assert not re.search(r"(?:src|href)\s*=\s*[\"'](?!#|data:)", page)
    assert not re.search(r"https?://|@import|url\(", page)
    assert "default-src &#x27;none&#x27;" in page
    for heading in (
        "Timeline",
        "Reconfigurations",
        "Latencies and execution times",
        "Architecture",
        "Components",
    ):
        assert f"<h2>{heading}</h2>" in page


def test_the_verdict_comes_first_then_the_tiles_then_the_rest(tmp_path: Path):
    page = page_of(eventful_trace(), tmp_path, extra=[Section("The map", "<p>here</p>")])
    body = page[page.index("<body>") + len("<body>") :].lstrip()
    assert body.startswith('<header><div class="verdict bad">')
    marks = (
        *("<h1><strong>No</strong>: ", '<ul class="sentences">', "<details>", '<div class="cards">'),
        *("</header>", "<nav>", "<main>", "<h2>The map</h2>"),
    )
    places = [body.index(mark) for mark in marks]
    assert places == sorted(places)
    assert body.count("<h1>") == 1


def test_the_first_reasons_are_read_at_once_and_all_others_folded(tmp_path: Path):
    trace = eventful_trace()
    page = page_of(trace, tmp_path)
    header = page[page.index("<header>") : page.index("</header>")]
    at_once, folded = header.split("<details>")
    expected = [prose(one.text) for one in judge(analyse(trace)).sentences]
    assert len(expected) > 6
    assert re.findall("<li[^>]*>(.*?)</li>", at_once) == expected[:5]
    assert re.findall("<li[^>]*>(.*?)</li>", folded) == expected[5:]
    assert f"<summary>{len(expected) - 5} more facts</summary>" in folded


def test_a_single_further_reason_is_not_folded():
    def page(count: int) -> str:
        return verdict_html(
            Verdict("good", "all is well", [Sentence("", "a fact")] * count, "Yes"), title="t"
        )

    assert [page(count).count("<details>") for count in (0, 5, 6, 7)] == [0, 0, 0, 1]
    assert [page(count).count("<li") for count in (0, 5, 6, 7)] == [0, 5, 6, 7]


@pytest.mark.parametrize(
    ("text", "html"),
    [
        ("silent for 1.03 s", "silent for 1.03_s"),
        ("58.3 ms (4 \N{MICRO SIGN}s), 20 Hz", "58.3_ms (4_\N{MICRO SIGN}s), 20_Hz"),
        ("80 % of 2 min 3 s", "80_% of 2_min 3_s"),
        ("4 states, 3 moments & 2 hours", "4 states, 3 moments &amp; 2 hours"),
    ],
)
def test_no_line_ends_between_a_number_and_its_unit(text: str, html: str):
    assert prose(text) == html.replace("_", "\N{NARROW NO-BREAK SPACE}")


def test_names_cannot_write_html(tmp_path: Path):
    trace = eventful_trace(HOSTILE)
    names = tuple(f"{name}{HOSTILE}" for name in trace.names)
    info = replace(architecture(1)[0], name=HOSTILE, core=HOSTILE)
    info = replace(info, ports=(PortInfo(HOSTILE, "read", HOSTILE, HOSTILE, HOSTILE),))
    step = SimpleNamespace(
        step=HOSTILE, component=HOSTILE.rpartition("/")[2], prepare_ns=1, blackout_ns=1, from_core=HOSTILE,
        to_core=HOSTILE,
    )  # fmt: skip
    event = SimpleNamespace(success=True, requested_by=HOSTILE, cause=HOSTILE, report=[step])
    message = Message("/a/executor/events", 0, EPOCH_NS + 30 * PERIOD_NS, event)
    page = page_of(
        replace(trace, names=names, architecture=(info,)),
        tmp_path,
        title=HOSTILE,
        extra=[Section(HOSTILE, "", note=HOSTILE, anchor=HOSTILE)],
        figures=[Card(HOSTILE, HOSTILE)],
        events=[message],
    )
    assert "<script>alert" not in page
    assert page.count("</script>") == 3  # of our own: description, columns, program
    assert "<!--" not in page


@pytest.mark.parametrize(
    "trace",
    [
        Trace({}, (), {}, np.empty((0, 2), np.int64)),
        trace_of(SyntheticSource(["silent"])),
        periodic_trace(cycles=1),
        periodic_trace([f"component_{index}" for index in range(60)], 5),
        replace(periodic_trace([f"c{index}" for index in range(30)], 5), architecture=architecture(30)),
        replace(periodic_trace(["c0"], 5), architecture=architecture(5)),
    ],
    ids=["empty", "no record", "one release", "60 components", "30 connected", "more told than recorded"],
)
def test_any_trace_gives_a_page(trace: Trace, tmp_path: Path):
    page = page_of(trace, tmp_path)
    assert all(name in page for name in trace.components)
    shown = re.sub(r"<script>.*</script>", "", page, flags=re.DOTALL)
    assert not re.search(r"\b(?:NaN|nan|inf|Infinity)\b", shown)


def test_the_losses_of_topics_of_other_nodes_are_listed(tmp_path: Path) -> None:
    ledger = {
        "/own": Entry(received=1111),
        "/burst": Entry(received=3000, lost=7, lost_before=386, numbered=True),
        "/unnumbered": Entry(received=5, lost_before=2, numbered=False),
    }
    page = page_of(replace(periodic_trace(["c0"], 5), ledger=ledger), tmp_path)
    rows = re.findall(r"<tr>(<td[^>]*>/.*?)</tr>", page)
    cells = [re.sub(r"<[^>]+>", "|", row).split("||") for row in rows]
    assert [[cell.strip("|") for cell in row] for row in cells] == [
        ["/burst", "3,000", "386", "7"],
        ["/unnumbered", "5", "2 reported, more not known", "0"],
    ]


@pytest.mark.skipif(shutil.which("dot") is None, reason="no Graphviz")
def test_the_architecture_has_loads_and_ports(tmp_path: Path):
    trace = replace(periodic_trace(["c0", "c1"], 5), architecture=architecture(3))
    page = page_of(trace, tmp_path)
    begin = page.index('<svg class="mauve-graph"')
    drawing = page[begin : page.index("</svg>", begin)]
    texts = re.findall("<text[^>]*>([^<]*)</text>", drawing)
    assert {"c0", "c1", "c2", "data0", "map", "out", "CPU 0, 1"} <= set(texts)
    assert sum(text.startswith("load ") for text in texts) == 3
    assert 'data-tip="c0.out (write), data0.write, p/T"' in drawing
    assert ".mauve-graph .node.component" in page
    assert "--panel: light-dark(" in page


def test_without_graphviz_the_page_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    page = page_of(eventful_trace(), tmp_path)
    assert "<h2>Architecture</h2>" in page
    assert "No graph: `dot` of Graphviz is not installed. Install it: apt-get install graphviz" in page


def test_a_sporadic_component_is_named_so(tmp_path: Path):
    source = SyntheticSource(["events"])
    deploy(source, "events", period_ns=0)
    pending = run(source, "events", 5)
    swap(source, "events", pending)
    run(source, "events", 5, begin_ns=pending)
    page = page_of(trace_of(source), tmp_path)
    assert "sporadic" in page
    assert "It is triggered by events: it has no grid to miss" in page


def test_sections_of_others_stand_in_front(tmp_path: Path):
    page = page_of(periodic_trace(), tmp_path, extra=[Section("The map", "<p>here</p>", anchor="map")])
    assert page.index("<h2>The map</h2>") < page.index("<h2>Timeline</h2>")
    assert '<a href="#map">The map</a>' in page


def test_a_long_trace_stays_small(tmp_path: Path):
    trace = long_trace(["a", "b", "c", "d"], 8_000, late=[4_000])  # a fifth of a million records
    fixed = len(page_of(periodic_trace(["a", "b", "c", "d"], 5), tmp_path))
    assert len(page_of(trace, tmp_path)) - fixed < 20e6 / 5
    assert len(page_of(trace, tmp_path, budget=10_000)) - fixed < 0.3e6


def test_the_command_writes_into_the_bag_unless_told_otherwise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    for name in ("one", "two"):
        source = SyntheticSource(["c"])
        deploy(source, "c")
        run(source, "c", 5)
        recorder = Recorder(source, tmp_path / name, node_name="/robot/executor")
        recorder.start()
        recorder.stop()
    one, two = str(tmp_path / "one"), str(tmp_path / "two")
    assert main(["report", one]) == 0
    assert capsys.readouterr().out.startswith(f"{one}/report.html (0.")
    assert "Trace of one" in (tmp_path / "one" / "report.html").read_text(encoding="utf-8")
    both = tmp_path / "both.html"
    assert main(["report", one, two, "--out", str(both), "--title", "Both"]) == 0
    page = both.read_text(encoding="utf-8")
    assert "<title>Both</title>" in page
    assert "one/c" in page
    assert "two/c" in page


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["nowhere"], "not there"),
        (["", ""], "named twice"),
        (["", "--out", "no/such/folder/page.html"], "cannot be written (No such file or directory)"),
    ],
)
def test_the_command_says_what_is_wrong(
    words: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    recorder = Recorder(SyntheticSource(["c"]), tmp_path / "bag", node_name="/robot/executor")
    recorder.start()
    recorder.stop()
    assert main(["report", *(word or str(tmp_path / "bag") for word in words)]) == 2
    assert told in capsys.readouterr().err


def event(topic: str, time_ns: int, component: str, by: str) -> Message:
    step = SimpleNamespace(step="", component=component, prepare_ns=7, blackout_ns=-1)
    told = SimpleNamespace(success=True, requested_by=by, cause="", report=[step])
    return Message(topic, 0, time_ns, told)


def test_a_request_is_that_of_the_same_executor():
    trace = merge_traces({"r1": eventful_trace(), "r2": eventful_trace()})
    swaps = analyse(trace).swaps
    late_ns = swaps[0].measured.armed_ns + 1
    events = [event(f"/{robot}/executor/events", late_ns, "c", robot) for robot in ("r2", "r1")]
    found = analyse(trace, events=events).swaps
    assert [(one.measured.component, one.request and one.request.requested_by) for one in found] == [
        ("r1/c", "r1"),
        ("r2/c", "r2"),
    ]
    strange = [event("/elsewhere/events", late_ns, "c", "somebody")]
    assert {one.request and one.request.requested_by for one in analyse(trace, events=strange).swaps} == {
        "somebody"
    }
    assert {one.request for one in analyse(trace, events=strange * 2).swaps} == {None}


def test_bags_are_named_by_what_tells_them_apart():
    assert bag_names([Path("/out/bag/robot_1"), Path("/out/bag/robot_2")]) == ["robot_1", "robot_2"]
    assert bag_names([Path("/a/bag"), Path("/b/bag")]) == ["a_bag", "b_bag"]
    assert bag_names([Path("/a/x_0.mcap")]) == ["x_0"]
