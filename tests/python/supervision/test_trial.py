"""Rules tried on a script: the real engine, on a simulated executor."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from checked_rules import ROBOT

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import load_architecture
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.script import load_script
from mauve_rt.supervision.trial import Trial


class Tried(NamedTuple):
    story: list[tuple[float, str, str]]  # s, rule, decision
    reasons: list[str]
    messages: list[str]
    rows: dict[str, str]  # by rule

    def of(self, rule: str) -> list[str]:
        return [decision for _, name, decision in self.story if name == rule]


TryRules = Callable[..., Tried]


@pytest.fixture
def tried(tmp_path: Path) -> TryRules:
    """tried(rules, heard): what comes of rules in 20 s of a script."""

    def run(rules: list[dict[str, Any]], heard: list[dict[str, Any]], *, robot: str = "") -> Tried:
        files = {"rules": {"rules": rules}, "script": {"lasts_s": 20, "heard": heard}}
        for name, content in files.items():
            (tmp_path / name).write_text(json.dumps({"mauve": 1, **content}), encoding="utf-8")
        model = None
        if robot:
            (tmp_path / "robot").write_text(robot, encoding="utf-8")
            model = load_architecture(tmp_path / "robot")
        file = RulesFile(tmp_path / "rules")
        trial = Trial(file, load_script(tmp_path / "script", file.rules.rules), model)
        story = [(one.time_ns / 1e9, one.rule, one.decision) for one in trial.story]
        rows = {line.split()[0]: line.partition("|")[2][:-1] for line in trial.timeline() if "|" in line}
        reasons, messages = ([getattr(one, key) for one in trial.story] for key in ("reason", "message"))
        return Tried(story, reasons, messages, rows)

    return run


def value(topic: str = "stop") -> dict[str, Any]:
    return {"value": {"topic": topic, "type": "std_msgs/msg/Float64", "field": "data", "above": 0.5}}


def core(name: str, target: str = "control") -> dict[str, Any]:
    return {"kind": "replace_core", "target": target, "name": f"p/{name}"}


def rule(name: str, do: list[dict[str, Any]], topic: str = "stop", **more: Any) -> dict[str, Any]:
    return {"name": name, "when": value(topic), "do": do, **more}


def at(from_s: float, value: float = 1.0, topic: str = "stop") -> dict[str, Any]:
    return {"topic": topic, "from_s": from_s, "value": value}


def test_an_emergency_stop_that_is_published_once_acts(tried: TryRules) -> None:
    stop = rule("estop", [{"kind": "stop", "target": "motor"}], safety=True, otherwise="stop", latch=True)
    found = tried([stop], [at(5.0)])
    assert found.story == [
        (0.0, "estop", "armed"),
        (5.0, "estop", "condition_true"),
        (5.0, "estop", "do"),
        (5.0, "estop", "done"),
    ]
    assert found.rows["estop"] == "~" * 15 + "#" * 45


def test_a_latched_rule_stays_in_effect_to_the_end(tried: TryRules) -> None:
    found = tried([rule("latched", [core("Safe")], undo={}, latch=True)], [at(5.0), at(6.0, 0.0)])
    assert found.of("latched") == ["armed", "condition_true", "do", "done", "condition_false"]
    assert found.rows["latched"].endswith("#" * 45)


def test_a_rule_that_is_outranked_on_one_element_keeps_the_others(tried: TryRules) -> None:
    low = rule("low", [core("Slow"), core("Slow", "arm")], "heat", undo={})
    high = rule("high", [core("Safe")], priority=1, undo={})
    found = tried([low, high], [at(2.0, topic="heat"), at(5.0)])
    assert found.of("low") == ["armed", "condition_true", "do", "done", "suppressed"]
    assert found.of("high") == ["armed", "condition_true", "do", "done"]
    assert found.rows["low"].endswith("#" * 54)


def test_what_is_left_of_an_outranked_rule_is_done(tried: TryRules) -> None:
    low = rule("low", [core("Slow"), core("Slow", "arm")], "heat", undo={})
    high = rule("high", [core("Safe")], priority=1, undo={})
    found = tried([low, high], [at(2.0), at(5.0, topic="heat")])
    assert "do: replace_core arm p/Slow" in found.reasons
    assert found.rows["low"].endswith("#" * 45)


def test_the_end_of_the_higher_rule_leads_straight_to_what_the_lower_one_wants(tried: TryRules) -> None:
    low = rule("low", [core("Slow")], "heat", undo={})
    high = rule("high", [core("Safe")], priority=1, undo={})
    found = tried([low, high], [at(2.0, topic="heat"), at(5.0), at(8.0, 0.0)])
    assert found.reasons[-1] == "undo: replace_core control p/Slow"
    assert found.of("high") == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]
    assert found.of("low").count("do") == 1
    assert set(found.rows["low"][24:]) == {"#"}
    assert set(found.rows["low"][15:24]) == {"?"}


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_step_that_the_executor_refuses_is_a_failure(tried: TryRules, where: str) -> None:
    """The port is connected to the resource that is to be removed."""
    taken = [{"kind": "remove_resource", "target": "map"}]
    wired = [{"kind": "connect", "target": "control", "name": "in", "value": "map.read"}]
    rules = [rule("wire", wired, "wire"), rule("drop", taken, **{"in": where})]
    found = tried(rules, [at(2.0, topic="wire"), at(5.0)])
    assert found.of("wire")[-1] == "done"
    assert "done" not in found.of("drop")
    assert "#" not in found.rows["drop"]
    assert ("suppressed" if where == "executor" else "failed") in found.of("drop")
    assert "resource map: the resource is still connected" in found.messages[-1]


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_fault_that_the_script_tells_of_is_heard(tried: TryRules, where: str) -> None:
    fault = {"name": "one", "when": {"fault": {"component": "arm"}}, "do": [core("Safe")], "in": where}
    found = tried([fault], [{"state": "arm", "is": "FAULTED", "from_s": 5.0}])
    assert found.of("one") == ["armed", "condition_true", "do", "done"]
    assert found.rows["one"] == "." * 15 + "#" * 45


def test_goals_of_a_script(tried: TryRules) -> None:
    def on(name: str, **what: Any) -> dict[str, Any]:
        when = {"action": {"resource": "drive", **what}}
        return {"name": name, "when": when, "do": [core("Safe", name)], "undo": {}}

    rules = [on("slow", **{"is": "overdue", "longer_than_s": 4.0}), on("failed", **{"is": "aborted"})]
    goals = [
        (1.0, "executing"),
        (4.0, "succeeded"),
        (6.0, "executing"),
        (12.0, "aborted"),
        (16.0, "executing"),
    ]
    found = tried(rules, [{"goal": "drive", "is": word, "from_s": at_s} for at_s, word in goals])
    acts = [(round(at_s, 2), name, made) for at_s, name, made in found.story if made in ("do", "undo")]
    assert acts == [
        (10.0, "slow", "do"),
        (12.0, "slow", "undo"),
        (12.0, "failed", "do"),
        (16.0, "failed", "undo"),
    ]
    assert found.rows["failed"].startswith("."), "before the first goal: false, not unknown"


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_what_rules_bring_about_is_heard(tried: TryRules, where: str) -> None:
    when = {"since_change": {"component": "control", "longer_than_s": 2.0}}
    calm = {"name": "calm", "when": when, "do": [core("Calm", "arm")], "undo": {}, "in": where}
    found = tried([calm, rule("one", [core("Safe")])], [at(5.0)])
    acts = [(at_s, decision) for at_s, name, decision in found.story if name == "calm"]
    assert [each for each in acts if each[1] in ("do", "undo")] == [
        (pytest.approx(2.0, abs=0.01), "do"),
        (5.0, "undo"),
        (pytest.approx(7.0, abs=0.01), "do"),
    ]


@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_a_rule_of_either_process_acts_and_ends(tried: TryRules, where: str) -> None:
    found = tried([rule("one", [core("Safe")], undo={}, **{"in": where})], [at(5.0), at(8.0, 0.0)])
    assert found.of("one") == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]
    assert found.rows["one"] == "~" * 15 + "#" * 9 + "." * 36


def test_a_supervisor_s_rule_is_outranked_by_the_executor_s(tried: TryRules) -> None:
    own = rule("own", [core("Safe")], priority=1)
    other = rule("other", [core("Slow")], "heat", undo={}, **{"in": "supervisor"})
    found = tried([own, other], [at(2.0), at(5.0, topic="heat")])
    assert found.rows["own"].endswith("#" * 54)
    assert "#" not in found.rows["other"]


def test_all_kinds_of_steps_find_their_stand_ins(tried: TryRules) -> None:
    do = [
        {"kind": "set_property", "target": "a", "name": "speed", "value": "0.5"},
        {"kind": "connect", "target": "a", "name": "out", "value": "map.write"},
        {"kind": "disconnect", "target": "a", "name": "in"},
        {"kind": "replace_fsm", "target": "b", "name": "p/Fsm"},
        {"kind": "start", "target": "c"},
        {"kind": "stop", "target": "d"},
    ]
    back = [{"kind": "set_property", "target": "a", "name": "speed", "value": "1.5"}]
    found = tried([rule("all", do, undo={"do": back})], [at(5.0), at(8.0, 0.0)])
    assert found.of("all") == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]
    assert found.rows["all"] == "~" * 15 + "#" * 9 + "." * 36


def test_a_supervisor_adds_and_removes(tried: TryRules) -> None:
    section = json.dumps({"shell": "p/Shell", "core": "p/New", "fsm": "p/Fsm"})
    resource = json.dumps({"kind": "shared_data", "type": "std_msgs/msg/Bool"})
    do = [
        {"kind": "add_resource", "target": "map", "value": resource},
        {"kind": "add_component", "target": "new", "value": section},
        {"kind": "connect", "target": "a", "name": "in", "value": "map.read"},
    ]
    found = tried([rule("add", do, **{"in": "supervisor"})], [at(5.0)])
    assert found.of("add") == ["armed", "condition_true", "do", "done"]


def test_what_a_rule_adds_is_not_there_before(tried: TryRules) -> None:
    section = json.dumps({"shell": "p/Shell", "core": "p/New", "fsm": "p/Fsm"})
    resource = json.dumps({"kind": "shared_data", "type": "std_msgs/msg/Empty"})
    do = [
        {"kind": "add_component", "target": "new", "value": section},
        {"kind": "remove_component", "target": "old"},
        {"kind": "remove_resource", "target": "map"},
    ]
    back = [
        {"kind": "remove_component", "target": "new"},
        {"kind": "add_component", "target": "old", "value": section},
        {"kind": "add_resource", "target": "map", "value": resource},
    ]
    found = tried([rule("one", do, undo={"do": back}, **{"in": "supervisor"})], [at(5.0), at(8.0, 0.0)])
    assert found.of("one") == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]


def test_a_shell_is_replaced_with_a_core_and_an_fsm_for_it(tried: TryRules) -> None:
    kinds = ("replace_shell", "replace_core", "replace_fsm")
    do = [{"kind": kind, "target": "arm", "name": f"p/{kind}"} for kind in kinds]
    found = tried([rule("one", do, undo={})], [at(5.0), at(8.0, 0.0)])
    assert found.of("one") == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]


def test_a_rule_about_no_component(tried: TryRules) -> None:
    found = tried([rule("one", [{"kind": "remove_resource", "target": "map"}])], [at(5.0)])
    assert found.of("one") == ["armed", "condition_true", "do", "done"]


def test_a_rule_that_the_executor_cannot_hear_is_refused(tried: TryRules) -> None:
    peer = {"name": "one", "when": {"peer": {"executor": "b"}}, "do": [core("Safe")]}
    gone = {"peer": "b", "is": "gone", "from_s": 5.0}
    with pytest.raises(ArchitectureFileError, match="cannot receive another executor"):
        tried([peer], [gone])
    assert tried([peer | {"in": "supervisor"}], [gone]).of("one")[-1] == "done"


@pytest.mark.usefixtures("plugin_prefix")
def test_a_real_architecture_takes_the_place_of_the_stand_ins(tried: TryRules) -> None:
    do = [{"kind": "replace_core", "target": "one", "name": "executor_tests/Backwards"}]
    found = tried([rule("real", do, undo={})], [at(5.0), at(8.0, 0.0)], robot=ROBOT)
    assert found.reasons[-1] == "undo: replace_core one executor_tests/Counter"


@pytest.mark.usefixtures("plugin_prefix")
def test_a_wrong_name_is_refused_with_its_place(tried: TryRules) -> None:
    do = [{"kind": "replace_core", "target": "two", "name": "executor_tests/Backwards"}]
    with pytest.raises(ArchitectureFileError) as refused:
        tried([rule("wrong", do)], [at(5.0)], robot=ROBOT)
    (line,) = refused.value.lines()
    assert "component 'two' is unknown" in line
    assert "rules:1:" in line
