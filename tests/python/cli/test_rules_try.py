"""`mauve rules try`: a script played to rules; and what docs/rules.md says of it."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from checked_rules import QUIET, ROBOT, driven, rule

from mauve_rt.cli.main import main

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/rules.md").read_text(encoding="utf-8")
RULES, _, SCRIPT = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
(STORY,) = re.findall(r"```\n( .*?)```", PAGE, re.DOTALL)

Try = Callable[..., tuple[int, str, str]]


@pytest.fixture
def play(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Try:
    """play(rules, script): status, stdout and stderr, the latter without the folder's name."""

    def run(rules: str = RULES, script: str = SCRIPT, *, robot: str = "") -> tuple[int, str, str]:
        for name, text in (("rules", rules), ("script", script), ("robot", robot)):
            (tmp_path / name).write_text(text, encoding="utf-8")
        command = ["rules", "try", str(tmp_path / "rules"), str(tmp_path / "script")]
        status = main(command + (["--architecture", str(tmp_path / "robot")] if robot else []))
        said = capsys.readouterr()
        return status, said.out, said.err.replace(f"{tmp_path}/", "")

    return run


def test_the_story_and_the_timeline_of_the_documentation(play: Try) -> None:
    assert play() == (0, STORY, "")


def test_each_line_of_a_script_tells_of_its_own(play: Try) -> None:
    """An emergency stop beside a topic that repeats its values."""
    value = "{{value: {{topic: {}, type: std_msgs/msg/Float64, field: data, above: {}}}}}"
    do = "    do: [{{kind: replace_core, target: {}, name: p/Safe}}]\n"
    rules = "mauve: 1\nrules:\n"
    for name, topic, above, target in (("estop", "stop", 0.5, "one"), ("hot", "heat", 80, "two")):
        rules += f"  - name: {name}\n    when: {value.format(topic, above)}\n{do.format(target)}"
    lines = ["{topic: stop, from_s: 5.0, value: 1.0}", "{topic: heat, every_s: 1.0, value: 20.0}"]
    for heard in (lines, lines[::-1]):
        status, out, _ = play(rules, f"mauve: 1\nlasts_s: 20\nheard: [{', '.join(heard)}]\n")
        assert status == 0
        assert "5.000 s  estop: condition_true: data of stop is 1" in out
        assert "hot: condition_true" not in out


QUIET_SCRIPT = "mauve: 1\nlasts_s: 4\nheard: [{topic: set_point, every_s: 0.1, until_s: 1.0}]\n"


@pytest.mark.usefixtures("plugin_prefix")
@pytest.mark.parametrize("where", ["executor", "supervisor"])
def test_the_executor_of_an_architecture_acts(play: Try, where: str) -> None:
    rules = "mauve: 1\nrules:\n" + rule(undo="", more=f"    in: {where}\n")
    status, out, error = play(rules, QUIET_SCRIPT, robot=ROBOT)
    assert (status, error) == (0, "")
    assert "2.000 s  quiet: done: do: replace_core one executor_tests/Backwards" in out


@pytest.mark.usefixtures("plugin_prefix")
def test_a_safety_rule_is_tried_as_an_executor_takes_it(play: Try) -> None:
    """What `mauve check` demands of its driver is no refusal of the executor."""
    safety = "    safety: true\n    otherwise: stop\n    in: executor\n"
    rules = "mauve: 1\nrules:\n" + rule(undo="    undo: {for_s: 1.0}\n", more=safety)
    status, out, err = play(rules, QUIET_SCRIPT, robot=driven())
    assert (status, err) == (0, "")
    assert "quiet: done" in out


@pytest.mark.usefixtures("plugin_prefix")
@pytest.mark.parametrize("where", ["executor", "supervisor"])
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("target: one", "target: two", ("5:10", "component 'two' is unknown")),
        ("executor_tests/Backwards", "executor_tests/Backward", ("5:10", "executor_tests/Backward")),
        ("topic: set_point", "topic: set_pont", ("4:29", "did you mean /set_point?")),
    ],
)
def test_a_name_that_the_architecture_lacks_is_refused_with_its_place(
    play: Try, where: str, old: str, new: str, told: tuple[str, str]
) -> None:
    rules = "mauve: 1\nrules:\n" + rule(undo="", more=f"    in: {where}\n").replace(old, new)
    status, out, error = play(rules, QUIET_SCRIPT.replace(old, new), robot=ROBOT)
    assert (status, out) == (2, "")
    place, words = told
    assert error.startswith(f"rules:{place}: ")
    assert words in error


def test_why_nothing_is_done_is_told(play: Try) -> None:
    """The second rule would remove what the first one has connected."""
    steps = (
        "[{kind: connect, target: exploration, name: in, value: map.read}]",
        "[{kind: remove_resource, target: map}]",
    )
    rules = "mauve: 1\nrules:\n"
    for number, (do, limit_s) in enumerate(zip(steps, (1.0, 2.0), strict=True)):
        when = QUIET.replace("set_point", "radio/in").replace("1.0", str(limit_s))
        rules += rule(
            f"r{number}", when, do=do, undo="", more=f"    in: {('executor', 'supervisor')[number]}\n"
        )
    status, out, _ = play(rules)
    assert status == 0
    assert "r1: failed: do failed: refused" in out
    assert "resource map: the resource is still connected" in out


def test_equal_scripts_give_equal_stories(play: Try) -> None:
    assert play() == play()


def test_a_rule_that_lost_is_seen(play: Try) -> None:
    second = (
        RULES[RULES.index("  - name") :].replace("link_lost", "alone").replace("priority: 0", "priority: 1")
    )
    second = second.replace("LocalExploration", "Hovering")
    status, out, _ = play(RULES + second, SCRIPT.replace("until_s: 5.0", "until_s: 2.0"))
    assert status == 0
    assert "link_lost: suppressed: no do: outranked by rule alone (priority 1)" in out
    rows = {line.split()[0]: line for line in out.splitlines() if line.endswith("|")}
    assert "#" in rows["alone"]
    assert "?" in rows["link_lost"]
    assert "#" not in rows["link_lost"]


def test_what_is_about_more_than_cores_is_tried_too(play: Try) -> None:
    do = "do: [{kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}]"
    back = "do: [{kind: replace_core, target: exploration, name: mauve_examples/Exploration}]"
    rules = RULES.replace(do, "do: [{kind: stop, target: camera}, {kind: disconnect, target: a, name: in}]")
    rules = rules.replace(back, "do: [{kind: start, target: camera}]")
    _, out, _ = play(rules)
    assert [line.split(": ")[1] for line in out.splitlines()[:7]] == [
        "armed",
        "condition_true",
        "do",
        "done",
        "condition_false",
        "undo",
        "done",
    ]


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("topic: radio/in, every_s: 0.1, until", "topic: radio/out, every_s: 0.1, until", "4:13", "radio/in"),
        ("lasts_s: 20", "lasts_s: -1", "2:10", "greater than 0"),
        ("lasts_s: 20", "", "1:1", "lasts_s is missing"),
        ("every_s: 0.1, until", "every_s: 0, until", "4:32", "greater than or equal to 0.001"),
        ("heard:", "herd:", "3:1", "did you mean heard?"),
        (
            "{topic: radio/in, every_s: 0.1, until",
            "{state: one, is: FAULTED, until",
            "4:13",
            "no rule has a condition on state one",
        ),
        ("topic: radio/in, every_s: 0.1, until", "state: one, until", "4:5", "heard[0].is is missing"),
        (
            "every_s: 0.1, until",
            "is: gone, until",
            "4:27",
            "what is said of topic has no words: found 'gone'",
        ),
        ("topic: radio/in, every_s: 0.1, until", "peer: b, is: gon, until", "4:19", "did you mean gone?"),
        ("topic: radio/in, every_s: 0.1, until", "peer: b, is: WARN, until", "4:19", "or gone: found 'WARN'"),
        ("every_s: 0.1, until", "resource: a, until", "4:5", "found 'topic and resource'"),
    ],
)
def test_a_bad_script_is_refused_where_it_is_bad(
    play: Try, old: str, new: str, place: str, words: str
) -> None:
    status, out, error = play(script=SCRIPT.replace(old, new, 1))
    assert (status, out) == (2, "")
    assert error.startswith(f"script:{place}: ")
    assert words in error
