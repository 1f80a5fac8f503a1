"""`mauve rules check` of who runs a rule: what the executor can neither hear nor make ready."""

import pytest
from checked_rules import ROBOT, Check, rule

from mauve_rt.model.step_kinds import STEP_KINDS
from mauve_rt.supervision.condition_table import conditions

# A component without a period, and resources of which the executor cannot hear everything.
MORE = """\
executor: {peers: [robot_2, ground]}
components:
  eager: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/EventFsm}
"""
WIDE = ROBOT.replace("components:\n", MORE).replace(
    "connections:",
    """\
  told: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: told, direction: publish}}
  lamp: {kind: executor_tests/Lamp}
  drive: {kind: action_server, type: mauve_msgs/action/DriveTo, action: {name: drive}}
connections:
  - [eager.set, set.read]""",
)
WHEN = "    when: {"

HEARD = {  # by the executor itself
    "silence": "silence: {topic: set_point, longer_than_s: 1}",
    "link_silence": "link_silence: {topic: set_point, longer_than_s: 1}",
    "value": "value: {resource: told, field: data, above: 1}",
    "overruns": "overruns: {component: eager}",
    "late": "late: {component: eager, longer_than_s: 0.001}",
    "no_release": "no_release: {component: one}",
    "fault": "fault: {component: eager}",
    "over_declared": "over_declared: {component: eager}",
    "boolean": "boolean: {topic: set_point, type: std_msgs/msg/Float64}",
    "since_change": "since_change: {component: eager, longer_than_s: 5}",
    "node_silent": "node_silent: {longer_than_s: 5}",
    "action": "action: {resource: drive, is: overdue, longer_than_s: 5}",
}
OUTSIDE = {
    "peer": "^peer: {executor: robot_2}",
    "diagnostic": "^diagnostic: {status: gps}",
}


def checked(check: Check, leaf: str, *, where: str = "executor", robot: str = WIDE) -> list[str]:
    """What is wrong with a rule that waits for this, and no bound."""
    undo = "    undo: {for_s: 1.0}\n"
    text = rule(undo=undo, when=f"{{{leaf.replace('^', '')}}}", more=f"    in: {where}\n    cooldown_s: 1\n")
    status, _, errors = check(text, robot=robot)
    assert status == bool(errors)
    return errors


def place(leaf: str) -> str:
    return f"rules:4:{len(WHEN) + leaf.index('^') + 1}: "


def test_every_kind_is_heard_by_one_of_the_two() -> None:
    assert {*HEARD, *OUTSIDE} == set(conditions())


@pytest.mark.parametrize("kind", HEARD)
def test_what_the_executor_hears(check: Check, kind: str) -> None:
    assert checked(check, HEARD[kind]) == []


@pytest.mark.parametrize("kind", OUTSIDE)
def test_what_only_the_outside_can_see(check: Check, kind: str) -> None:
    for robot in (WIDE, ""):
        (error,) = checked(check, OUTSIDE[kind], robot=robot)
        assert error.startswith(f"{place(OUTSIDE[kind])}an executor's own rules cannot receive a")
        assert error.endswith("; give the rule `in: supervisor`")
    assert checked(check, OUTSIDE[kind], where="supervisor") == []


@pytest.mark.parametrize(
    ("leaf", "words"),
    [
        # nobody brings it
        (
            "silence: {topic: ^scan, longer_than_s: 1}",
            "no resource of the architecture takes the messages of topic scan",
        ),
        ("silence: {topic: ^told, longer_than_s: 1}", "or give the rule `in: supervisor`"),  # it is published
        ("boolean: {topic: ^armed}", "bind one to it (topic: {name: armed, direction: subscribe})"),
        # no number, or none at a place of its own
        (
            "^value: {resource: lamp, field: on, above: 0}",
            "resource lamp: the resource has no number there",
        ),
        ("value: {topic: set_point, field: ^date, above: 0}", "has no field 'date'; did you mean data?"),
        # no such name
        ("silence: {topic: ^set_pont, longer_than_s: 1}", "did you mean /set_point?"),
        ("silence: {resource: ^sett, longer_than_s: 1}", "resource 'sett' is unknown; did you mean set?"),
        ("value: {resource: ^tolt, field: data, above: 1}", "did you mean told?"),
        ("overruns: {component: ^eagar}", "component 'eagar' is unknown; did you mean eager?"),
        ("late: {component: ^set, longer_than_s: 1}", "component 'set' is unknown"),
        ("no_release: {component: ^ona}", "did you mean one?"),
        ("fault: {component: ^ona}", "did you mean one?"),
        ("over_declared: {component: ^ona}", "did you mean one?"),
        ("since_change: {component: ^ona, longer_than_s: 5}", "did you mean one?"),
        # of another type
        (
            "silence: {topic: set_point, type: ^std_msgs/msg/Empty, longer_than_s: 1}",
            "is of another type in the architecture: expected std_msgs/msg/Float64, found std_msgs/msg/Empty",
        ),
        (
            "value: {resource: told, type: ^std_msgs/msg/Int32, field: data, above: 1}",
            "resource told is of another type",
        ),
        ("^boolean: {topic: set_point}", "expected std_msgs/msg/Float64, found std_msgs/msg/Bool"),
        # no goals
        (
            "^action: {resource: told, is: aborted}",
            "the resource has no goals: expected an action_server or an action_client, found shared_data",
        ),
        ("action: {resource: ^driv, is: aborted}", "resource 'driv' is unknown; did you mean drive?"),
        # no period to miss
        ("^no_release: {component: eager}", "has no period: none of its releases can be missed"),
    ],
)
def test_what_the_executor_cannot_hear(check: Check, leaf: str, words: str) -> None:
    errors = checked(check, leaf)
    assert len(errors) == 1, errors
    assert errors[0].startswith(place(leaf))
    assert words in errors[0]


@pytest.mark.parametrize(
    ("leaf", "words"),
    [
        (
            "peer: {executor: ^robot_3}",
            "executor 'robot_3' is none of the architecture's peers; did you mean robot_2?",
        ),
        ("peer: {executor: ^/grund/executor}", "did you mean ground?"),
        ("value: {topic: set_point, type: ^std_msgs/msg/Float65, field: data, above: 1}", "is not installed"),
    ],
)
def test_what_the_supervisor_is_told_wrongly(check: Check, leaf: str, words: str) -> None:
    errors = checked(check, leaf, where="supervisor")
    assert any(error.startswith(place(leaf)) and words in error for error in errors), errors


def test_only_the_executor_knows_goals(check: Check) -> None:
    leaf = "^action: {resource: drive, is: aborted}"
    for robot in (WIDE, ""):
        text = rule(undo="", when="{action: {resource: drive, is: aborted}}", more="    in: supervisor\n")
        status, _, (error,) = check(text, robot=robot)
        assert status == 2
        assert error.startswith(f"{place(leaf)}only in the executor the goals of resource drive are known")
        assert error.endswith("`in: executor`")


def test_peers_by_their_namespaces_or_from_there_on_down(check: Check) -> None:
    for name in ("robot_2", "/robot_2", "/ground/executor"):
        assert checked(check, f"peer: {{executor: {name}}}", where="supervisor") == []


STEPS = {
    "add_component": "target: more, value: {shell: executor_tests/CounterShell, "
    "core: executor_tests/Counter, fsm: executor_tests/CounterFsm}",
    "add_resource": "target: more, value: {kind: shared_data, type: std_msgs/msg/Float64}",
    "configure": "target: eager",
    "resynchronise": "",
    "shadow": "target: eager, name: executor_tests/Backwards, value: {budget_us: 50}",
    "end_shadow": "target: eager",
    "promote": "target: eager",
}


@pytest.mark.parametrize("step", STEPS)
def test_steps_that_the_executor_cannot_make_ready(check: Check, step: str) -> None:
    do = f"[{{kind: {step}, {STEPS[step]}}}]"
    _, _, (error,) = check(rule(undo="", do=do))
    assert error.startswith(f"rules:5:10: the executor cannot make a step of kind {step} ready for a rule")
    assert "give the rule `in: supervisor`" in error
    assert check(rule(undo="", do=do, more="    in: supervisor\n"))[0] == 0
    assert error in check(rule(undo="", do=do), robot=WIDE)[2]
    _, _, errors = check(rule(undo=f"    undo: {{for_s: 1, do: {do}}}\n"), robot=WIDE)
    assert errors[0].startswith("rules:6:27: the executor cannot make")


@pytest.mark.parametrize("value", ["{bumpless: {outputs: {count.data: 1}, blend_s: 1}}", "{probation_s: 1}"])
def test_options_that_the_executor_cannot_make_ready(check: Check, value: str) -> None:
    do = f"[{{kind: replace_core, target: one, name: executor_tests/Backwards, value: {value}}}]"
    for robot in (WIDE, ""):
        _, _, (error,) = check(rule(undo="", do=do), robot=robot)
        assert error.startswith("rules:5:")
        assert "replaces a core at once: with neither a probation nor `bumpless`" in error
        assert error.endswith("; give the rule `in: supervisor`")
    assert check(rule(undo="", do=do, more="    in: supervisor\n"))[0] == 0


def test_all_other_steps_can_be_made_ready() -> None:
    assert set(STEPS) == {kind for kind, what in STEP_KINDS.items() if not what.is_prepared}
