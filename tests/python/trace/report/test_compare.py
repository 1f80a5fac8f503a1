"""Two runs compared: equal runs have no mark, a real difference has one, and page and terminal agree."""

import json
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from html import unescape
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from headless_browser import Browser, started_browser
from rich.console import Console
from synthetic_traces import (
    EPOCH_NS,
    MS,
    PERIOD_NS,
    ROOT,
    deploy,
    long_trace,
    record_small_bag,
    run,
    swap,
    trace_of,
)
from trace_decisions import said

from mauve_rt.cli.compare import comparison_values, comparison_view, plain
from mauve_rt.cli.main import main
from mauve_rt.cli.tables import print_tables
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.decisions import DECISION_TYPE
from mauve_rt.trace.reading.facts import Message, TracedDecision
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.report.runs.compared import ComparedRuns, compare_runs, only_in_one
from mauve_rt.trace.report.runs.events import EVENT_TYPE, Act, CoreChange
from mauve_rt.trace.report.runs.page import write_comparison
from mauve_rt.trace.report.runs.tables import all_views
from mauve_rt.trace.report.runs.words import verdict_on

CYCLES = 1_600
SAMPLE = str(ROOT / "docs" / "sample" / "metronome")
LOAD = 0.3


def pair(
    seed: int, components: tuple[str, ...] = ("c",), *, cycles: int = CYCLES, **of_b: object
) -> tuple[Trace, Trace]:
    """Two runs of the same distributions; autocorrelated. `of_b`: how B differs."""
    a = long_trace(components, cycles, seed=2 * seed + 1, load=LOAD)
    return a, long_trace(components, cycles, seed=2 * seed + 2, load=LOAD, **of_b)  # type: ignore[arg-type]


# ---- the noise


def test_equal_runs_are_marked_on_few_pages() -> None:
    pairs = 100
    marked = sum(bool(compare_runs(*pair(seed, cycles=1_000)).differing) for seed in range(pairs))
    # 5 % of 100 are 5; more than 12 come with a chance of 0.2 % where the rate is 5 %
    assert marked <= 12


def test_a_slower_component_is_marked_and_only_this_one() -> None:
    found = compare_runs(*pair(0, ("fast", "slow"), slower={"slow": 1.5}))
    marked = {(one.subject, one.name) for one in found.differing}
    assert {subject for subject, _ in marked} == {"slow"}
    assert {
        ("slow", "response time p50"),
        ("slow", "execution of sense p50"),
        ("slow", "execution of act p50"),
    } <= marked
    (median,) = (one for one in found.differing if one.name == "execution of act p50")
    assert median.judged is not None
    assert median.judged.low < 1.5 < median.judged.high
    headline = verdict_on(found).headline
    assert headline.startswith(f"B differs from A in {len(marked)} figures by more than chance: slow's ")
    assert re.search(r"is 1\.\d+ \N{MULTIPLICATION SIGN} \[1\.\d+, \d\.\d+\] of A's", headline)


def test_an_added_overrun_rate_is_marked() -> None:
    found = compare_runs(*pair(1, late=range(20, CYCLES, 40)))
    (overruns,) = (one for one in found.timing if one.name == "overruns")
    assert (overruns.a, overruns.b, overruns.differs) == (0, 40, True)
    assert overruns.judged is not None
    assert overruns.judged.value == math.inf
    assert overruns.judged.low > 3
    assert "c: overruns: 0 in A, 40 in B." in [one.text for one in verdict_on(found).sentences] + [
        verdict_on(found).headline.rpartition("chance: ")[2]
    ]


def test_a_burst_of_overruns_counts_as_one() -> None:
    found = compare_runs(*pair(1, late=range(800, 840)))
    (overruns,) = (one for one in found.timing if one.name == "overruns")
    assert (overruns.b, overruns.differs) == (40, False)


def test_two_overruns_are_no_difference() -> None:
    found = compare_runs(*pair(1, late=[100, 900]))
    (overruns,) = (one for one in found.timing if one.name == "overruns")
    assert (overruns.a, overruns.b, overruns.differs) == (0, 2, False)


def test_a_maximum_has_no_mark() -> None:
    a, b = pair(0)
    rows = b.records["c"]
    (releases,) = np.nonzero(rows["kind"] == Kind.RELEASE)
    rows["b"][releases[700]] += PERIOD_NS // 2
    found = compare_runs(a, b)
    (largest,) = (one for one in found.timing if one.name == "wake-up latency max")
    assert largest.b > PERIOD_NS // 2 > 5 * largest.a
    assert (largest.differs, largest.remark) == (False, "a single value")


def test_another_load_is_a_difference() -> None:
    a, b = pair(0)
    loaded = long_trace(["c"], CYCLES, seed=2, load=LOAD, slower={"c": 1.3})
    assert compare_runs(a, loaded).differing
    assert not compare_runs(a, b).differing


# ---- decisions and reconfigurations


def acting(trace: Trace, *acts: tuple[int, str, str]) -> Trace:
    """Make rules act: time in ms, rule, decision; each 2 ms after its cause."""
    decisions = tuple(TracedDecision(at * MS, rule, what, (at - 2) * MS, "") for at, rule, what in acts)
    return replace(trace, decisions=decisions)


def test_a_rule_that_acted_only_in_b_is_listed() -> None:
    a, b = pair(2)
    both = [(100, "slow_down", "do"), (200, "slow_down", "undo")]
    found = compare_runs(acting(a, *both), acting(b, *both, (150, "lidar_lost", "do")))
    assert ("B", "an act of rule lidar_lost") in set(only_in_one(found))
    rows = {
        row.cells[0]: row.cells
        for view in all_views(found)
        if view.heading == "Decisions"
        for row in view.rows
    }
    assert [plain(cell) for cell in rows["slow_down"]] == [
        *("slow_down", "2", "2", "1.", "1."),
        *("2 ms", "2 ms", "2 ms", "2 ms", "-"),
    ]
    assert [plain(cell) for cell in rows["lidar_lost"]][-1] == "B"
    (note,) = (view.note for view in all_views(found) if view.heading == "Decisions")
    assert "differs from act 2 on: “slow_down: undo” in A, “lidar_lost: do” in B." in note.replace("\n", " ")
    assert "Only in B: an act of rule lidar_lost." in [one.text for one in verdict_on(found).sentences]


def swapped(blackout_ns: int) -> Trace:
    source = SyntheticSource(["c"])
    deploy(source, "c")
    pending = run(source, "c", 20)
    if blackout_ns:
        swap(source, "c", pending, blackout_ns=blackout_ns)
    run(source, "c", 20, begin_ns=pending)
    return trace_of(source)


def test_reconfigurations_are_compared_by_what_they_changed() -> None:
    found = compare_runs(swapped(20_000), swapped(30_000))
    (view,) = (view for view in all_views(found) if view.heading == "Reconfigurations")
    (row,) = view.rows
    assert [plain(cell) for cell in row.cells] == [
        *("c", "-", "replace_core pkg/New", "1", "1"),
        *("20 us", "20 us", "30 us", "30 us", "0", "0", "-"),
    ]
    assert list(only_in_one(compare_runs(swapped(0), swapped(30_000)))) == [
        ("B", "reconfiguration of c to replace_core pkg/New")
    ]


def of_topics(trace: Trace, *messages: Message, types: dict[str, str]) -> Trace:
    """Add messages; `types` of their topics."""

    def source(topics: tuple[str, ...]) -> Iterator[Message]:
        return (one for one in messages if {one.topic, types[one.topic]} & set(topics))

    return replace(trace, topics={topic: (kind, 1) for topic, kind in types.items()}, message_source=source)


def test_the_acts_of_a_supervisor_are_those_of_its_messages() -> None:
    types = {"/supervisor/decisions": DECISION_TYPE}
    messages = (
        said(50, "condition_true", "", topic="/supervisor/decisions"),
        said(51, "do", "", act="do", topic="/supervisor/decisions"),
        said(60, "done", "", act="do", took_s=0.011, topic="/supervisor/decisions"),
    )
    a, b = pair(2)
    found = compare_runs(a, of_topics(b, *messages, types=types))
    assert found.acts == ([], [Act(53 * MS, "lidar_lost (/supervisor)", "do", 11 * MS)])
    (note,) = (view.note for view in all_views(found) if view.heading == "Decisions")
    assert "from act 1 on: no act in A, “lidar_lost (/supervisor): do” in B." in note


def test_a_reconfiguration_is_named_by_its_cores_where_the_bag_names_them() -> None:
    trace = swapped(20_000)
    (measured,) = reconfigurations(trace)
    cores = {"from_core": "pkg/Old", "to_core": "pkg/New"}
    step = SimpleNamespace(
        step="replace_core", component="c", prepare_ns=7, blackout_ns=measured.blackout_ns, **cores
    )
    event = SimpleNamespace(success=True, requested_by="", cause="", report=[step])
    types = {"/executor/events": EVENT_TYPE}
    told = of_topics(trace, Message("/executor/events", 0, measured.armed_ns + MS, event), types=types)
    found = compare_runs(told, told)
    assert found.changes() == [CoreChange("c", "pkg/Old", "pkg/New")]
    (view,) = (view for view in all_views(found) if view.heading == "Reconfigurations")
    assert view.rows[0].cells[:5] == ("c", "Old", "New", "1", "1")


# ---- values


@dataclass
class Stamp:
    sec: int
    nanosec: int


@dataclass
class Reading:
    stamp: Stamp
    data: float
    pair: np.ndarray
    long: np.ndarray
    text: str


def with_values(trace: Trace, values: np.ndarray, topic: str = "/speed") -> Trace:
    """Add a topic with a value a cycle; every tenth second element is NaN."""
    messages = [
        Message(
            topic,
            0,
            EPOCH_NS + index * PERIOD_NS,
            Reading(
                Stamp(index, 0), value, np.array([1.0, np.nan if index % 10 == 0 else 2.0]), np.zeros(99), "x"
            ),
        )
        for index, value in enumerate(values.tolist())
    ]

    def source(topics: tuple[str, ...]) -> Iterator[Message]:
        return (message for message in messages if message.topic in topics)

    return replace(trace, topics={topic: ("pkg/msg/Reading", len(messages))}, message_source=source)


def test_a_value_with_an_offset_is_marked() -> None:
    a, b = pair(3)
    noise = np.random.default_rng(6)
    speeds = [np.convolve(noise.normal(size=1_049), np.full(50, 50**-0.5), "valid") for _ in range(3)]
    found = compare_runs(with_values(a, speeds[0]), with_values(b, speeds[1] + 2))
    names = [one.field.name for one in found.values.fields]
    assert names == ["data", "pair[0]", "pair[1]"]
    assert [one.differs for one in found.values.fields] == [True, False, False]
    assert found.values.fields[2].a.nan_share == pytest.approx(0.1)
    equal = compare_runs(with_values(a, speeds[0]), with_values(b, speeds[2]))
    assert not any(one.differs for one in equal.values.fields)
    alone = compare_runs(with_values(a, speeds[0]), with_values(b, speeds[0], "/other"))
    assert set(only_in_one(alone)) == {("A", "topic /speed"), ("B", "topic /other")}


def test_fields_beyond_the_most_are_left_out_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mauve_rt.trace.report.runs.values.MOST_FIELDS", 2)
    a, b = pair(3)
    found = compare_runs(with_values(a, np.ones(50)), with_values(b, np.ones(50)))
    assert len(found.values.fields) == 2
    assert found.values.left_out == ["1 more fields are left out (of /speed)."]


def test_a_topic_that_cannot_be_read_is_left_out_and_the_others_are_compared() -> None:
    a, b = pair(3)
    readable = with_values(b, np.ones(50))

    def source(topics: tuple[str, ...]) -> Iterator[Message]:
        if "/broken" in topics:
            raise TraceError("the definition cannot be read")
        return readable.messages(*topics)

    topics = {"/broken": ("pkg/msg/Broken", 3), **readable.topics}
    broken = replace(readable, topics=topics, message_source=source)
    other = replace(with_values(a, np.ones(50)), topics=topics)
    found = compare_runs(other, broken)
    assert {one.field.topic for one in found.values.fields} == {"/speed"}
    assert found.values.left_out == ["/broken is left out: the definition cannot be read"]


def simulated(cycles: int) -> Trace:
    source = SyntheticSource(["c"])
    deploy(source, "c")
    instant = EPOCH_NS
    for _ in range(cycles):
        instant = source.cycle("c", instant, states={"work": 100}, wait_ns=PERIOD_NS)
    return trace_of(source)


def test_in_simulated_time_a_single_sample_that_differs_is_told() -> None:
    trace = simulated(40)
    values = np.arange(40.0)
    other = values.copy()
    other[7] += 0.25
    found = compare_runs(with_values(trace, values), with_values(trace, other))
    assert found.simulated
    assert found.values.fields[0].largest_difference == 0.25
    assert found.values.fields[0].differs
    assert verdict_on(found).headline.startswith("No timing differs by more than chance, but values differ")
    same = compare_runs(with_values(trace, values), with_values(trace, values))
    assert verdict_on(same).headline == "No figure differs by more than chance."
    assert not any(one.differs for one in same.values.fields)


# ---- page, terminal, command


@pytest.fixture(scope="module")
def different() -> ComparedRuns:
    """Runs that differ in everything that is shown."""
    a, b = pair(7, ("control", "guidance"), slower={"control": 1.5}, late=range(20, CYCLES, 40))
    noise = np.random.default_rng(8)
    a = with_values(acting(a, (100, "slow_down", "do")), noise.normal(size=1_600))
    b = with_values(
        acting(b, (100, "slow_down", "do"), (200, "lidar_lost", "do")), noise.normal(5, size=1_600)
    )
    swaps = [swapped(20_000), swapped(30_000)]
    merged = [
        replace(
            one,
            records={**one.records, "c": _renamed(extra, one)},
            losses={**one.losses, **extra.losses},
            names=(*one.names, *extra.names),
        )
        for one, extra in zip((a, b), swaps, strict=True)
    ]
    return compare_runs(*merged, names=("monday <1>", "tuesday"))


def _renamed(extra: Trace, one: Trace) -> np.ndarray:
    rows = extra.records["c"].copy()
    rows["name"] += len(one.names)
    return rows


@pytest.fixture(scope="module")
def page(different: ComparedRuns, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "comparison.html"
    write_comparison(path, different, title="tuesday (B) compared with monday <1> (A)")
    return path


def rows_of_page(text: str) -> list[list[str]]:
    rows = re.findall(r"<tr>(<td.*?)</tr>", text, re.DOTALL)
    return [
        [plain(unescape(re.sub("<[^>]*>", "", cell))) for cell in re.findall(r"<td.*?</td>", row)]
        for row in rows
    ]


def test_terminal_and_page_agree(different: ComparedRuns, page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    out = Console(file=StringIO(), width=300, highlight=False)
    print_tables(comparison_view(different), out)
    shown = out.file.getvalue()  # type: ignore[attr-defined]
    assert plain(verdict_on(different).headline) in shown
    lines = [re.split(r"\s{2,}", line.strip()) for line in shown.splitlines()]
    rows = rows_of_page(text)
    assert len(rows) == sum(len(view.rows) for view in all_views(different))
    flat = [" ".join(" ".join(line).split()) for line in lines]
    assert [row for row in rows if " ".join(" ".join(row).split()) not in flat] == []
    assert "monday &lt;1&gt;" in text
    assert "monday <1>" in shown
    assert text.count("data-histogram=") >= 3
    assert 'class="curve after"' in text


def test_json_has_each_figure_and_nothing_that_json_lacks(different: ComparedRuns) -> None:
    told = json.loads(json.dumps(comparison_values(different), allow_nan=False))
    assert len(told["figures"]) == len(different.figures)
    (overruns,) = (
        one for one in told["figures"] if (one["subject"], one["measure"]) == ("control", "overruns")
    )
    assert (overruns["a"], overruns["b"], overruns["differs"]) == (0, 40, True)
    assert overruns["change"]["kind"] == "ratio"
    assert overruns["change"]["value"] is None  # infinite
    assert {"run": "B", "what": "an act of rule lidar_lost"} in told["only_in"]


def test_the_command_compares_a_bag_with_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "comparison.html"
    assert main(["report", SAMPLE, SAMPLE, "--compare", "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "No figure differs by more than chance." in shown
    assert " yes" not in shown
    assert f"{out} (0." in shown
    assert main(["report", SAMPLE, SAMPLE, "--compare", "--json", "--out", str(out)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["tested"] > 0
    assert not any(one["differs"] for one in (*told["figures"], *told["values"]))
    assert told["only_in"] == []


def test_the_page_is_in_the_first_folder_unless_told_otherwise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one, two = (str(record_small_bag(tmp_path / name)) for name in ("one", "two"))
    assert main(["report", one, two, "--compare"]) == 0
    assert "No difference is proved: the runs are too short to tell." in capsys.readouterr().out
    first = (tmp_path / "one" / "comparison.html").read_bytes()
    assert main(["report", one, two, "--compare"]) == 0
    assert (tmp_path / "one" / "comparison.html").read_bytes() == first  # resampled by the same seeds


def test_a_run_may_be_a_folder_of_bags(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for day in ("monday", "tuesday"):
        for robot in ("robot_1", "robot_2"):
            (tmp_path / day).mkdir(exist_ok=True)
            record_small_bag(tmp_path / day / robot)
    assert main(["report", str(tmp_path / "monday"), str(tmp_path / "tuesday"), "--compare", "--json"]) == 0
    subjects = {one["subject"] for one in json.loads(capsys.readouterr().out)["figures"]}
    assert subjects == {"robot_1/a", "robot_2/a"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["a", "--compare"], "expected two runs, A and B, found 1 argument. Name two bags"),
        (["a", "a", "a", "--compare"], "expected two runs, A and B, found 3 arguments. Name two bags"),
        (["a", "nowhere", "--compare"], "not there"),
        (
            ["a", "a", "--compare", "--out", "no/such/page.html"],
            "cannot be written (No such file or directory)",
        ),
        (["a", "--json"], "--json prints a comparison. Add --compare."),
    ],
)
def test_the_command_says_what_is_wrong(
    words: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    record_small_bag(tmp_path / "a")
    monkeypatch.chdir(tmp_path)
    assert main(["report", *words]) == 2
    assert told in capsys.readouterr().err


def test_runs_without_a_common_component_are_refused() -> None:
    with pytest.raises(TraceError, match="no component is in both runs: A has c and d; B has e") as error:
        compare_runs(long_trace(["c", "d"], 5), long_trace(["e"], 5))
    assert "Compare two runs of one architecture." in str(error.value)


def test_components_and_states_of_one_run_are_listed() -> None:
    source = SyntheticSource(["c"])
    deploy(source, "c")
    source.cycle("c", EPOCH_NS, states={"plan": 5}, wait_ns=PERIOD_NS)
    source.add("c", Kind.FAULT, EPOCH_NS + MS, name="plan")
    found = compare_runs(long_trace(["c", "d"], 5), trace_of(source))
    assert list(only_in_one(found)) == [
        ("A", "d"),
        ("A", "execution of sense in c"),
        ("A", "execution of act in c"),
        ("B", "execution of plan in c"),
        ("B", "a fault of c"),
    ]


# ---- in a browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    yield from started_browser(size=(400, 800))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1200])
def test_the_page_works_at_each_width_and_needs_nothing_else(
    browser: Browser, page: Path, scheme: str, width: int
) -> None:
    browser.complaints.clear()
    browser.requests.clear()
    browser.resize(width, 800)
    browser.scheme(scheme)
    browser.open(page)
    assert browser.evaluate("document.documentElement.dataset.ready") == "yes"
    assert browser.evaluate("document.documentElement.scrollWidth") == width
    assert browser.complaints == []
    assert [one for one in browser.requests if not one.startswith(("file:", "data:"))] == []
