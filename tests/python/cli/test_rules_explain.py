"""`mauve rules explain`: the decisions in a bag as a story, and how rules stood at an instant."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from synthetic_traces import ROOT, record_small_bag
from trace_decisions import said, trace_with_rules

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace.reading.facts import Message

Explain = Callable[..., tuple[int, str, str]]
SUPERVISOR = "/supervisor/decisions"


@pytest.fixture
def explain(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Explain:
    """explain(*messages, at=...): status, stdout and stderr about a bag with these messages."""
    shutil.copytree(ROOT / "mauve_msgs" / "msg", tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))

    def run(*messages: Message, at: str = "") -> tuple[int, str, str]:
        shutil.rmtree(tmp_path / "bag", ignore_errors=True)
        trace = trace_with_rules(tmp_path / "bag", *messages)
        monkeypatch.setattr(mauve_rt.trace, "open", lambda *_, **__: trace)
        status = main(["rules", "explain", str(tmp_path / "bag"), *(["--at", at] if at else [])])
        told = capsys.readouterr()
        return status, told.out, told.err

    return run


def test_the_story_has_each_decision_with_its_reason(explain: Explain) -> None:
    status, out, err = explain(
        said(30, "armed", "watching"),
        said(50, "condition_true", "nothing on /scan for 0.10 s"),
        said(51, "do", "nothing on /scan for 0.10 s", act="do"),
        said(60, "done", "do: replace_core", act="do"),
        said(90, "suppressed", "no undo: cooldown for 1.00 s", act="undo"),
    )
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "    0.030 s  lidar_lost: armed: watching",
        "    0.050 s  lidar_lost: condition_true: nothing on /scan for 0.10 s",
        "    0.051 s  lidar_lost: do: nothing on /scan for 0.10 s",
        "    0.060 s  lidar_lost: done: do: replace_core",
        "    0.090 s  lidar_lost: suppressed: no undo: cooldown for 1.00 s",
    ]


def test_without_messages_the_records_tell(explain: Explain) -> None:
    _, out, _ = explain()
    assert out.splitlines()[-2:] == [
        "    0.060 s  lidar_lost: done do",
        "    0.090 s  lidar_lost: suppressed undo: cooldown",
    ]


def test_rules_of_a_supervisor_are_told_too(explain: Explain) -> None:
    _, out, _ = explain(said(70, "do", "nothing on /base", rule="link_lost", topic=SUPERVISOR))
    assert "    0.070 s  link_lost (/supervisor): do: nothing on /base" in out.splitlines()
    assert "    0.060 s  lidar_lost (/executor): done do" in out.splitlines()


@pytest.mark.parametrize(
    ("at", "told"),
    [
        ("0.02", ["lidar_lost: nothing told of it yet"]),
        ("0.04", ["lidar_lost: not in effect, its condition is false", "  last: 0.030 s: armed"]),
        ("0.0505", ["lidar_lost: not in effect, its condition is true", "  last: 0.050 s: condition_true"]),
        (
            "0.07",
            ["lidar_lost: in effect since 0.060 s, its condition is true", "  last: 0.060 s: done do"],
        ),
    ],
)
def test_how_a_rule_stood_at_an_instant(explain: Explain, at: str, told: list[str]) -> None:
    assert explain(at=at) == (0, "\n".join(told) + "\n", "")


def test_why_a_rule_did_not_act(explain: Explain) -> None:
    messages = [
        said(20, "armed", "it is RUNNING", rule="link_lost", topic=SUPERVISOR),
        said(40, "condition_true", "nothing on /base", rule="link_lost", topic=SUPERVISOR),
        said(
            45, "suppressed", "do waits: outranked by rule a (priority 1)", rule="link_lost", topic=SUPERVISOR
        ),
    ]
    _, out, _ = explain(*messages, at="0.05")
    (line,) = [line for line in out.splitlines() if line.startswith("link_lost")]
    named, _, why = line.partition("; ")
    assert named == "link_lost (/supervisor): not in effect, its condition is true"
    assert why == "it did not act: do waits: outranked by rule a (priority 1)"
    _, out, _ = explain(
        *messages, said(48, "condition_false", "samples", rule="link_lost", topic=SUPERVISOR), at="0.05"
    )
    assert "link_lost (/supervisor): not in effect, its condition is false" in out.splitlines()


@pytest.mark.parametrize(
    ("decision", "reason", "how"),
    [
        ("suppressed", "core A by another hand: left alone until the condition ends", "not in effect, "),
        ("suppressed", "no do: changed by another requester: left alone until", "not in effect, "),
        ("suppressed", "do waits: outranked by rule a (priority 1)", "not in effect, "),
        (
            "suppressed",
            "c is STOPPED: watching again once it runs",
            "in effect since 0.030 s, does not watch",
        ),
        ("suppressed", "nothing to undo: core A already; samples", "not in effect, "),
        ("failed", "undo failed: refused; next try in 0.50 s if still needed", "in effect since 0.030 s, "),
        ("done", "undo: core A", "not in effect, "),
    ],
)
def test_what_ends_the_effect_of_a_rule(explain: Explain, decision: str, reason: str, how: str) -> None:
    _, out, _ = explain(
        said(20, "armed", "it is RUNNING", rule="b", topic=SUPERVISOR),
        said(30, "done", "do: core B", rule="b", topic=SUPERVISOR),
        said(40, decision, reason, rule="b", topic=SUPERVISOR),
        at="0.06",
    )
    (line,) = [line for line in out.splitlines() if line.startswith("b (")]
    assert line.startswith(f"b (/supervisor): {how}")


def test_an_instant_outside_the_bag_is_refused(explain: Explain) -> None:
    status, out, err = explain(at="1000")
    assert (status, out) == (2, "")
    assert err.startswith("--at 1000: expected s from the bag's begin, 0 to 0.")


def test_a_bag_without_decisions_says_so(
    tmp_path: Path, explain: Explain, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = record_small_bag(tmp_path / "small")
    assert main(["rules", "explain", str(bag)]) == 1
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", f"{bag}: no rule decided anything: no decision is in the bag\n")
