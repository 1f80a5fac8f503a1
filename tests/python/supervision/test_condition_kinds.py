"""Every kind of condition in a rules file: how it is told, and what is said of each mistake, and where."""

from pathlib import Path

import pytest
from checked_rules import BEFORE, load

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.supervision.condition_table import conditions, parameters_of
from mauve_rt.supervision.rules import RulesFile
from mauve_rt.supervision.when import When

MARK = "^"  # where the mistake is

GOOD = {
    "silence": [
        "silence: {topic: radio/in, longer_than_s: 1}",
        "silence: {topic: /radio, type: std_msgs/msg/Empty, longer_than_s: 0.5}",
        "silence: {resource: pose, longer_than_s: 1.5}",
    ],
    "link_silence": ["link_silence: {topic: radio/in, longer_than_s: 1}"],
    "value": [
        "value: {topic: battery, field: percentage, below: 0.2, hysteresis: 0.05}",
        "value: {resource: pose, field: 'position[2].x', above: 10, below: -10}",
    ],
    "overruns": [
        "overruns: {component: control}",
        "overruns: {component: control, at_least: 3, within_s: 2}",
    ],
    "late": [
        "late: {component: control, longer_than_s: 0.001}",
        "late: {component: control, what: wake_up, longer_than_s: 0.001, at_least: 5, within_s: 1}",
    ],
    "no_release": ["no_release: {component: control}", "no_release: {component: control, periods: 1}"],
    "fault": ["fault: {component: control}"],
    "over_declared": ["over_declared: {component: control, at_least: 1000}"],
    "peer": ["peer: {executor: robot_2}", "peer: {executor: /robot_2/executor, is: another_instance}"],
    "diagnostic": ["diagnostic: {status: 'battery: cells'}", "diagnostic: {status: gps, level: WARN}"],
    "boolean": [
        "boolean: {topic: armed}",
        "boolean: {topic: state, type: a/msg/State, field: is_up, is: false}",
    ],
    "since_change": [
        "since_change: {longer_than_s: 5}",
        "since_change: {component: control, longer_than_s: 5}",
    ],
    "node_silent": ["node_silent: {}", "node_silent: {longer_than_s: 2}"],
    "action": [
        "action: {resource: drive, is: aborted}",
        "action: {resource: drive, is: overdue, longer_than_s: 5}",
    ],
}

BAD = [
    # together
    (
        "^silence: {longer_than_s: 1}",
        "a condition listens to one thing: expected a topic or a resource, found neither",
    ),
    ("silence: {topic: ^in, resource: pose, longer_than_s: 1}", "found both; name one of them"),
    ("^value: {resource: pose, field: x}", "expected above, below, or both, found neither"),
    ("^value: {field: x, above: 1}", "expected a topic or a resource, found neither"),
    # missing
    ("^link_silence: {longer_than_s: 1}", "link_silence.topic is missing"),
    ("^silence: {topic: in}", "silence.longer_than_s is missing"),
    ("^value: {topic: in, above: 1}", "value.field is missing"),
    ("^overruns: {at_least: 2}", "overruns.component is missing"),
    ("^late: {component: control}", "late.longer_than_s is missing"),
    ("^no_release: {}", "no_release.component is missing"),
    ("^fault: {}", "fault.component is missing"),
    ("^over_declared: {}", "over_declared.component is missing"),
    ("^peer: {is: gone}", "peer.executor is missing"),
    ("^diagnostic: {level: WARN}", "diagnostic.status is missing"),
    ("^boolean: {is: true}", "boolean.topic is missing"),
    ("^since_change: {component: control}", "since_change.longer_than_s is missing"),
    # unknown, and which is nearest
    ("^silense: {}", "no known condition; did you mean silence?"),
    ("silence: {^topc: in, longer_than_s: 1}", "no known key; did you mean topic?"),
    ("value: {topic: in, field: x, ^over: 1}", "no known key; did you mean above?"),
    ("overruns: {component: control, ^atleast: 1}", "did you mean at_least?"),
    ("late: {component: control, longer_than_s: 1, ^waht: wake_up}", "did you mean what?"),
    ("no_release: {component: control, ^period: 3}", "did you mean periods?"),
    ("fault: {^componet: control}", "did you mean component?"),
    ("peer: {^executer: robot_2}", "did you mean executor?"),
    ("diagnostic: {^name: gps}", "known: level, status"),
    ("boolean: {topic: armed, ^feild: data}", "did you mean field?"),
    ("since_change: {^longer_then_s: 5}", "did you mean longer_than_s?"),
    # of another type
    ("silence: {topic: in, longer_than_s: ^long}", "input should be a number: found 'long'"),
    ("silence: {topic: ^in//out, longer_than_s: 1}", "expected a ROS name such as"),
    ("silence: {resource: ^'a b', longer_than_s: 1}", "expected a name of letters"),
    ("value: {topic: in, type: ^Float64, field: x, above: 1}", "expected a message type such as"),
    ("value: {topic: in, field: ^x., above: 1}", "expected a field such as"),
    ("value: {topic: in, field: x, above: ^.inf}", "input should be a finite number"),
    ("overruns: {component: control, at_least: ^1.5}", "input should be a whole number: found 1.5"),
    ("late: {component: control, longer_than_s: 1, what: ^wakeup}", "found 'wakeup'; did you mean wake_up?"),
    ("fault: {component: ^7}", "input should be text: found 7"),
    (
        "peer: {executor: robot_2, is: ^lost}",
        "input should be gone, another_instance, faulted, there or unheard",
    ),
    ("peer: {executor: robot_2, is: ^fault}", "did you mean faulted?"),
    ("diagnostic: {status: gps, level: ^ERR}", "WARN, ERROR or STALE: found 'ERR'; did you mean ERROR?"),
    ("diagnostic: {status: ^''}", "expected text that is not empty"),
    ("boolean: {topic: armed, is: ^yes please}", "input should be true or false"),
    ("fault: ^control", "input should be a mapping: found 'control'"),
    # beyond what it may be
    ("silence: {topic: in, longer_than_s: ^0}", "greater than or equal to 1e-09: found 0"),
    ("value: {topic: in, field: x, above: 1, hysteresis: ^-1}", "greater than or equal to 0.0: found -1"),
    ("overruns: {component: control, at_least: ^0}", "greater than or equal to 1: found 0"),
    ("over_declared: {component: control, at_least: ^1001}", "at most 1000: found 1001"),
    ("late: {component: control, longer_than_s: 1, within_s: ^0}", "greater than or equal to 1e-09"),
    ("no_release: {component: control, periods: ^0.5}", "greater than or equal to 1.0: found 0.5"),
    ("node_silent: {longer_than_s: ^1}", "greater than or equal to 2.0"),
    ("since_change: {longer_than_s: ^-5}", "greater than or equal to 1e-09"),
    ("^action: {resource: drive}", "action.is is missing"),
    ("^action: {resource: drive, is: overdue}", "add longer_than_s"),
    ("action: {resource: drive, is: aborted, longer_than_s: ^1}", "remove longer_than_s"),
    ("action: {resource: drive, is: ^late}", "input should be aborted or overdue: found 'late'"),
]


def only(file: RulesFile) -> When:
    (leaf,) = file.rules.rules[0].when.leaves()
    return leaf


def test_there_is_an_example_and_a_mistake_of_every_kind() -> None:
    assert set(GOOD) == set(conditions())
    assert set(GOOD) == {text.replace(MARK, "").split(":")[0] for text, _ in BAD} - {"silense"}


@pytest.mark.parametrize(("kind", "text"), [(kind, text) for kind, texts in GOOD.items() for text in texts])
def test_each_kind(tmp_path: Path, kind: str, text: str) -> None:
    leaf = only(load(tmp_path, text))
    assert leaf.kind == kind
    said = {name for name, value in leaf.parameters.items() if f"{name}: " in text}
    for name, parameter in parameters_of(kind).items():
        if name not in said:
            assert leaf.parameters[name] == parameter.initial
    assert said >= {name for name, parameter in parameters_of(kind).items() if parameter.required}


@pytest.mark.parametrize(("text", "words"), BAD)
def test_each_mistake(tmp_path: Path, text: str, words: str) -> None:
    column = len(BEFORE) + text.index(MARK) + 1
    with pytest.raises(ArchitectureFileError) as caught:
        load(tmp_path, text.replace(MARK, ""))
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(f"{tmp_path / 'rules.yaml'}:4:{column}: ")
    assert words in line
    assert line.count("expected") <= 1, "the facts are told once"


def test_a_supervisor_has_to_be_told_the_type_of_a_topic(tmp_path: Path) -> None:
    text = "silence: {topic: in, longer_than_s: 1}"
    assert only(load(tmp_path, text)).parameters["type"] is None
    with pytest.raises(ArchitectureFileError) as caught:
        load(tmp_path, text, where="supervisor")
    column = len(BEFORE) + text.index("in,") + 1
    assert f":4:{column}: rules[0].when.silence.type is missing" in str(caught.value)
    assert "add the type of the topic" in str(caught.value)
    load(tmp_path, "boolean: {topic: armed}", where="supervisor")  # it has one by default
