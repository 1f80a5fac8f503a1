"""`mauve rules replay`: rules held against what was decided on the day of a bag."""

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from synthetic_traces import MS, ROOT, deploy, record, run
from trace_decisions import DO, REALTIME_OFFSET_NS, decide

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace.reading.facts import Message
from mauve_rt.trace.recording.synthetic import SyntheticSource

Replay = Callable[..., tuple[int, str, str]]
RULES = """\
mauve: 1
rules:
  - name: link_lost
    when: {silence: {topic: /radio/in, type: p/msg/T, longer_than_s: 0.2}}
    do: [{kind: replace_core, target: c, name: p/B}]
"""
UNHEARD = """\
  - name: stale
    when: {silence: {resource: scan, longer_than_s: 1}}
    do: [{kind: replace_core, target: c, name: p/C}]
"""


@pytest.fixture
def replay(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Replay:
    """replay(rules): of a bag with samples until 150 ms, on which its rules acted at 350 ms, after 0.2 s."""
    shutil.copytree(ROOT / "mauve_msgs" / "msg", tmp_path / "prefix" / "share" / "mauve_msgs" / "msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    source = SyntheticSource(["c", "(rules)"], realtime_offset_ns=REALTIME_OFFSET_NS)
    deploy(source, "c")
    run(source, "c", 70)
    decide(source, 350, DO, rule="link_lost", cause_ms=350)
    trace = mauve_rt.trace.open(record(source, tmp_path / "bag"))
    heard = [Message("/radio/in", at * MS + REALTIME_OFFSET_NS, at * MS, None) for at in (50, 100, 150)]
    told = replace(
        trace,
        topics={**trace.topics, "/radio/in": ("p/msg/T", len(heard))},
        message_source=lambda of: (one for one in heard if one.topic in of),
    )
    monkeypatch.setattr(mauve_rt.trace, "open", lambda *_, **__: told)

    def ask(rules: str) -> tuple[int, str, str]:
        (tmp_path / "rules.yaml").write_text(rules, encoding="utf-8")
        status = main(["rules", "replay", str(tmp_path / "rules.yaml"), str(tmp_path / "bag")])
        said = capsys.readouterr()
        return status, said.out, said.err.replace(f"{tmp_path}/", "")

    return ask


def test_the_same_rules_do_the_same(replay: Replay) -> None:
    status, out, err = replay(RULES)
    assert (status, err) == (0, "")
    assert out.splitlines()[-1] == "rules: 1, actions: 1, differing: 0"


def test_other_rules_differ(replay: Replay) -> None:
    status, out, _ = replay(RULES.replace("0.2", "0.4"))
    assert status == 1
    header, row, total = out.splitlines()
    assert header.split() == ["rule", "act", "then", "replayed", "difference"]
    assert row.split() == ["link_lost", "do", "0.350", "0.550", "+0.200", "differs"]
    assert total == "rules: 1, actions: 1, differing: 1"


def test_what_is_not_done_any_more_differs(replay: Replay) -> None:
    status, out, _ = replay(RULES.replace("0.2", "4"))
    assert status == 1
    assert out.splitlines()[1].split() == ["link_lost", "do", "0.350", "-", "differs"]


def test_a_rule_about_what_the_bag_lacks_is_left_out(replay: Replay) -> None:
    status, out, err = replay(RULES + UNHEARD)
    assert (status, err) == (0, "not in the bag: writes of resource scan: rule stale is left out\n")
    assert out.splitlines()[-1] == "rules: 1, actions: 1, differing: 0"


def test_with_no_rule_left_it_is_refused(replay: Replay) -> None:
    status, out, err = replay("mauve: 1\nrules:\n" + UNHEARD)
    assert (status, out) == (1, "")
    assert err.splitlines()[-1] == "bag: no rule of rules.yaml can be replayed"


def test_a_file_with_a_mistake_is_told_with_its_place(replay: Replay) -> None:
    status, out, err = replay(RULES.replace("silence", "silance"))
    assert (status, out) == (2, "")
    assert err.startswith("rules.yaml:4:12: ")
