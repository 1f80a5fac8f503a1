"""`mauve trace check` finds split changes: releases on the wrong side of the change's instant T."""

from pathlib import Path

import numpy as np
import pytest
from synthetic_traces import EPOCH_NS, PERIOD_NS, deploy, long_trace, record, run, swap

from mauve_rt.cli.main import main
from mauve_rt.trace.format.records import RECORD, Kind, ReconfigurationPhase
from mauve_rt.trace.reading.check import Finding, check_bag
from mauve_rt.trace.reading.split_changes import SplitChange, split_changes
from mauve_rt.trace.recording.synthetic import SyntheticSource

CYCLES = 5


@pytest.fixture
def source() -> SyntheticSource:
    source = SyntheticSource(["other", "control"])
    for component in source.components:
        deploy(source, component)
    run(source, "other", 2 * CYCLES)
    return source


def _wrong(source: SyntheticSource, folder: Path) -> list[str]:
    return [finding.text for finding in check_bag(record(source, folder)) if finding.is_wrong]


def _notes(source: SyntheticSource, folder: Path) -> list[Finding]:
    return [finding for finding in check_bag(record(source, folder)) if "T of its changes" in finding.text]


def _take(source: SyntheticSource, pending_ns: int, instant_ns: int, *, word: str = "core") -> None:
    """A change of which the bag tells T, or 0."""
    for phase, told_ns in ((ReconfigurationPhase.ADOPT, 0), (ReconfigurationPhase.TAKE, instant_ns)):
        source.add("control", Kind.RECONFIGURATION, pending_ns - 100, name=word, a=phase, b=10, c=told_ns)


def test_a_change_between_the_releases_is_right(source: SyntheticSource, tmp_path: Path):
    pending_ns = run(source, "control", CYCLES)
    swap(source, "control", pending_ns)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    assert _wrong(source, tmp_path / "bag") == []


@pytest.mark.parametrize("instant_ns", [1 - PERIOD_NS, 0])
def test_a_release_at_t_is_the_first_new_one(source: SyntheticSource, tmp_path: Path, instant_ns: int):
    pending_ns = run(source, "control", CYCLES)
    _take(source, pending_ns, pending_ns + instant_ns)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    assert _wrong(source, tmp_path / "bag") == []


def test_a_release_before_t_after_the_take_is_wrong(source: SyntheticSource, tmp_path: Path):
    pending_ns = run(source, "control", CYCLES)
    _take(source, pending_ns, pending_ns + 1_500)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    (text,) = _wrong(source, tmp_path / "bag")
    assert text == (
        f"component 'control': the change at T = {pending_ns + 1_500} ns was split: "
        f"a release before T ran with new parts; found the release at {pending_ns} ns, 1,500 ns before T, "
        "expected releases with new parts at or after T only"
    )


@pytest.mark.parametrize(("late_ns", "where"), [(0, "at T"), (2_000, "2,000 ns after T")])
def test_a_release_at_or_after_t_before_the_take_is_wrong(
    source: SyntheticSource, tmp_path: Path, late_ns: int, where: str
):
    pending_ns = run(source, "control", CYCLES)
    last_ns = pending_ns - PERIOD_NS
    _take(source, pending_ns, last_ns - late_ns)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    (text,) = _wrong(source, tmp_path / "bag")
    assert text == (
        f"component 'control': the change at T = {last_ns - late_ns} ns was split: "
        f"a release at or after T ran with old parts; found the release at {last_ns} ns, {where}, "
        "expected releases with old parts before T only"
    )


def test_several_parts_of_one_change_are_found_once(source: SyntheticSource, tmp_path: Path):
    pending_ns = run(source, "control", CYCLES)
    for word in ("set_property gain", "replace_core p/B"):
        _take(source, pending_ns, pending_ns + 1, word=word)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    assert len(_wrong(source, tmp_path / "bag")) == 1


def test_of_two_changes_the_one_that_was_split_is_found(source: SyntheticSource, tmp_path: Path):
    first_ns = run(source, "control", CYCLES)
    _take(source, first_ns, first_ns)
    second_ns = run(source, "control", CYCLES, begin_ns=first_ns)
    _take(source, second_ns, second_ns)
    _take(source, second_ns, second_ns)  # before the next release, in the same wait
    third_ns = run(source, "control", CYCLES, begin_ns=second_ns)
    _take(source, third_ns, third_ns + 1)
    run(source, "control", CYCLES, begin_ns=third_ns)
    (text,) = _wrong(source, tmp_path / "bag")
    assert f"T = {third_ns + 1} ns" in text


def test_a_bag_of_before_is_not_checked_and_says_so(source: SyntheticSource, tmp_path: Path):
    pending_ns = run(source, "control", CYCLES)
    _take(source, pending_ns, 0)
    run(source, "control", CYCLES, begin_ns=pending_ns - PERIOD_NS)
    (note,) = _notes(source, tmp_path / "bag")
    assert (note.kind, note.is_wrong) == ("note", False)
    assert _wrong(source, tmp_path / "again") == []


def test_a_fallback_has_no_t(source: SyntheticSource, tmp_path: Path):
    pending_ns = run(source, "control", CYCLES)
    source.add("control", Kind.FAULT, pending_ns - 200, name="act", a=pending_ns)
    source.add("control", Kind.RECONFIGURATION, pending_ns - 100, name="core", a=ReconfigurationPhase.TAKE)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    findings = check_bag(record(source, tmp_path / "bag"))
    assert [finding for finding in findings if finding.is_wrong or "T of its changes" in finding.text] == []


def test_the_verb_says_wrong_and_fails(
    source: SyntheticSource, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    pending_ns = run(source, "control", CYCLES)
    _take(source, pending_ns, pending_ns + 1)
    run(source, "control", CYCLES, begin_ns=pending_ns)
    assert main(["trace", "check", str(record(source, tmp_path / "bag"))]) == 1
    shown = capsys.readouterr().out
    assert f"wrong: component 'control': the change at T = {pending_ns + 1} ns was split" in shown
    assert "no split change found" not in shown


def test_only_releases_and_takes_count():
    rows = np.zeros(3, RECORD)
    assert split_changes(rows) == []
    rows["kind"], rows["a"], rows["c"] = Kind.RECONFIGURATION, ReconfigurationPhase.TAKE, 7
    assert split_changes(rows) == [], "nothing was released"
    rows["kind"][2], rows["a"][2] = Kind.RELEASE, 6
    assert split_changes(rows) == [SplitChange(7, 6, is_new=True)]


def test_a_long_trace_is_checked_as_a_whole():
    rows = long_trace(("a",), 20_000).records["a"]
    (releases,) = np.nonzero(rows["kind"] == Kind.RELEASE)
    changes = np.zeros(len(releases), RECORD)
    changes["kind"], changes["a"] = Kind.RECONFIGURATION, ReconfigurationPhase.TAKE
    changes["c"] = rows["a"][releases]
    changes["c"][100] = EPOCH_NS + 99 * PERIOD_NS  # the release before it is there, too
    rows = np.insert(rows, releases, changes)
    assert split_changes(rows) == [
        SplitChange(EPOCH_NS + 99 * PERIOD_NS, EPOCH_NS + 99 * PERIOD_NS, is_new=False)
    ]
