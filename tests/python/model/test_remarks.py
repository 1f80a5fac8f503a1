"""The warnings of `mauve check`: each with its line, and none for what is meant."""

from collections.abc import Callable
from pathlib import Path

import pytest

from mauve_rt.cli.main import main

ROOT = Path(__file__).resolve().parents[3]
MISSION = ROOT / "mauve_examples" / "architecture"
WORST_CASES = {
    "Robot": "Move: {wcet_ns: 200000}",
    "Control": "Control: {wcet_ns: 600000}",
    "Mapping": "Integrate: {wcet_ns: 2000000}",
}
ROBOT = (MISSION / "robot.yaml").read_text(encoding="utf-8").replace("../maps", str(MISSION.parent / "maps"))
for core, times in WORST_CASES.items():
    line = f"    core: mauve_examples/{core}\n"
    assert ROBOT.count(line) == 1, line
    ROBOT = ROBOT.replace(line, f"{line}    states: {{{times}}}\n")
RULES = (MISSION / "supervisor.yaml").read_text(encoding="utf-8")
TWIST = "{kind: shared_data, type: geometry_msgs/msg/Twist}"
Check = Callable[..., list[str]]


@pytest.fixture
def check(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Check:
    """check(NAME=TEXT, ...): the lines of stderr; the exit status is 0."""
    monkeypatch.chdir(tmp_path)

    def run(**texts: str) -> list[str]:
        for name, text in texts.items():
            (tmp_path / name).write_text(text, encoding="utf-8")
        status = main(["check", *texts])
        said = capsys.readouterr()
        assert status == 0, said.err
        return said.err.splitlines()

    return run


def changed(*changes: tuple[str, str], text: str = ROBOT) -> str:
    for before, after in changes:
        assert text.count(before) == 1, before
        text = text.replace(before, after)
    return text


def line_of(text: str, part: str) -> str:
    return str(text[: text.index(part)].count("\n") + 1)


def resource(name: str, what: str) -> tuple[str, str]:
    return "resources:\n", f"resources:\n  {name}: {what}\n"


MOVE, CONTROL = "Move: {wcet_ns: 200000}", "Control: {wcet_ns: 600000}"
GOAL = "topic: {name: goal, direction: "
CASES: dict[str, tuple[list[tuple[str, str]], str, str]] = {
    "optional port": (
        [("  - [control.scan, scan.read]\n", "")],
        "control:",
        "optional port 'control.scan' is not connected, and resource 'scan' fits it; add [control.scan, scan",
    ),
    "unused": (
        [resource("spare", TWIST)],
        "spare:",
        "resource 'spare' is not used: no port is connected to it; connect a writer and a reader, or remove",
    ),
    "no reader": (
        [("topic: {name: done, direction: publish, qos: reliable}", "max_bytes: 64")],
        "done:",
        "resource 'done' is written, and no component, topic, mirror or recording reads it; connect a reader",
    ),
    "no writer": (
        [resource("other", TWIST), ("robot.command, command.read", "robot.command, other.read")],
        "other:",
        "resource 'other' is read, and no component or topic writes it; connect a writer, or bind it",
    ),
    "two writers": (
        [(f"{GOAL}publish", f"{GOAL}subscribe")],
        "goal:",
        "resource 'goal' has 2 writers, exploration and topic goal: the last one counts; connect one of",
    ),
    "long job": (
        [(CONTROL, "Control: {wcet_ns: 21000000}")],
        "wcet_ns: 21000000}",
        "component 'control' declares 21.000 ms for Control, and has 20.000 ms from release to Pause; short",
    ),
    "full CPU": (
        [(MOVE, "Move: {wcet_ns: 8000000}"), (CONTROL, "Control: {wcet_ns: 9000000}")],
        "cpus: [0]",
        "the components on CPU 0 declare up to 140% of its time: robot 90%, control 45%, guidance 1%",
    ),
    "priorities": (
        [("    priority: 50\n", "    priority: 75\n")],
        "priority: 70",
        "component 'control' (20.000 ms, priority 70) waits on CPU 0 for 'mapping' (100.000 ms",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_warning_names_its_line_and_a_remedy(case: str, check: Check) -> None:
    changes, part, words = CASES[case]
    text = changed(*changes)
    (warning,) = [line for line in check(robot=text) if words in line]
    place, _, said = warning.partition(" ")
    assert said.startswith(f"warning: {words}")
    _, line, column, _ = place.split(":")
    assert text.splitlines()[int(line) - 1][int(column) - 1 :].startswith(part)


# What makes each of them meant: changes of the architecture, and changes of the rules beside it.
IN_STEP = "kind: replace_core, target: exploration, name: mauve_examples/LocalExploration"
IN_WHEN = "topic: radio/in, type: mauve_msgs/msg/PeerMessage"
EXECUTOR = "peers: []"
CONNECTED = (
    "}, {kind: disconnect, target: robot, name: command}"
    ", {kind: connect, target: robot, name: command, value: spare.read"
)
MEANT: dict[str, tuple[str, list[tuple[str, str]], list[tuple[str, str]]]] = {
    "a rule stops a writer": ("two writers", [], [(IN_STEP, "kind: stop, target: exploration")]),
    "a rule stops the component": ("optional port", [], [(IN_STEP, "kind: stop, target: control")]),
    "recorded": ("no reader", [(EXECUTOR, "peers: [], record: [done]")], []),
    "mirrored by its port": ("no reader", [(EXECUTOR, "peers: [], mirror: [exploration.done]")], []),
    "in a condition": ("no reader", [], [(IN_WHEN, "resource: done")]),
    "a rule connects it": (
        "unused",
        [],
        [(IN_STEP, IN_STEP + CONNECTED)],
    ),
    "a deadline before that of the other": (
        "priorities",
        [("states: {Integrate", "deadline_ns: 15000000\n    states: {Integrate")],
        [],
    ),
    "a deadline after the period": (
        "long job",
        [("states: {Control", "deadline_ns: 30000000\n    states: {Control")],
        [],
    ),
}


@pytest.mark.parametrize("name", MEANT)
def test_what_is_meant_has_no_warning(name: str, check: Check) -> None:
    case, more, of_rules = MEANT[name]
    changes, _, words = CASES[case]
    files = {"rules": changed(*of_rules, text=RULES)} if of_rules else {}
    text = changed(*changes)
    assert any(words in line for line in check(robot=text))
    assert not any(words in line for line in check(robot=changed(*more, text=text), **files))


def test_an_alternative_that_no_given_rule_puts_in(check: Check) -> None:
    assert check(robot=ROBOT) == []
    assert check(robot=ROBOT, rules=RULES) == []
    line = line_of(ROBOT, "alternatives: [mauve_examples/LocalExploration]")
    what = "no rule or step of these files puts alternative mauve_examples/LocalExploration into component"
    (warning,) = check(robot=ROBOT, rules=changed((IN_STEP, "kind: stop, target: exploration"), text=RULES))
    assert warning == f"robot:{line}:20: warning: {what} 'exploration'; remove it, or add the rule"
    fallback = ("    alternatives:", "    fallback: mauve_examples/LocalExploration\n    alternatives:")
    rules = changed((IN_STEP, "kind: stop, target: exploration"), text=RULES)
    assert check(robot=changed(fallback), rules=rules) == []


def test_a_rule_on_a_topic_that_nothing_here_publishes(check: Check) -> None:
    spare = "{kind: shared_data, type: std_msgs/msg/Bool, topic: {name: spare, direction: publish}}"
    outside = ("in: executor", "in: supervisor")  # in the executor a rule needs a topic that is received
    rules = changed((IN_WHEN, "topic: spare, type: std_msgs/msg/Bool"), outside, text=RULES)
    warnings = check(robot=changed(resource("spare", spare)), rules=rules)
    what = "rule 'link_lost': resource 'spare' publishes topic spare, and no component writes it"
    assert f"rules:9:29: warning: {what}; connect a writer to spare.write in robot" in warnings
    published = changed((IN_WHEN, "topic: done, type: std_msgs/msg/Bool"), outside, text=RULES)
    of_others = changed((IN_WHEN, "topic: battery, type: std_msgs/msg/Bool"), outside, text=RULES)
    assert check(robot=ROBOT, rules=published) == check(robot=ROBOT, rules=of_others) == []


@pytest.mark.parametrize(
    "names", [["robot.yaml"], ["robot.yaml", "supervisor.yaml"], ["rover.yaml"], ["metronome.yaml"]]
)
def test_the_mission_has_no_warning(names: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", *(str(MISSION / name) for name in names)]) == 0
    assert capsys.readouterr().err == ""


def test_the_one_component_of_a_first_program_needs_no_reader(check: Check) -> None:
    text = (MISSION / "metronome.yaml").read_text(encoding="utf-8")
    alone = changed((", topic: {name: beat, direction: publish}", ""), text=text)
    assert check(metronome=alone) == []
