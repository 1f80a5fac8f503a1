from pathlib import Path

import pytest

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.supervision.rules import RulesFile

GOOD = """\
mauve: 1
executor: executor
rules:
  - name: link_lost
    when: {silence: {topic: radio/in, type: mauve_msgs/msg/PeerMessage, longer_than_s: 1}}
    do: [{kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}]
    undo:
      for_s: 3.0
      do: [{kind: replace_core, target: exploration, name: mauve_examples/Exploration}]
"""


def load(folder: Path, text: str) -> RulesFile:
    path = folder / "rules.yaml"
    path.write_text(text, encoding="utf-8")
    return RulesFile(path)


def test_a_rule_with_its_defaults(tmp_path: Path):
    rules = load(tmp_path, GOOD).rules
    rule = rules.rules[0]
    assert rules.executor == "executor"
    assert (rule.when.kind, rule.when.parameters["longer_than_s"]) == ("silence", 1.0)
    assert (rule.where, rule.priority) == ("executor", 0)
    assert (rule.for_s, rule.cooldown_s) == (0.0, 0.0)
    assert rule.undo is not None
    assert rule.undo.for_s == 3.0
    assert rule.targets() == {"exploration"}


def test_a_tree_of_conditions(tmp_path: Path):
    leaf = GOOD[GOOD.index("{silence") : GOOD.index("    do:")].strip()
    tree = (
        f"{{any: [{leaf}, {{not: {leaf}, for_s: 2}}, {{at_least: {{count: 1, of: [{leaf}]}}}}], within_s: 3}}"
    )
    where = "in: supervisor\n    priority: 7"
    rule = load(tmp_path, GOOD.replace(leaf, f"{tree}\n    {where}", 1)).rules.rules[0]
    assert (rule.where, rule.priority) == ("supervisor", 7)
    assert (rule.when.kind, rule.when.within_s) == ("any", 3.0)
    assert [part.kind for part in rule.when.parts] == ["silence", "not", "at_least"]
    assert (rule.when.parts[1].for_s, rule.when.parts[2].count) == (2.0, 1)
    assert [leaf.kind for leaf in rule.when.leaves()] == ["silence"] * 3
    assert rule.changed(priority=8) != rule
    assert rule.changed() == rule


def test_a_scalar_value_becomes_yaml_text(tmp_path: Path):
    step = "{kind: set_property, target: mapping, name: range, value: 2.5}"
    text = GOOD.replace(
        "{kind: replace_core, target: exploration, name: mauve_examples/LocalExploration}", step
    )
    assert load(tmp_path, text).rules.rules[0].do[0].value == "2.5"


@pytest.mark.parametrize(
    ("old", "new", "place", "word"),
    [
        ("mauve: 1", "mauve: 2", "1:8", "mauve"),
        ("longer_than_s: 1", "longer_than_s: 0", "5:88", "longer_than_s"),
        ("longer_than_s: 1", "longer_than_s: .nan", "5:88", "finite"),
        ("longer_than_s: 1", "longer_than_s: fast", "5:88", "'fast'"),
        ("silence:", "silense:", "5:12", "did you mean silence?"),
        ("type: mauve_msgs/msg/PeerMessage", "type: PeerMessage", "5:45", "type"),
        ("when: {silence", "when: {for_s: 0, silence", "5:19", "greater than 0"),
        ("when: {silence", "when: {any: [], silence", "5:5", "exactly one kind of condition"),
        ("when: {silence", "when: {not: {}} #", "5:12", "exactly one kind of condition"),
        ("when: {silence", "when: {any: []} #", "5:12", "at least 1 item"),
        ("when: {silence", "when: {at_least: {count: 1}} #", "5:12", "of is missing"),
        ("    undo:", "    in: excutor\n    undo:", "7:9", "supervisor"),
        ("    undo:", "    priority: -1\n    undo:", "7:15", "greater than or equal to 0"),
        (
            "silence: {",
            "value: {field: data, topic: in}} #",
            "5:12",
            "expected above, below, or both, found neither",
        ),
        ("silence: {", "value: {field: a b, below: 1, ", "5:27", "a field such as"),
        ("topic: radio/in", "topic: radio//in", "5:29", "a ROS name"),
        ("do: [{kind: replace_core", "do: [{kind: explode", "6:17", "'explode'"),
        (", name: mauve_examples/LocalExploration", "", "6:10", "needs a name"),
        ("for_s: 3.0", "for_s: -1", "8:14", "greater than or equal to 0"),
        ("    undo:", "    cooldown: 1\n    undo:", "7:5", "cooldown"),
        ("- name: link_lost", "- name: link lost", "4:11", "link lost"),
        ("mauve: 1", "mauve: 1\nmauve: 1", "2:1", "twice"),
        ("    undo:", "    max_missed: 1\n    undo:", "7:5", "max_missed is no known key"),
        ("undo:", "undo: [", "", "not YAML"),
    ],
)
def test_bad_files_are_refused_in_one_line_that_points_at_the_place(
    tmp_path: Path, old: str, new: str, place: str, word: str
):
    assert old in GOOD
    with pytest.raises(ArchitectureFileError) as caught:
        load(tmp_path, GOOD.replace(old, new, 1))
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(f"{tmp_path / 'rules.yaml'}:{place}")
    assert word in line


@pytest.mark.parametrize("text", ["", "[]", "just words", "rules: []\nmauve: 1"])
def test_what_is_no_rules_file_is_refused(tmp_path: Path, text: str):
    with pytest.raises(ArchitectureFileError) as caught:
        load(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_two_rules_of_one_name_are_refused(tmp_path: Path):
    second = GOOD[GOOD.index("  - name") :]
    with pytest.raises(ArchitectureFileError, match=r"rules.yaml:10:11: a second rule named 'link_lost'"):
        load(tmp_path, GOOD + second)


def test_a_missing_file_is_refused(tmp_path: Path):
    with pytest.raises(ArchitectureFileError, match="No such file"):
        RulesFile(tmp_path / "none.yaml")


def test_an_error_of_the_user_of_the_file_points_at_the_element(tmp_path: Path):
    error = load(tmp_path, GOOD).error(("rules", 0, "when", "silence", "type"), "not installed")
    assert str(error).endswith("rules.yaml:5:45: not installed")
