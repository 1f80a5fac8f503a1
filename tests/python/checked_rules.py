"""What tests of rules files share: an architecture, a rule about it, and a file for one condition."""

from collections.abc import Callable
from pathlib import Path

from mauve_rt.supervision.rules import RulesFile

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
UNDO = "    undo: {for_s: 1.0, do: [{kind: replace_core, target: one, name: executor_tests/Counter}]}\n"


def rule(name: str = "quiet", when: str = QUIET, *, more: str = "", undo: str = UNDO, do: str = "") -> str:
    do = do or "[{kind: replace_core, target: one, name: executor_tests/Backwards}]"
    return f"  - name: {name}\n    when: {when}\n    do: {do}\n{undo}{more}"


BEFORE = "    when: {"


def load(folder: Path, leaf: str, *, where: str = "executor") -> RulesFile:
    """A file with one rule that waits for this; in line 4, behind BEFORE."""
    path = folder / "rules.yaml"
    do = "do: [{kind: stop, target: camera}]"
    path.write_text(
        f"mauve: 1\nrules:\n  - name: one\n{BEFORE}{leaf}}}\n    {do}\n    in: {where}\n", encoding="utf-8"
    )
    return RulesFile(path)


def driven(qos: str = "") -> str:
    """The robot of the other tests, with an output on a topic."""
    topic = f"{{name: motor, direction: publish{qos}}}"
    out = f"  out: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {topic}}}\n"
    return ROBOT.replace("connections:\n", f"{out}connections:\n  - [one.count, out.write]\n")
