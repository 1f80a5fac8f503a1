"""The bounds that `mauve rules check` prints: their parts, by who runs the rule and what it waits for."""

from pathlib import Path

import pytest
from checked_rules import QUIET, ROBOT, Check, rule

from mauve_rt.supervision.rule_bounds import BUILT_S, CALLED_OFF_S, WOKEN_S, Bound, bound_of, reserve_bound_of
from mauve_rt.supervision.rules import Rule, RulesFile

PERIODS_S = {"one": 0.010, "slow": 0.100, "told": 0.0}
SWAP = "{kind: replace_core, target: one, name: executor_tests/Backwards}"
SLOW = SWAP.replace("one", "slow")
BACK = "    undo: {for_s: 1.0}\n"


def parts(out: list[str]) -> dict[str, float]:
    return {what: float(ms) for ms, what in (line.split(" ms  ") for line in out if line[0] == " ")}


def loaded(folder: Path, when: str, do: str = SWAP, more: str = "", name: str = "one") -> Rule:
    path = folder / "rules"
    path.write_text(
        f"mauve: 1\nrules:\n  - name: {name}\n    when: {when}\n    do: [{do}]\n{more}", encoding="utf-8"
    )
    return RulesFile(path).rules.rules[0]


def test_in_the_executor(check: Check) -> None:
    status, out, errors = check(rule(more="    for_s: 0.25\n", undo=BACK), robot=ROBOT)
    assert (status, errors) == (0, [])
    assert out[-1] == "rules: 1 rule, checked with robot: no error found"
    assert parts(out) == {
        "silence set_point": 1000.0,
        "for_s of the rule": 250.0,
        "the executor decides, commits and wakes up (assumed)": 1.0,
        "one period of one": 10.0,
    }
    assert out[0] == "quiet (in the executor): at most from the cause to the first release: 1261.000 ms"


def test_the_timing_of_each_action_is_judged(check: Check) -> None:
    _, out, _ = check(rule(), robot=ROBOT)
    assert [line for line in out if line.startswith("when rule")] == [
        "when rule quiet acts: not provable: something is missing of one, this computer"
    ]
    _, out, _ = check(rule())
    assert not any(line.startswith("when rule") for line in out)


def test_in_the_supervisor(check: Check) -> None:
    status, out, errors = check(rule(more="    in: supervisor\n", undo=BACK), robot=ROBOT)
    assert (status, errors) == (0, [])
    assert parts(out) == {
        "silence set_point": 1000.0,
        "the supervisor runs, and its request arrives (assumed)": 20.0,
        "the executor builds, checks and commits (assumed)": 200.0,
        "one period of one": 10.0,
    }
    assert out[0] == "quiet (in the supervisor): at most from the cause to the first release: 1230.000 ms"


def test_without_an_architecture_nobody_knows_the_period(check: Check) -> None:
    status, out, errors = check(rule())
    assert (status, errors) == (0, [])
    assert out[0].endswith("1001.000 ms and what is not known")
    assert out[-2].split(None, 2) == ["?", "ms", "one period of one (not known: give --architecture)"]


@pytest.mark.parametrize(
    ("when", "seconds"),
    [
        ("{silence: {resource: set, longer_than_s: 2}}", 2.0),
        ("{since_change: {longer_than_s: 5}}", 5.020),  # an ordinary thread sees the change
        ("{no_release: {component: slow, periods: 3}}", 0.3),
        ("{value: {resource: set, field: data, above: 1}}", 0.0),
        ("{late: {component: one, longer_than_s: 2}}", 0.0),  # told when it comes, however late that is
        ("{overruns: {component: one, at_least: 3, within_s: 9}}", 0.0),
        ("{not: {overruns: {component: one, within_s: 9}}}", 9.0),
        ("{not: {silence: {topic: in, longer_than_s: 2}}}", 0.0),
        ("{fault: {component: one}}", 0.0),
        ("{all: [{silence: {topic: in, longer_than_s: 2}}, {fault: {component: one}}]}", 2.0),
        ("{fault: {component: one}, for_s: 0.5}", 0.5),
        ("{node_silent: {longer_than_s: 5}}", 5.0),
        ("{action: {resource: drive, is: overdue, longer_than_s: 5}}", 5.0),
        ("{action: {resource: drive, is: aborted}}", 0.0),
        ("{not: {fault: {component: one}, within_s: 0.5}}", 0.5),
        ("{not: {fault: {component: one}, for_s: 0.5}}", 0.0),
        ("{not: {any: [{not: {silence: {topic: in, longer_than_s: 2}}}]}}", 2.0),
    ],
)
def test_what_passes_before_it_is_noticed(tmp_path: Path, when: str, seconds: float) -> None:
    one = loaded(tmp_path, when)
    assert bound_of(one, PERIODS_S).total_s == pytest.approx(seconds + WOKEN_S + PERIODS_S["one"])


def test_several_components_have_to_agree_first(tmp_path: Path) -> None:
    bound = bound_of(loaded(tmp_path, QUIET, f"{SWAP}, {SLOW}"), PERIODS_S)
    assert [(part.what, part.seconds, part.assumed) for part in bound.parts[-2:]] == [
        ("until one, slow have agreed, each in its wait: one period of slow", 0.100, False),
        ("one period of slow", 0.100, False),
    ]


def test_a_component_without_a_period_has_no_bound(tmp_path: Path) -> None:
    one = loaded(tmp_path, QUIET, SWAP.replace("one", "told"))
    bound = bound_of(one, PERIODS_S)
    assert bound.total_s is None
    assert bound.known_s == pytest.approx(1.0 + WOKEN_S)
    assert bound.parts[-1].what == "the next event of told, which has no period"


def test_what_is_told_now_and_then_is_as_old_as_that(tmp_path: Path) -> None:
    for when in ("{diagnostic: {status: gps}}", "{peer: {executor: robot_2}}"):
        one = loaded(tmp_path, when, more="    in: supervisor\n")
        bound = bound_of(one, PERIODS_S)
        assert isinstance(bound, Bound)
        assert bound.known_s == pytest.approx(1.0 + 0.220 + PERIODS_S["one"])
        assert bound.parts[1].assumed


@pytest.mark.parametrize(
    "higher", ["    priority: 5\n", "    safety: true\n    otherwise: stop\n    priority: 0\n"]
)
def test_a_rule_about_the_same_component_may_have_acted_just_before(tmp_path: Path, higher: str) -> None:
    low = loaded(tmp_path, QUIET, name="low", more="    priority: 1\n")
    high = loaded(tmp_path, QUIET, more=higher, name="high")
    other = loaded(tmp_path, QUIET, SLOW, name="other")
    alone = bound_of(high, PERIODS_S).known_s
    beside = bound_of(high, PERIODS_S, beside=[low, high, other])
    assert beside.known_s == pytest.approx(alone + CALLED_OFF_S + BUILT_S)
    assert [part.what for part in beside.parts[-2:]] == [
        "until the action of low is called off",
        "until the new part is built again, where low has just acted",
    ]
    beneath = bound_of(low, PERIODS_S, beside=[low, high, other])
    assert beneath.known_s == pytest.approx(alone + BUILT_S)
    assert beneath.parts[-1].what == "until the new part is built again, where high has just acted"


def test_rules_that_wire_commit_one_after_the_other(tmp_path: Path) -> None:
    wires = "{kind: disconnect, target: one, name: input}"
    one = loaded(tmp_path, QUIET, wires, name="first")
    other = loaded(tmp_path, QUIET, wires.replace("one", "slow"), name="second")
    bound = bound_of(other, PERIODS_S, beside=[one, other])
    assert (bound.parts[-1].what, bound.parts[-1].seconds) == (
        "until first let go of the architecture's structure",
        1.0,
    )


@pytest.mark.parametrize(("kind", "patience_s"), [("stop", 0.050), ("safe_outputs", 0.001)])
def test_a_reserve_action_waits_for_no_component(tmp_path: Path, kind: str, patience_s: float) -> None:
    one = loaded(tmp_path, QUIET, more=f"    for_s: 0.5\n    otherwise: {kind}\n    otherwise_after_s: 0.2\n")
    bound = reserve_bound_of(one, {})
    assert bound is not None
    assert bound.total_s == pytest.approx(1.0 + 0.5 + 0.2 + WOKEN_S + patience_s)
    assert reserve_bound_of(loaded(tmp_path, QUIET), {}) is None


def test_a_reserve_action_is_printed_and_only_an_executor_has_one(check: Check) -> None:
    more = "    otherwise: stop\n"
    status, out, errors = check(rule(more=more, undo=BACK), robot=ROBOT)
    assert (status, errors) == (0, [])
    said = "quiet (in the executor): otherwise at most from the cause to safe outputs: 1151.000 ms"
    assert said in out
    status, _, errors = check(rule(more=f"{more}    in: supervisor\n"), robot=ROBOT)
    assert status == 2
    assert "only an executor has a reserve action" in errors[0]
