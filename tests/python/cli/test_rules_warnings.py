"""`mauve rules check`: warnings about rules that an executor takes."""

import pytest
from checked_rules import QUIET, ROBOT, UNDO, Check, driven, rule

SAFETY = "    safety: true\n    otherwise: stop\n"
ABOVE = "{value: {topic: set_point, type: std_msgs/msg/Float64, field: data, above: 1.0}}"
BACK = "    undo: {for_s: 1.0}\n"


def test_a_latched_rule_that_is_no_safety_rule(check: Check) -> None:
    status, _, errors = check(rule(more="    latch: true\n"))
    assert status == 0
    (error,) = errors
    assert error == (
        "rules:7:12: warning: rule 'quiet' is latched, and is no safety rule: rules and persons can go over "
        "it; add safety: true and otherwise: stop"
    )
    assert check(rule(more=f"    latch: true\n{SAFETY}"))[2] == []


def test_steps_of_undo_that_are_not_needed(check: Check) -> None:
    status, _, errors = check(rule(), robot=ROBOT)
    assert status == 0
    (error,) = errors
    assert error == (
        "rules:6:24: warning: rule 'quiet': these steps are not needed: what was there before comes back "
        "without them; leave `do` of `undo` out"
    )
    other = UNDO.replace("executor_tests/Counter", "executor_tests/Backwards")
    assert check(rule(undo=other), robot=ROBOT)[2] == [], "that is another core than the file's"
    assert check(rule(more="    takes_over: true\n"), robot=ROBOT)[2] == [], "it counts for persons, too"
    assert check(rule(undo=BACK), robot=ROBOT)[2] == []


@pytest.mark.parametrize(
    ("when", "qos", "warned"),
    [
        (ABOVE, "", 1),
        (ABOVE, ", qos: transient_local", 0),
        (ABOVE, ", qos: {durability: transient_local}", 0),
        (ABOVE, ", qos: {deadline_ms: 100}", 0),
        (QUIET, "", 0),  # silence counts from the start on
    ],
)
def test_a_safety_rule_on_a_topic_that_keeps_nothing(check: Check, when: str, qos: str, warned: int) -> None:
    robot = ROBOT.replace("direction: subscribe", f"direction: subscribe{qos}")
    status, _, errors = check(rule(when=when, more=SAFETY, undo=BACK), robot=robot)
    assert status == 0
    assert len(errors) == warned, errors
    if warned:
        assert errors[0].startswith(
            "rules:4:12: warning: safety rule 'quiet': an executor that starts again does"
        )
        assert check(rule(when=when, undo=BACK), robot=robot)[2] == [], "it is no safety rule"


@pytest.mark.parametrize(
    ("said", "is_wrong"),
    [
        ("", True),
        (", qos: {deadline_ms: 100}", True),
        (", driver_timeout_ms: 100", False),
        (", driver_timeout_ms: 0", False),
    ],
)
def test_a_safety_rule_about_a_driver_that_does_not_stop_by_itself(
    check: Check, said: str, *, is_wrong: bool
) -> None:
    status, _, errors = check(rule(more=SAFETY, undo=BACK), robot=driven(said))
    assert (status, len(errors)) == ((1, 1) if is_wrong else (0, 0)), errors
    if is_wrong:
        assert errors[0].startswith("rules:7:13: safety rule 'quiet' cannot help where the executor dies")
        assert "resource 'out', topic motor, does not say when its driver is safe by itself" in errors[0]
        assert check(rule(undo=BACK), robot=driven(said))[0] == 0, "it is no safety rule"
