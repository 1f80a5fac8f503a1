"""`mauve rules check`: what is wrong with rules of good form, and how long each may take."""

import pytest
from checked_rules import QUIET, ROBOT, UNDO, Check, rule

HEARD = f"{{not: {QUIET}}}"
OTHER_DO = "[{kind: replace_core, target: one, name: executor_tests/Counter}]"


@pytest.mark.parametrize(
    ("when", "words"),
    [
        (f"{{all: [{QUIET}, {HEARD}]}}", "silence of set_point > 1 and silence of set_point in 0 to 1"),
        (f"{{at_least: {{count: 2, of: [{QUIET}, {HEARD}]}}}}", "exclude each other"),
        (f"{{not: {{any: [{QUIET}, {HEARD}]}}}}", "exclude each other"),
        (f"{{all: [{QUIET}, {{any: [{HEARD}]}}], within_s: 5}}", "exclude each other"),
        (f"{{all: [{QUIET}, {{not: {QUIET[:-1]}, within_s: 5}}}}]}}", "exclude each other"),
    ],
)
def test_a_rule_that_can_never_hold(check: Check, when: str, words: str) -> None:
    status, _, errors = check(rule(when=when))
    assert status == 1
    (error,) = errors
    assert error.startswith("rules:4:5: rule 'quiet' can never hold: ")
    assert words in error


@pytest.mark.parametrize(
    "when",
    [
        f"{{any: [{QUIET}, {HEARD}]}}",
        f"{{all: [{QUIET}, {HEARD[:-1]}, within_s: 5}}]}}",  # then, not now
        f"{{all: [{QUIET}, {{not: {QUIET[:-1]}, for_s: 5}}}}]}}",  # it holds, but not for 5 s
        f"{{at_least: {{count: 1, of: [{QUIET}, {HEARD}]}}}}",
    ],
)
def test_a_rule_that_can_hold(check: Check, when: str) -> None:
    assert check(rule(when=when))[0] == 0


def test_two_that_want_different_things_at_once(check: Check) -> None:
    one, longer = rule(undo=""), QUIET.replace("1.0", "9.0")
    status, _, errors = check(one, rule("other", longer, do=OTHER_DO, undo=""))
    assert (status, len(errors)) == (1, 1)
    assert errors[0].startswith("rules:8:5: rules 'quiet' and 'other' can hold at once and want different")
    assert "the core of one to be 'executor_tests/Backwards' and 'executor_tests/Counter'" in errors[0]
    higher = rule("other", longer, do=OTHER_DO, undo="", more="    priority: 1\n")
    assert check(one, higher)[0] == 0
    assert check(one, rule("other", HEARD, do=OTHER_DO, undo=""))[0] == 0
    assert check(one, rule("other", longer, undo=""))[0] == 0, "they want the same"


def test_a_rule_that_swaps_to_and_fro_as_its_condition_does(check: Check) -> None:
    hasty = UNDO.replace("for_s: 1.0, ", "")
    status, _, errors = check(rule(undo=hasty))
    assert (status, len(errors)) == (1, 1)
    assert errors[0].startswith("rules:6:5: rule 'quiet' does and undoes as often as its condition changes")
    assert check(rule(undo=hasty, more="    cooldown_s: 2.0\n"))[0] == 0


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("topic: set_point", "topic: set_pont", "4:29", "did you mean /set_point?"),
        ("msg/Float64, l", "msg/Float65, l", "4:46", "expected std_msgs/msg/Float64, found"),
        ("msg/Float64, l", "msg/Float65, l", "4:46", "std_msgs/msg/Float65 is not installed"),
        ("executor_tests/Backwards", "executor_tests/Backward", "5:10", "executor_tests/Backward"),
        (
            "target: one, name: executor_tests/C",
            "target: two, name: executor_tests/C",
            "6:29",
            "'two' is unknown",
        ),
    ],
)
def test_names_that_are_not_there(check: Check, old: str, new: str, place: str, words: str) -> None:
    status, _, errors = check(rule().replace(old, new), robot=ROBOT)
    assert status == 1
    assert any(line.startswith(f"rules:{place}: ") and words in line for line in errors), errors


VALUE = "{value: {topic: set_point, type: std_msgs/msg/Float64, field: data, above: 9, hysteresis: 2}}"


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        (
            "field: data",
            "field: date",
            "4:73",
            "std_msgs/msg/Float64 has no field 'date'; did you mean data?",
        ),
        (
            "Float64, field: data",
            "Header, field: frame_id",
            "4:72",
            "'frame_id' of std_msgs/msg/Header is no number",
        ),
        ("Float64, field: data, above: 9", "UInt8, field: data, above: 255", "4:84", "no uint8 is above 255"),
    ],
)
def test_fields_that_are_not_there(check: Check, old: str, new: str, place: str, words: str) -> None:
    assert check(rule(when=VALUE))[0] == 0
    status, _, errors = check(rule(when=VALUE.replace(old, new)))
    assert (status, len(errors)) == (1, 1)
    assert errors[0].startswith(f"rules:{place}: ")
    assert words in errors[0]


def test_the_hysteresis_is_where_two_values_can_meet(check: Check) -> None:
    other = VALUE.replace("above: 9, hysteresis: 2", "below: {}")
    for below, found in ((6, 0), (8, 1)):
        lower = rule("other", other.replace("{}", str(below)), do=OTHER_DO, undo="")
        assert check(rule(when=VALUE, undo=""), lower)[0] == found


def test_a_rule_that_triggers_itself(check: Check) -> None:
    for about in ("one", ""):
        own = rule(
            when=f"{{since_change: {{component: '{about}', longer_than_s: 5}}}}", more="    cooldown_s: 1\n"
        )
        own = own.replace("component: '', ", "")
        status, _, errors = check(own)
        assert (status, len(errors)) == (1, 1)
        assert errors[0].startswith("rules:4:12: rule 'quiet' triggers itself")
    other = "{since_change: {component: two, longer_than_s: 5}}"
    assert check(rule(when=other))[0] == 0


def test_a_rule_that_changes_what_it_looks_at(check: Check) -> None:
    own = "{no_release: {component: one, periods: 3}}"
    status, _, errors = check(rule(when=own))
    assert (status, len(errors)) == (1, 1)
    assert errors[0].startswith(
        "rules:4:5: rule 'quiet' changes the input of its own condition (one), and has no cooldown_s"
    )
    status, _, errors = check(
        rule(when=own, undo="    undo: {for_s: 1.0}\n", more="    cooldown_s: 5\n"), robot=ROBOT
    )
    assert (status, errors) == (0, [])
    status, _, errors = check(rule(when=own.replace(": one", ": ona")), robot=ROBOT)
    assert "component 'ona' is unknown; did you mean one?" in errors[0]


def test_a_fault_of_what_has_to_run_for_the_rule(check: Check) -> None:
    calm = "    cooldown_s: 5\n"
    for when, column in (
        ("{fault: {component: one}}", 12),
        (f"{{any: [{QUIET}, {{fault: {{component: one}}}}]}}", 98),
    ):
        status, _, errors = check(rule(when=when, more=calm))
        assert (status, len(errors)) == (1, 1)
        assert errors[0].startswith(
            f"rules:4:{column}: rule 'quiet' can never act: it waits until one is FAULTED"
        )
    for when in ("{fault: {component: two}}", "{not: {fault: {component: one}}}"):
        assert check(rule(when=when, more=calm))[0] == 0
    revived = "[{kind: configure, target: one}, {kind: start, target: one}]"
    text = rule(when="{fault: {component: one}}", do=revived, undo="", more=f"{calm}    in: supervisor\n")
    assert check(text)[0] == 0


@pytest.mark.parametrize(
    ("bounds", "column", "words"),
    [
        ("above: 1, below: 2", 58, "every number is above 1 or below 2; let above be the greater one"),
        ("above: 2, below: 1, hysteresis: 0.6", 83, "it holds for ever; let hysteresis be no more than 0.5"),
        ("above: 2, below: 1, hysteresis: 0.5", 0, ""),
        ("above: 1, hysteresis: 9", 0, ""),
    ],
)
def test_a_value_that_is_always_beyond(check: Check, bounds: str, column: int, words: str) -> None:
    status, _, errors = check(rule(when=f"{{value: {{topic: set_point, field: data, {bounds}}}}}"))
    assert status == bool(words)
    assert not words or (errors[0].startswith(f"rules:4:{column}: ") and errors[0].endswith(words)), errors


def test_bad_input_is_no_finding(check: Check) -> None:
    status, out, (error,) = check(rule(when="{silense: {}}"))
    assert (status, out) == (2, [])
    assert error == "rules:4:12: rules[0].when.silense is no known condition; did you mean silence?"
    status, out, errors = check(rule(), robot=ROBOT.replace("CounterFsm", "CounterFms"))
    assert (status, out) == (2, [])
    assert errors[0].startswith("robot:3:")
