"""What a script tells to the signals of each kind of condition."""

from pathlib import Path

import pytest
from checked_rules import load

from mauve_rt.supervision.condition_table import conditions
from mauve_rt.supervision.script import Heard
from mauve_rt.supervision.when_spec import heard

# A condition, what tells it something, and the values told.
TOLD = [
    ("silence: {topic: in, longer_than_s: 1}", {"topic": "in", "every_s": 1.0}, [0.0, 0.0, 0.0]),
    ("link_silence: {topic: in, longer_than_s: 1}", {"topic": "in", "every_s": 1.0}, [0.0, 0.0, 0.0]),
    ("silence: {resource: in, longer_than_s: 1}", {"resource": "in", "from_s": 1.5}, [0.0]),
    ("value: {topic: in, field: x, above: 1}", {"topic": "in", "value": 3.5}, [3.5]),
    ("boolean: {topic: in}", {"topic": "in", "value": 1.0}, [1.0]),
    ("overruns: {component: one}", {"overruns": "one", "every_s": 1.0, "until_s": 1.0}, [1.0, 2.0]),
    ("late: {component: one, longer_than_s: 1}", {"late": "one", "every_s": 1.0}, [1.0, 2.0, 3.0]),
    ("over_declared: {component: one}", {"over_declared": "one"}, [1.0]),
    ("no_release: {component: one}", {"released": "one", "every_s": 0.8}, [0.8, 0.8, 0.8]),
    ("fault: {component: one}", {"state": "one", "is": "FAULTED"}, [5.0]),
    ("peer: {executor: b}", {"peer": "b", "is": "gone"}, [4.0]),
    ("diagnostic: {status: gps}", {"diagnostic": "gps", "is": "ERROR"}, [2.0]),
    ("since_change: {longer_than_s: 1}", {"change": ""}, [0.0]),
    ("since_change: {component: one, longer_than_s: 1}", {"change": "one"}, [0.0]),
    ("action: {resource: drive, is: aborted}", {"goal": "drive", "is": "aborted"}, [1.0]),
    ("action: {resource: drive, is: aborted}", {"goal": "drive", "is": "executing"}, [0.0]),
    ("action: {resource: drive, is: overdue, longer_than_s: 1}", {"goal": "drive", "is": "executing"}, [1.0]),
    ("action: {resource: drive, is: overdue, longer_than_s: 1}", {"goal": "drive", "is": "aborted"}, [0.0]),
    ("node_silent: {longer_than_s: 2}", {"node": "", "every_s": 1.0}, [0.0, 0.0, 0.0]),
]


def test_every_kind_can_be_told_something() -> None:
    assert {leaf.partition(":")[0] for leaf, _, _ in TOLD} == set(conditions())


@pytest.mark.parametrize(("leaf", "said", "values"), TOLD)
def test_what_is_told(tmp_path: Path, leaf: str, said: dict[str, object], values: list[float]) -> None:
    told = Heard(**said)
    (condition,) = load(tmp_path, leaf).rules.rules[0].when.leaves()
    signal, *_ = heard(condition)
    assert told.tells(signal)
    assert [told.value_for(signal, value) for _, value in told.samples(2.0)] == values
    assert not Heard(topic="another").tells(signal)
