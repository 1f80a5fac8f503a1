"""Entries are put into a YAML text, and nothing else of it changes."""

import pytest

from mauve_rt.yaml.insertion import InsertionError, with_entry
from mauve_rt.yaml.text import read_yaml

BLOCK = """\
# the robot
mauve: 1
components:
  one:   # drives
    shell: a/B
    states:  # of its fsm
      Run: {simulated_execution_ns: 7}
  two: {shell: a/B,  # thinks
        core: a/C}
  three: {}
"""


@pytest.mark.parametrize(
    ("place", "line", "text"),
    [
        (["components", "one"], 5, "    x: {y: 1}  # why"),
        (["components", "one", "states"], 7, "      x: {y: 1}  # why"),
        (["components", "one", "states", "Run"], 7, "      Run: {x: {y: 1},  # why"),
        (["components", "one", "states", "Walk"], 7, "      Walk: {x: {y: 1}}  # why"),
        (["components", "two"], 8, "  two: {x: {y: 1},  # why"),
        (["components", "two", "states", "Run"], 8, "  two: {states: {Run: {x: {y: 1}}},  # why"),
        (["components", "three", "states"], 10, "  three: {states: {x: {y: 1}}  # why"),
        ([], 2, "x: {y: 1}  # why"),
    ],
)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_an_entry_is_put_in_and_all_else_stays(place: list[str], line: int, text: str, newline: str) -> None:
    before = BLOCK.replace("\n", newline)
    after = with_entry(before, place, "x", "{y: 1}", comment="why")
    assert after.split(newline)[line - 1] == text
    wanted = read_yaml(before)
    mapping = wanted
    for key in place:
        mapping = mapping.setdefault(key, {})
    mapping["x"] = {"y": 1}
    assert read_yaml(after) == wanted
    added = after.replace(newline, "\n")
    for part in BLOCK.split("\n"):
        assert part.split("{")[0] in added, "nothing of the text is lost"
    assert after.count(newline) == before.count(newline) + 1


@pytest.mark.parametrize(
    ("text", "place", "why"),
    [
        ("a: 1", ["a"], "a is no mapping"),
        ("a: [1]", ["a", "b"], "a is no mapping"),
        ("- 1", [], "the file is no mapping"),
        ("", ["a"], "the file is no mapping"),
        ("a:", ["a"], "a is no mapping"),
        ("a: &one {b: 1}\nc: *one", ["c"], "c is an alias"),
        ("a: &one {b: 1}\nc: *one", ["a"], "a is an alias"),
    ],
)
def test_where_there_is_no_mapping_of_its_own_it_is_refused(text: str, place: list[str], why: str) -> None:
    with pytest.raises(InsertionError, match=why):
        with_entry(text, place, "x", "1")
