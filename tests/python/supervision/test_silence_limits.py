"""Limits of silence that are shorter than two periods of the writer."""

from pathlib import Path

import pytest
from checked_rules import load

from mauve_rt.model import load_architecture
from mauve_rt.supervision.silence_limits import limit_warnings

ROBOT = """\
mauve: 1
components:
  one: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
resources:
  count: {kind: shared_data, type: std_msgs/msg/Float64}
  heard: {kind: shared_data, type: std_msgs/msg/Float64,
          topic: {name: beat, direction: subscribe, qos: {deadline_ms: 500}}}
connections:
  - [one.count, count.write]
  - [one.set, heard.read]
"""


@pytest.mark.parametrize(
    ("leaf", "warned"),
    [
        ("silence: {resource: count, longer_than_s: 0.2}", "two periods of 0.1 s"),
        ("silence: {resource: count, longer_than_s: 0.25}", ""),
        ("silence: {topic: beat, longer_than_s: 1.0}", "two periods of 0.5 s"),
        ("silence: {resource: heard, longer_than_s: 1.0}", "two periods of 0.5 s"),
        ("silence: {topic: beat, longer_than_s: 1.25}", ""),
        ("silence: {topic: other, type: std_msgs/msg/Float64, longer_than_s: 0.001}", ""),
        ("since_change: {longer_than_s: 0.001}", ""),
    ],
)
def test_a_limit_that_one_lost_message_exceeds_is_warned_of(
    tmp_path: Path, plugin_prefix: Path, leaf: str, warned: str
) -> None:
    del plugin_prefix
    robot = tmp_path / "robot"
    robot.write_text(ROBOT, encoding="utf-8")
    found = list(limit_warnings(load(tmp_path, leaf), load_architecture(robot), {"one": 0.1}))
    assert len(found) == (1 if warned else 0)
    if warned:
        assert warned in found[0].text()
        assert found[0].line == 4


def test_of_a_component_whose_period_is_not_known_nothing_is_said(
    tmp_path: Path, plugin_prefix: Path
) -> None:
    del plugin_prefix
    robot = tmp_path / "robot"
    robot.write_text(ROBOT, encoding="utf-8")
    file = load(tmp_path, "silence: {resource: count, longer_than_s: 0.001}")
    assert not list(limit_warnings(file, load_architecture(robot), {}))
    assert not list(limit_warnings(file, load_architecture(robot), {"one": 0.0}))
