"""`mauve analyze FILE --plan FILE`: the verdicts on a change, while it is made and after it."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from mauve_rt.cli.main import main

Plan = Callable[..., tuple[int, str, str]]

PAIR = """\
mauve: 1
executor: {wakeup_us: 0, overhead_ns: 0}
components:
  a: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
      priority: 80, cpus: [0], properties: {period_ms: 16}, states: {Count: {wcet_ns: 6000000}}}
  b: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
      priority: 70, cpus: [0], offset_ms: 2.0, properties: {period_ms: 16},
      states: {Count: {wcet_ns: 2000000}}}
  c: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
      priority: 60, cpus: [0], properties: {period_ms: 48}, deadline_ns: 18000000,
      states: {Count: {wcet_ns: 6000000}}}
"""

TIMED = """\
mauve: 1
executor: {wakeup_us: 0, overhead_ns: 0}
components:
  one: {shell: executor_tests/TimedShell, core: executor_tests/Timed, fsm: executor_tests/TimedFsm,
        alternatives: [executor_tests/HalfTimed, executor_tests/Timed], priority: 40, cpus: [0]}
  low: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
        alternatives: [executor_tests/Backwards], priority: 30, cpus: [0], properties: {period_ms: 50},
        states: {Count: {wcet_ns: 1000000}}}
"""
AGAIN = "- {kind: replace_core, target: one, name: executor_tests/Timed}\n"


@pytest.fixture
def plan(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Plan:
    """plan(ARCHITECTURE, CHANGE, WORD...): status, stdout, stderr."""

    def run(before: str, change: str, *words: str) -> tuple[int, str, str]:
        file, steps = tmp_path / "robot.yaml", tmp_path / "change.yaml"
        file.write_text(before, encoding="utf-8")
        steps.write_text(change, encoding="utf-8")
        status = main(["analyze", str(file), "--plan", str(steps), *words])
        said = capsys.readouterr()
        return status, said.out, said.err.replace(f"{tmp_path}/", "")

    return run


def test_a_change_between_two_schedulable_architectures_misses_a_deadline(
    plan: Plan, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    after = PAIR.replace("6000000}}}\n  b", "2000000}}}\n  b").replace("2000000}}}\n  c", "6000000}}}\n  c")
    bag = tmp_path / "bag"
    status, out, err = plan(PAIR, after, "--witness", str(bag))
    assert (status, err) == (1, "bag: a bag of that run; mauve report bag opens at it\n")
    assert "schedulable: every component meets its deadline, if\n" in out
    assert re.search(
        r"during the change: not schedulable: c misses its deadline at .*: 12\.000 ms of b \+ 8\.000 ms of a "
        r"\+ 6\.000 ms of its own, with the change at .* ms\nafter it: schedulable: every component meets",
        out,
    )
    assert main(["trace", "check", str(bag)]) == 0
    capsys.readouterr()
    told = json.loads(plan(PAIR, after, "--json")[1])
    assert told["verdict"]["outcome"] == told["changes"][0]["after"]["outcome"] == "schedulable"
    assert told["changes"][0]["during"]["outcome"] == "not schedulable"
    assert told["changes"][0]["during"]["responses"]["c"]["response_ns"] == 26_000_000
    assert plan(PAIR, PAIR)[0] == 0, "nothing changes"


def test_a_change_by_steps_with_its_handover(plan: Plan) -> None:
    status, out, err = plan(TIMED, AGAIN, "--json")
    assert (status, err) == (0, "")
    told = json.loads(out)
    now = {one["name"]: one["response"]["response_ns"] for one in told["components"]}
    during = {name: one["response_ns"] for name, one in told["changes"][0]["during"]["responses"].items()}
    assert during["one"] == now["one"] + 100_000, "its core declares budget_ns"
    assert during["low"] == now["low"] + 100_000
    after = {name: one["response_ns"] for name, one in told["changes"][0]["after"]["responses"].items()}
    assert after == now


def test_a_blend_costs_the_time_of_both_cores(plan: Plan) -> None:
    enforced = TIMED.replace("priority: 30,", "priority: 30, enforce_wcet: true,")
    change = (
        "- {kind: replace_core, target: low, name: executor_tests/Backwards, "
        "value: {bumpless: {outputs: {count.data: 1e9}, blend_s: BLEND}}}\n"
    )

    def after(blend_s: str) -> dict[str, int]:
        told = json.loads(plan(enforced, change.replace("BLEND", blend_s), "--json")[1])
        found = told["changes"][0]["after"]["responses"]
        return {name: one["response_ns"] for name, one in found.items()}

    at_once, blended = after("0"), after("0.5")
    assert blended["one"] == at_once["one"]
    more_ns = blended["low"] - at_once["low"]
    assert 1_000_000 <= more_ns < 1_100_000, "and what threads above it take in that time"


def test_times_of_one_core_are_not_those_of_another(plan: Plan) -> None:
    status, out, _ = plan(TIMED, "- {kind: replace_core, target: one, name: executor_tests/HalfTimed}\n")
    assert status == 3
    assert "after it: not provable: something is missing of one\n" in out
    assert "core executor_tests/HalfTimed declares no time of is_enabled" in out
    status, out, _ = plan(TIMED, "- {kind: replace_core, target: low, name: executor_tests/Backwards}\n")
    assert status == 3
    why = "the file declares the time of core executor_tests/Counter, not of executor_tests/Backwards"
    assert f"  low: no time is known of Count ({why}): " in out
    assert "  low: its new core declares no budget_ns of adopt and take: declare it\n" in out


def test_an_enforced_worst_case_of_the_file_is_that_of_each_core(plan: Plan) -> None:
    enforced = TIMED.replace("priority: 30,", "priority: 30, enforce_wcet: true,")
    out = plan(enforced, "- {kind: replace_core, target: low, name: executor_tests/Backwards}\n")[1]
    assert "no time is known" not in out
    assert "  low: its new core declares no budget_ns of adopt and take: declare it\n" in out


def test_one_that_is_added_delays_those_below(plan: Plan) -> None:
    part = (
        "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm, "
        "priority: 75, cpus: [0], properties: {period_ms: 20}, states: {Count: {wcet_ns: 3000000}}}"
    )
    steps = f"- {{kind: add_component, target: more, value: {part}}}\n"
    status, out, err = plan(TIMED, steps, "--json")
    assert (status, err) == (0, "")
    told = json.loads(out)
    now = {one["name"]: one["response"]["response_ns"] for one in told["components"]}
    for when in ("during", "after"):
        found = {name: one["response_ns"] for name, one in told["changes"][0][when]["responses"].items()}
        assert found == {"one": now["one"] + 3_000_000, "low": now["low"] + 3_000_000, "more": 3_000_000}


def test_what_the_executor_would_refuse_is_refused(plan: Plan) -> None:
    status, out, err = plan(TIMED, "- {kind: replace_core, target: one, name: executor_tests/None}\n")
    assert (status, out) == (2, "")
    assert err.startswith("mauve: change.yaml:1:3: core 'executor_tests/None' is not installed")


def test_a_plan_is_for_a_file_or_a_node(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["analyze", str(tmp_path), "--plan", "change.yaml"]) == 2
    why = "expected an architecture FILE whose parts are installed"
    assert capsys.readouterr().err == f"mauve: --plan: {why}, or a NODE\n"
    assert main(["analyze", "/robot_1/executor", "--alternatives"]) == 2
    assert capsys.readouterr().err == f"mauve: --alternatives: {why}\n"


def test_alternatives_and_fallbacks_have_verdicts_of_their_own(plan: Plan) -> None:
    fallback = "properties: {period_ms: 50}, fallback: executor_tests/Counter"
    text = TIMED.replace("properties: {period_ms: 50}", fallback)
    status, out, err = plan(text, AGAIN, "--alternatives")
    assert (status, err) == (3, "")
    missing = "not provable: something is missing of"
    assert f"with alternative executor_tests/HalfTimed of one: {missing} one\n" in out
    assert f"with alternative executor_tests/Backwards of low: {missing} low\n" in out
    why = "its new core declares no budget_ns of adopt and take: declare it"
    assert "with fallback executor_tests/Counter of low: while that is made: not provable: " in out
    assert f"  low: {why}\n" in out
    told = json.loads(plan(text, AGAIN, "--alternatives", "--json")[1])
    assert [one["change"] for one in told["changes"]] == [
        "",
        "with alternative executor_tests/HalfTimed of one",
        "with alternative executor_tests/Backwards of low",
        "with fallback executor_tests/Counter of low",
    ]
    assert told["changes"][-1]["after"]["outcome"] == "schedulable"


RULES = """\
mauve: 1
rules:
  - name: again
    when: {fault: {component: low}}
    do: [{kind: replace_core, target: one, name: executor_tests/Timed}]
  - name: halves
    when: {fault: {component: low}}
    do: [{kind: replace_core, target: one, name: executor_tests/HalfTimed}]
"""


def test_what_each_rule_does_is_judged(plan: Plan) -> None:
    status, out, err = plan(TIMED, RULES)
    assert (status, err) == (3, "")
    assert "when rule again acts: schedulable: every component meets its deadline\n" in out
    assert "when rule halves acts: not provable: something is missing of one\n" in out
