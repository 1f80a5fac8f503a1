"""`mauve check` on files of every kind: what they are, what is wrong and where, the exit status."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from mauve_rt.cli.main import main

Check = Callable[..., tuple[int, list[str], list[str]]]

ROBOT = """\
mauve: 1
components:
  one: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
        alternatives: [executor_tests/Backwards]}
  guard: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
          reconfigurable: false}
resources:
  set: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: set, direction: subscribe}}
connections:
  - [one.set, set.read]
"""
RULES = """\
mauve: 1
rules:
  - name: quiet
    when: {silence: {topic: word, type: std_msgs/msg/String, longer_than_s: 1.0}}
    do:
      - {kind: add_resource, target: spare, value: {kind: shared_data, type: std_msgs/msg/Float64}}
      - {kind: replace_core, target: one, name: executor_tests/Backwards}
    undo:
      do:
        - {kind: replace_core, target: one, name: executor_tests/Counter}
        - {kind: remove_resource, target: spare}
    in: supervisor
"""
STEPS = """\
- {kind: add_resource, target: sum, value: {kind: shared_data, type: std_msgs/msg/Float64,
                                            topic: {name: sum, direction: publish}}}
- {kind: connect, target: one, name: count, value: sum.write}
- {kind: set_property, target: one, name: step, value: 2.0}
"""


REQUIRED = """\
mauve: 1
executor: {wakeup_us: 100, overhead_ns: 20000, require_schedulable: true}
components:
  one: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
        priority: 40, cpus: [0], states: {Count: {wcet_ns: 1000}}}
"""


@pytest.fixture
def check(tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> Check:
    """check(NAME=TEXT, ...): status, lines of stdout and of stderr, the folder's name taken out of them."""

    def run(**texts: str) -> tuple[int, list[str], list[str]]:
        for name, text in texts.items():
            (tmp_path / name).write_text(text, encoding="utf-8")
        status = main(["check", *(str(tmp_path / name) for name in texts)])
        said = capsys.readouterr()
        out, err = (text.replace(f"{tmp_path}/", "").splitlines() for text in (said.out, said.err))
        return status, out, err

    return run


def test_an_architecture_file(check: Check) -> None:
    good = "robot: 2 components, 1 resource, 1 connection: no error found"
    assert check(robot=ROBOT) == (0, [good], [])
    status, out, errors = check(
        robot=ROBOT.replace("CounterFsm", "CounterFms", 1).replace("core:", "kore:", 1)
    )
    assert (status, out) == (2, [])
    assert [line.partition(": ")[0] for line in errors] == ["robot:3:3", "robot:3:45"]


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("longer_than_s: 1.0", "longer_than: 1.0", "4:62", "longer_than is no known key"),
        ("name: quiet", "name: so quiet", "3:11", "a name of letters"),
        ("std_msgs/msg/String", "std_msgs/msg/Strong", "4:41", "std_msgs/msg/Strong is not installed"),
        ("kind: replace_core, target: one", "kind: replace, target: one", "7:16", "found 'replace'"),
        ("mauve: 1", "mauve: 3", "1:8", "mauve"),
    ],
)
def test_a_rules_file_by_itself(check: Check, old: str, new: str, place: str, words: str) -> None:
    assert check(rules=RULES) == (0, ["rules: 1 rule: no error found"], [])
    status, out, errors = check(rules=RULES.replace(old, new, 1))
    assert (status, out) == (2, [])
    assert any(line.startswith(f"rules:{place}: ") and words in line for line in errors), errors


def test_a_steps_file_by_itself(check: Check) -> None:
    assert check(steps=STEPS) == (0, ["steps: 3 steps: no error found"], [])
    status, out, errors = check(steps=STEPS.replace("kind: connect", "kind: conect"))
    assert (status, out) == (2, [])
    assert [line.partition(" ")[0] for line in errors] == ["steps:3:10:"]


def test_steps_in_a_file_with_settings_are_a_steps_file_too(check: Check) -> None:
    whole = "force: true\nsteps:\n" + STEPS
    good = "steps: 3 steps, checked with robot: no error found"
    status, out, errors = check(robot=ROBOT, steps=whole)
    assert (status, out[1:], errors) == (0, [good], [])
    (error,) = check(robot=ROBOT, steps=whole.replace("one, name: count", "two, name: count"))[2]
    assert error.startswith("steps:5:3: step 2 ")


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("target: one, name: count", "target: two, name: count", 3, "component 'two' is unknown"),
        ("sum.write", "sum.wriet", 3, "wriet"),
        ("name: step", "name: stop", 4, "has no property 'stop'; did you mean step?"),
        ("value: 2.0", "value: fast", 4, "expected a number"),
        ("target: one, name: step", "target: guard, name: step", 4, "is protected"),
        ("std_msgs/msg/Float64", "std_msgs/msg/Flaot64", 1, "did you mean std_msgs/msg/Float64?"),
    ],
)
def test_steps_beside_an_architecture_are_tried_on_it(
    check: Check, old: str, new: str, line: int, words: str
) -> None:
    good = "steps: 3 steps, checked with robot: no error found"
    status, out, errors = check(steps=STEPS, robot=ROBOT)  # in any order
    assert (status, out[1:], errors) == (0, [good], [])
    status, out, errors = check(robot=ROBOT, steps=STEPS.replace(old, new, 1))
    assert (status, len(out)) == (2, 1)
    (error,) = errors
    assert error.startswith(f"steps:{line}:3: step ")
    assert words in error


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        ("name: executor_tests/Backwards", "name: executor_tests/Unready", 7, "not declared"),
        ("target: one, name: executor_tests/Counter", "target: two, name: p/C", 10, "'two' is unknown"),
        ("remove_resource, target: spare", "remove_resource, target: spar", 11, "spar"),
    ],
)
def test_rules_beside_an_architecture_do_and_undo(
    check: Check, old: str, new: str, line: int, words: str
) -> None:
    status, out, errors = check(robot=ROBOT, rules=RULES)
    assert (status, out[1:], errors) == (0, ["rules: 1 rule, checked with robot: no error found"], [])
    status, out, errors = check(robot=ROBOT, rules=RULES.replace(old, new, 1))
    assert (status, len(out)) == (2, 1)
    (error,) = errors
    assert error.startswith(f"rules:{line}:")
    assert words in error


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("subscribe, driver_timeout_ms: 200", "expected no such key, as the topic is subscribed"),
        (
            "publish, driver_timeout_ms: 200, qos: {deadline_ms: 201}",
            "expected no less than deadline_ms, which is 201",
        ),
        (
            "publish, driver_timeout_ms: 5",
            "the driver of resource 'out' is safe after 5 ms of silence, and component 'one' writes every ",
        ),
        ("publish, driver_timeout_ms: 0", ""),
        ("publish, driver_timeout_ms: 500, qos: {deadline_ms: 100}", ""),
    ],
)
def test_a_driver_that_could_not_wait(check: Check, said: str, words: str) -> None:
    out = (
        f"  out: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {{name: out, direction: {said}}}}}\n"
    )
    robot = ROBOT.replace("connections:\n", f"{out}connections:\n  - [one.count, out.write]\n")
    status, _, errors = check(robot=robot)
    assert status == (2 if words else 0)
    assert all(words in error for error in errors)
    assert len(errors) == bool(words)


def test_a_subscription_that_no_ordinary_publisher_matches_is_a_warning(check: Check) -> None:
    status, out, errors = check(
        robot=ROBOT.replace("direction: subscribe", "direction: subscribe, qos: {deadline_ms: 200}")
    )
    assert (status, len(out)) == (0, 1)
    (warning,) = errors
    assert warning.startswith(
        "robot:8:103: warning: topic 'set' of resource 'set' will not receive, by its deadline_ms"
    )
    assert "leave it out" in warning


def test_what_is_none_of_them_and_what_does_not_go_together(check: Check, tmp_path: Path) -> None:
    (error,) = check(words="just words")[2]
    assert error.startswith("words:1:1: not an architecture file: expected the keys mauve, ")
    assert check(broken="- {")[0] == 2
    assert main(["check", str(tmp_path / "none.yaml")]) == 2
    status, out, errors = check(robot=ROBOT, other=ROBOT, steps=STEPS)
    assert (status, out) == (2, [])
    assert errors[-1] == "mauve: check steps and rules with one architecture file, not with several"
    assert check(robot=ROBOT, other=ROBOT)[0] == 0


def test_of_several_files_each_is_told(check: Check) -> None:
    status, out, errors = check(robot=ROBOT.replace("core:", "kore:", 1), steps=STEPS, rules="rules: []")
    assert status == 2
    assert out == ["steps: 3 steps: no error found"]  # by itself, as there is nothing to try it on
    assert {line.split(":")[0] for line in errors} == {"robot", "rules"}


def test_a_file_that_requires_what_it_does_not_have_is_warned_of(check: Check) -> None:
    status, out, errors = check(robot=REQUIRED)
    assert (status, len(out), errors) == (0, 1, []), "it is schedulable"
    status, out, errors = check(robot=REQUIRED.replace("wakeup_us: 100, ", ""))
    assert (status, len(out)) == (0, 1)
    [warning] = errors
    assert warning.startswith(
        "robot:2:32: warning: the executor requires schedulable changes, and this file is not provable: "
        "something is missing of this computer"
    )
    assert warning.endswith("robot says what to declare")
    [error] = check(robot=REQUIRED.replace("true", "maybe"))[2]
    assert "require_schedulable" in error
    assert "expected true, false or the word warn, found 'maybe'" in error


def test_a_type_that_the_executor_could_not_load_is_found(
    check: Check, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = tmp_path / "prefix" / "lib" / "libstd_msgs__rosidl_typesupport_c.so"
    library.parent.mkdir(parents=True)
    library.write_bytes(b"no library")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{library.parents[1]}:{os.environ['AMENT_PREFIX_PATH']}")
    status, out, [error] = check(robot=ROBOT)
    assert (status, out) == (2, [])
    assert error.startswith(
        "robot:8:56: resource 'set': type std_msgs/msg/Float64: "
        "the message type is installed, and cannot be loaded; "
        "expected prefix/lib/libstd_msgs__rosidl_typesupport_c.so, found "
    )
    assert error.endswith("source prefix/share/std_msgs/local_setup.bash, then start this program again")
