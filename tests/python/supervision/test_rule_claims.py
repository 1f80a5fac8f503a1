"""Which conditions exclude each other: what `mauve rules check` calls impossible has to be that."""

import pytest

from mauve_rt.file_schema.kinds import Faults
from mauve_rt.supervision.rule_logic import can_meet, clash_in
from mauve_rt.supervision.when import When, WhenPart
from mauve_rt.yaml.text import read_yaml


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("overruns: {component: one, at_least: 3}", "not: {overruns: {component: one, at_least: 2}}"),
        (
            "late: {component: one, longer_than_s: 1, at_least: 2}",
            "not: {late: {component: one, longer_than_s: 1}}",
        ),
        ("over_declared: {component: one}", "not: {over_declared: {component: one}}"),
        ("no_release: {component: one, periods: 5}", "not: {no_release: {component: one, periods: 3}}"),
        ("fault: {component: one}", "not: {fault: {component: one}}"),
        ("peer: {executor: robot_2, is: there}", "peer: {executor: robot_2}"),
        ("diagnostic: {status: gps}", "not: {diagnostic: {status: gps, level: WARN}}"),
        ("boolean: {topic: armed}", "boolean: {topic: armed, is: false}"),
        ("since_change: {longer_than_s: 5}", "not: {since_change: {longer_than_s: 4}}"),
        ("silence: {resource: in, longer_than_s: 5}", "not: {silence: {resource: in, longer_than_s: 5}}"),
        ("node_silent: {longer_than_s: 5}", "not: {node_silent: {longer_than_s: 4}}"),
        ("action: {resource: drive, is: aborted}", "not: {action: {resource: drive, is: aborted}}"),
        (
            "action: {resource: drive, is: overdue, longer_than_s: 5}",
            "not: {action: {resource: drive, is: overdue, longer_than_s: 4}}",
        ),
        (
            "value: {topic: in, field: x, above: 5}",
            "not: {value: {topic: in, type: std_msgs/msg/Header, field: x, above: 4}}",
        ),
    ],
)
def test_contradictions_of_each_kind(first: str, second: str) -> None:
    one, other = read(first), read(second)
    both = When("all", parts=(one, other))
    assert not can_meet(one, other)
    clash = clash_in(both)
    assert clash is not None
    assert str(clash).endswith("exclude each other")


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("overruns: {component: one, at_least: 2}", "not: {overruns: {component: one, at_least: 3}}"),
        ("overruns: {component: one, within_s: 5}", "not: {overruns: {component: one, within_s: 1}}"),
        ("overruns: {component: one}", "not: {overruns: {component: two}}"),
        # rarer, but each longer
        (
            "late: {component: one, longer_than_s: 2}",
            "not: {late: {component: one, longer_than_s: 1, at_least: 3}}",
        ),
        (
            "late: {component: one, longer_than_s: 1}",
            "not: {late: {component: one, longer_than_s: 1, what: wake_up}}",
        ),
        ("fault: {component: one}", "not: {fault: {component: two}}"),
        ("peer: {executor: robot_2}", "peer: {executor: robot_3, is: there}"),
        ("peer: {executor: robot_2}", "not: {peer: {executor: robot_2, is: there}}"),
        ("diagnostic: {status: gps, level: WARN}", "not: {diagnostic: {status: gps}}"),
        ("since_change: {component: one, longer_than_s: 5}", "not: {since_change: {longer_than_s: 4}}"),
        ("silence: {resource: in, longer_than_s: 5}", "not: {silence: {topic: in, longer_than_s: 5}}"),
        (
            "action: {resource: drive, is: aborted}",
            "action: {resource: drive, is: overdue, longer_than_s: 5}",
        ),
        ("value: {topic: in, field: x, above: 5}", "value: {topic: in, field: y, below: 4}"),
    ],
)
def test_what_can_be_at_once(first: str, second: str) -> None:
    assert can_meet(read(first), read(second))


def read(text: str) -> When:
    faults: Faults = []
    tree = WhenPart().read(read_yaml(f"{{{text}}}"), (), faults)
    assert not faults
    assert isinstance(tree, When)
    return tree
