"""`mauve rules check`: what is wrong with rules of good form, and how long each may take."""

from collections.abc import Callable
from pathlib import Path

import pytest

from mauve_rt.cli.main import main
from mauve_rt.supervision import condition_table
from mauve_rt.supervision.condition_table import ConditionKind, ConditionParameter

Check = Callable[..., tuple[int, list[str], list[str]]]

ROBOT = """\
mauve: 1
components:
  one: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
        alternatives: [executor_tests/Backwards]}
resources:
  set: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set_point, direction: subscribe}}
connections:
  - [one.set, set.read]
"""
QUIET = "{silence: {topic: set_point, type: std_msgs/msg/Float64, longer_than_s: 1.0}}"
HEARD = f"{{not: {QUIET}}}"
UNDO = "    undo: {for_s: 1.0, do: [{kind: replace_core, target: one, name: executor_tests/Counter}]}\n"
OTHER_DO = "[{kind: replace_core, target: one, name: executor_tests/Counter}]"


def rule(name: str = "quiet", when: str = QUIET, *, more: str = "", undo: str = UNDO, do: str = "") -> str:
    do = do or "[{kind: replace_core, target: one, name: executor_tests/Backwards}]"
    return f"  - name: {name}\n    when: {when}\n    do: {do}\n{undo}{more}"


@pytest.fixture
def check(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Check:
    """check(*rules, robot=TEXT): status, lines of stdout and of stderr, without the folder's name."""

    def run(*rules: str, robot: str = "") -> tuple[int, list[str], list[str]]:
        file, architecture = tmp_path / "rules", tmp_path / "robot"
        file.write_text("mauve: 1\nrules:\n" + "".join(rules), encoding="utf-8")
        architecture.write_text(robot, encoding="utf-8")
        beside = ["--architecture", str(architecture)] if robot else []
        status = main(["rules", "check", str(file), *beside])
        said = capsys.readouterr()
        out, err = (text.replace(f"{tmp_path}/", "").splitlines() for text in (said.out, said.err))
        return status, out, err

    return run


def test_good_rules_and_their_bounds(check: Check) -> None:
    status, out, errors = check(rule(more="    for_s: 0.25\n"), robot=ROBOT)
    assert (status, errors) == (0, [])
    assert out[-1] == "rules: 1 rules, held against robot: no error found"
    parts = [line.split(" ms  ") for line in out[1:-1]]
    assert [what for _, what in parts] == [
        "silence set_point",
        "for_s of the rule",
        "3 looks of the supervisor",
        "the supervisor runs, and its request arrives (assumed)",
        "the executor builds, checks and commits (assumed)",
        "one period of one",
    ]
    assert [float(ms) for ms, _ in parts[:2]] == [1000.0, 250.0]
    total_ms = sum(float(ms) for ms, _ in parts)
    assert out[0].endswith(
        f"(in the supervisor): at most from the cause to the first release: {total_ms:.3f} ms"
    )


def test_without_an_architecture_nobody_knows_the_period(check: Check) -> None:
    status, out, errors = check(rule())
    assert (status, errors) == (0, [])
    assert out[0].endswith("1260.000 ms and what is not known")
    assert out[-2].split() == [
        "?",
        "ms",
        "one",
        "period",
        "of",
        "one",
        "(not",
        "known:",
        "give",
        "--architecture)",
    ]


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


@pytest.fixture
def more_conditions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Conditions about components: a row in the table each."""
    about = ConditionParameter("component", "component")
    since = ConditionParameter("longer_than_s", "float", required=True)
    periods = ConditionParameter("periods", "float", required=True)
    changed = ConditionKind("since_change", {"component": about, "longer_than_s": since})
    released = ConditionKind("no_release", {"component": about, "periods": periods})
    monkeypatch.setattr(condition_table, "CONDITIONS", (*condition_table.CONDITIONS, changed, released))


@pytest.mark.usefixtures("more_conditions")
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


@pytest.mark.usefixtures("more_conditions")
def test_a_rule_that_changes_what_it_looks_at(check: Check) -> None:
    own = "{no_release: {component: one, periods: 3}}"
    status, _, errors = check(rule(when=own))
    assert (status, len(errors)) == (1, 1)
    assert errors[0].startswith(
        "rules:4:5: rule 'quiet' changes what it looks at (one), and has no cooldown_s"
    )
    status, out, errors = check(rule(when=own, more="    cooldown_s: 5\n"), robot=ROBOT)
    assert (status, errors) == (0, [])
    parts = {what: float(ms) for ms, what in (line.split(" ms  ") for line in out[1:-1])}
    assert parts["no_release one"] == 3 * parts["one period of one"]
    status, _, errors = check(rule(when=own.replace(": one", ": ona")), robot=ROBOT)
    assert "component 'ona' is unknown; did you mean one?" in errors[0]


def test_bad_input_is_no_finding(check: Check) -> None:
    status, out, (error,) = check(rule(when="{silense: {}}"))
    assert (status, out) == (2, [])
    assert error == "rules:4:12: rules[0].when.silense is no known condition; did you mean silence?"
    status, out, errors = check(rule(), robot=ROBOT.replace("CounterFsm", "CounterFms"))
    assert (status, out) == (2, [])
    assert errors[0].startswith("robot:3:")
