"""What a bag tells rules, and what they would have done on that day."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Float64
from synthetic_traces import EPOCH_NS, MS, PERIOD_NS, ROOT, deploy, overrun, record, run, swap
from trace_decisions import REALTIME_OFFSET_NS

import mauve_rt.trace
from mauve_rt._kernel import RuleEngine
from mauve_rt.supervision.engine_rules import rule_specs
from mauve_rt.supervision.explanation import StoryEntry
from mauve_rt.supervision.recorded_signals import RecordedSignals
from mauve_rt.supervision.replay import Acted, compared, replayed
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.synthetic import SyntheticSource

UNDO = "undo: {do: [{kind: replace_core, target: c, name: p/A}]}"
RulesOf = Callable[..., RulesFile]


@pytest.fixture
def rules_of(tmp_path: Path) -> RulesOf:
    """rules_of(when, ...): a rule each, named r0, r1, ..., that replaces the core of c and undoes it.

    `more` of each rule, or of all.
    """

    def make(*whens: str, more: str | tuple[str, ...] = UNDO) -> RulesFile:
        text = "mauve: 1\nrules:\n"
        each = (more,) * len(whens) if isinstance(more, str) else more
        for index, (when, its) in enumerate(zip(whens, each, strict=True)):
            text += f"  - name: r{index}\n    when: {{{when}}}\n    {its}\n"
            text += "    do: [{kind: replace_core, target: c, name: p/B}]\n"
        (tmp_path / "rules.yaml").write_text(text, encoding="utf-8")
        return RulesFile(tmp_path / "rules.yaml")

    return make


@pytest.fixture(autouse=True)
def installed_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "mauve_msgs" / "msg", tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))


def bag(
    folder: Path, befalls: Callable[[SyntheticSource], object], topics: Mapping[str, list[Any]] = {}
) -> Trace:
    """A bag of component c, deployed and started at 19 ms; `topics`: (ms, message) each."""
    source = SyntheticSource(["c"], realtime_offset_ns=REALTIME_OFFSET_NS)
    deploy(source, "c")
    befalls(source)
    trace = mauve_rt.trace.open(record(source, folder))
    messages = [
        Message(topic, at_ms * MS + REALTIME_OFFSET_NS, at_ms * MS, told)
        for topic, all_told in topics.items()
        for at_ms, told in all_told
    ]
    known = {topic: ("some_msgs/msg/Some", len(told)) for topic, told in topics.items()}
    return replace(
        trace,
        topics={**trace.topics, **known},
        message_source=lambda of: (one for one in messages if one.topic in of),
    )


def runs(cycles: int) -> Callable[[SyntheticSource], object]:
    return lambda source: run(source, "c", cycles)


def acts(rules: RulesFile, trace: Trace, story: list[StoryEntry] | None = None) -> list[tuple[float, str]]:
    """What is done, and when in ms."""
    return [(one.time_ns / MS, one.act) for one in replayed(rules, trace, story or [])]


def test_silence_of_a_topic_is_acted_on_and_undone(rules_of: RulesOf, tmp_path: Path) -> None:
    heard = [(at_ms, None) for at_ms in (50, 100, 150, 600, 650)]
    trace = bag(tmp_path / "bag", runs(70), {"/radio/in": heard})
    rules = rules_of("silence: {topic: radio/in, type: p/msg/T, longer_than_s: 0.2}")
    assert RecordedSignals(trace).missing(rules.rules.rules[0]) == []
    assert acts(rules, trace) == [(350.000001, "do"), (600, "undo")]


def test_values_of_a_field_are_held_against_a_bound(rules_of: RulesOf, tmp_path: Path) -> None:
    level = [
        (100, Float64(data=0.5)),
        (200, Float64(data=0.1)),
        (300, Float64(data=0.6)),
    ]
    trace = bag(tmp_path / "bag", runs(70), {"/battery": level})
    rules = rules_of("value: {topic: battery, type: p/msg/T, field: data, below: 0.2}")
    assert acts(rules, trace) == [(200, "do"), (300, "undo")]


def test_a_component_that_is_not_released_any_more(rules_of: RulesOf, tmp_path: Path) -> None:
    def befalls(source: SyntheticSource) -> None:
        run(source, "c", 10)
        run(source, "c", 10, begin_ns=EPOCH_NS + 20 * PERIOD_NS)

    trace = bag(tmp_path / "bag", befalls)
    (at, act), (again, undo) = acts(rules_of("no_release: {component: c, periods: 3}"), trace)
    last = EPOCH_NS + 9 * PERIOD_NS
    assert (act, undo) == ("do", "undo")
    assert at * MS == pytest.approx(last + 3 * PERIOD_NS, abs=0.02 * MS)
    assert again * MS == pytest.approx(EPOCH_NS + 20 * PERIOD_NS, abs=0.02 * MS)


def test_overruns_are_counted(rules_of: RulesOf, tmp_path: Path) -> None:
    def befalls(source: SyntheticSource) -> None:
        pending = overrun(source, "c", run(source, "c", 5))
        run(source, "c", 5, begin_ns=overrun(source, "c", pending))

    rules = rules_of("overruns: {component: c, at_least: 2, within_s: 1.0}", more="")
    trace = bag(tmp_path / "bag", befalls)
    first, second = (int(row["b"]) for row in trace.of("c", Kind.OVERRUN))
    assert first < second
    assert acts(rules, trace) == [(second / MS, "do")]


def test_a_fault_is_a_state_and_ends_the_watch(rules_of: RulesOf, tmp_path: Path) -> None:
    def befalls(source: SyntheticSource) -> None:
        source.add("c", Kind.FAULT, run(source, "c", 5), name="act")
        source.add("c", Kind.START, 200 * MS, a=200 * MS)

    trace = bag(tmp_path / "bag", befalls)
    assert RecordedSignals(trace).states("c") == [(0, 0.0), (19 * MS, 2.0), (70 * MS, 5.0), (200 * MS, 2.0)]
    (rule,) = rules_of("fault: {component: c}").rules.rules
    assert RecordedSignals(trace).presence(rule) == [(19 * MS, True), (70 * MS, False), (200 * MS, True)]


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_another_component_s_fault_is_acted_on(rules_of: RulesOf, tmp_path: Path, where: str) -> None:
    source = SyntheticSource(["c", "d"], realtime_offset_ns=REALTIME_OFFSET_NS)
    deploy(source, "c")
    deploy(source, "d")
    run(source, "c", 70)
    source.add("d", Kind.FAULT, run(source, "d", 5), name="act")
    trace = mauve_rt.trace.open(record(source, tmp_path / "bag"))
    rules = rules_of("fault: {component: d}", more=f"{UNDO}\n    in: {where}")
    assert acts(rules, trace) == [(70, "do")]


def test_a_component_that_ran_when_the_bag_began_is_watched_from_then_on(
    rules_of: RulesOf, tmp_path: Path
) -> None:
    source = SyntheticSource(["c"])
    run(source, "c", 20)
    trace = mauve_rt.trace.open(record(source, tmp_path / "bag"))
    (rule,) = rules_of("fault: {component: c}").rules.rules
    assert RecordedSignals(trace).presence(rule) == [(trace.span_ns[0], True)]


def test_changes_are_commits_of_a_component_and_all_turns_of_the_architecture(
    rules_of: RulesOf, tmp_path: Path
) -> None:
    def befalls(source: SyntheticSource) -> None:
        pending = run(source, "c", 5)
        swap(source, "c", pending)
        source.add("c", Kind.ARMED, pending, name="wait", a=pending, b=0)
        run(source, "c", 20, begin_ns=pending)

    trace = bag(tmp_path / "bag", befalls)
    rules = rules_of("since_change: {component: c, longer_than_s: 0.1}", "since_change: {longer_than_s: 0.1}")
    signals = RuleEngine(rule_specs(rules.rules.rules)).signals
    told = RecordedSignals(trace).told(signals)
    committed_ns = 70 * MS - PERIOD_NS // 2 + 20_000
    assert [one.time_ns for one in told if one.signal == 0] == [committed_ns]
    assert [one.time_ns for one in told if one.signal == 1] == [19 * MS, committed_ns]


def test_the_level_of_a_diagnostic_where_it_is_recorded(rules_of: RulesOf, tmp_path: Path) -> None:
    def told(level: bytes) -> DiagnosticArray:
        other = DiagnosticStatus(name="other", level=b"\2")
        return DiagnosticArray(status=[other, DiagnosticStatus(name="motor", level=level)])

    rules = rules_of("diagnostic: {status: motor, level: ERROR}", more="in: supervisor")
    trace = bag(tmp_path / "bag", runs(70), {"/diagnostics": [(100, told(b"\0")), (200, told(b"\2"))]})
    assert acts(rules, trace) == [(200, "do")]
    assert RecordedSignals(bag(tmp_path / "other", runs(5))).missing(rules.rules.rules[0]) == [
        "topic /diagnostics"
    ]


@pytest.mark.parametrize(
    ("when", "missing"),
    [
        ("silence: {topic: radio/in, type: p/msg/T, longer_than_s: 1}", "topic /radio/in"),
        ("silence: {resource: scan, longer_than_s: 1}", "writes of resource scan"),
        ("value: {resource: c, field: x, below: 1}", "field x of resource c"),
        (
            "late: {component: c, what: wake_up, longer_than_s: 0.001}",
            "how late wake-ups and responses of c were",
        ),
        ("over_declared: {component: c}", "which executions of c lasted longer than declared"),
        ("fault: {component: d}", "component d"),
        ("node_silent: {}", "whether Python worked"),
        (
            "action: {resource: drive, is: aborted}",
            "states of the goals of resource drive: no record has them",
        ),
        ("no_release: {component: e, periods: 3}", "a period of component e"),
    ],
)
def test_what_a_bag_cannot_tell(rules_of: RulesOf, tmp_path: Path, when: str, missing: str) -> None:
    source = SyntheticSource(["c", "e"])
    deploy(source, "c")
    deploy(source, "e", period_ns=0)
    (rule,) = rules_of(when).rules.rules
    assert RecordedSignals(mauve_rt.trace.open(record(source, tmp_path / "bag"))).missing(rule) == [missing]


def test_a_rule_about_a_component_that_is_not_in_the_bag(rules_of: RulesOf, tmp_path: Path) -> None:
    source = SyntheticSource(["d"])
    deploy(source, "d")
    trace = mauve_rt.trace.open(record(source, tmp_path / "bag"))
    (rule,) = rules_of("fault: {component: d}").rules.rules
    assert RecordedSignals(trace).missing(rule) == ["component c"]


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_what_was_in_effect_when_it_was_armed_is_undone(
    rules_of: RulesOf, tmp_path: Path, where: str
) -> None:
    trace = bag(tmp_path / "bag", runs(70), {"/radio/in": [(500, None)]})
    when = "silence: {topic: radio/in, type: p/msg/T, longer_than_s: 9}"
    rules = rules_of(when, more=f"{UNDO}\n    in: {where}")
    adopted = StoryEntry(20 * MS, "/executor", "r0", "adopted", "", "", "")
    assert acts(rules, trace) == []
    assert acts(rules, trace, [adopted]) == [(500, "undo")]


def test_an_executor_s_rules_are_not_outranked_by_a_supervisor_s(rules_of: RulesOf, tmp_path: Path) -> None:
    trace = bag(tmp_path / "bag", runs(70), {"/radio/in": [(50, None)]})
    when = "silence: {topic: radio/in, type: p/msg/T, longer_than_s: 0.1}"
    above, supervisor_s = "priority: 1", "priority: 1\n    in: supervisor"
    assert len(acts(rules_of(when, when, more=("", above)), trace)) == 1
    assert len(acts(rules_of(when, when, more=("", supervisor_s)), trace)) == 2


def test_actions_are_compared_rule_by_rule(rules_of: RulesOf) -> None:
    rules = rules_of("fault: {component: c}", "fault: {component: c}").rules.rules
    then = [Acted(100 * MS, "r0", "do"), Acted(500 * MS, "r0", "undo"), Acted(900 * MS, "r1", "do")]
    now = [Acted(150 * MS, "r0", "do"), Acted(700 * MS, "r0", "undo")]
    found = [
        (one.rule, one.act, one.then_ns, one.replayed_ns, one.matches) for one in compared(rules, then, now)
    ]
    assert found == [
        ("r0", "do", 100 * MS, 150 * MS, True),
        ("r0", "undo", 500 * MS, 700 * MS, False),
        ("r1", "do", 900 * MS, None, False),
    ]


def test_actions_that_were_not_done_then_do_not_shift_the_others(rules_of: RulesOf) -> None:
    rules = rules_of("fault: {component: c}").rules.rules
    then = [Acted(500 * MS, "r0", "do")]
    now = [Acted(100 * MS, "r0", "do"), Acted(300 * MS, "r0", "undo"), Acted(510 * MS, "r0", "do")]
    found = [(one.then_ns, one.replayed_ns, one.matches) for one in compared(rules, then, now)]
    assert found == [(None, 100 * MS, False), (None, 300 * MS, False), (500 * MS, 510 * MS, True)]
