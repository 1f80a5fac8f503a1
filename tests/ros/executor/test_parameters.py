"""Properties as ROS parameters: declared, described, set by the kernel or refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterDescriptor, ParameterEvent, ParameterType, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_value_to_python

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure

NODE = "/robot_1/executor"
PARTS = "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm"
ARCHITECTURE = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  counter: {PARTS}, properties: {{step: 1.5, label: file}},
            alternatives: [executor_tests/TwinShell, executor_tests/Twin, executor_tests/TwinFsm]}}
  guard: {PARTS}, reconfigurable: false}}
"""
FILE = """\
/robot_1/executor: {ros__parameters: {counter: {label: "of the robot's file", period_ms: 5}}}
/robot_2/executor: {ros__parameters: {counter: {label: of another robot}}}
"""


class Face:
    """An executor's parameters, and what is told of them."""

    def __init__(self, graph: Any) -> None:
        self._graph = graph
        self.heard = graph.hear(ParameterEvent, "/parameter_events")

    def names(self) -> list[str]:
        listed = self._graph.ask(ListParameters, f"{NODE}/list_parameters").result.names
        return sorted(name for name in listed if name.partition(".")[0] in ("counter", "guard", "second"))

    def get(self, *names: str) -> list[object]:
        values = self._graph.ask(GetParameters, f"{NODE}/get_parameters", names=names).values
        return [parameter_value_to_python(value) for value in values]

    def describe(self, name: str) -> ParameterDescriptor:
        return self._graph.ask(DescribeParameters, f"{NODE}/describe_parameters", names=[name]).descriptors[0]

    def set(self, **values: object) -> list[Any]:
        return list(
            self._graph.ask(SetParameters, f"{NODE}/set_parameters", parameters=_messages(values)).results
        )

    def set_all(self, **values: object) -> Any:
        return self._graph.ask(
            SetParametersAtomically, f"{NODE}/set_parameters_atomically", parameters=_messages(values)
        ).result

    def await_told(self, kind: str, **values: object) -> None:
        """Until one event tells exactly these as `kind`: new, changed or deleted."""
        wanted = {name.replace("__", "."): value for name, value in values.items()}

        def told() -> bool:
            return any(
                {
                    item.name: parameter_value_to_python(item.value)
                    for item in getattr(event, f"{kind}_parameters")
                }
                == wanted
                for event in self.heard
            )

        self._graph.spin_until(told, f"{kind} {wanted} in /parameter_events")


def _messages(values: dict[str, object]) -> list[Any]:
    return [
        value
        if isinstance(value, ParameterMessage)
        else Parameter(name.replace("__", "."), value=value).to_parameter_msg()
        for name, value in values.items()
    ]


def _listed(graph: Any) -> Any:
    """The kernel's properties by component.property, as YAML, and the revision."""
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    properties = {
        f"{part.name}.{name}": value
        for part in reply.components
        for name, _, value in (item.partition("=") for item in part.properties)
    }
    return properties, reply.revision


def _change(graph: Any, transition: int) -> None:
    assert graph.ask(ChangeState, f"{NODE}/change_state", transition=Transition(id=transition)).success


@pytest.fixture
def face(tmp_path: Path, start_executor: Callable[..., Any], graph: Any) -> Face:
    (tmp_path / "robot.yaml").write_text(ARCHITECTURE, encoding="utf-8")
    (tmp_path / "parameters.yaml").write_text(FILE, encoding="utf-8")
    face = Face(graph)
    start_executor(
        *(
            "--params-file",
            str(tmp_path / "parameters.yaml"),
            "-p",
            f"architecture:={tmp_path / 'robot.yaml'}",
        ),
        *("-p", "counter.step:=2", "-p", "report_phase_timeout_s:=0.0"),
    )
    graph.ask(ListComponents, f"{NODE}/list_components")
    graph.spin_until(lambda: bool(face.names()), "the parameters")
    return face


def test_parameters_are_the_properties(face: Face, graph: Any) -> None:
    properties = ["enabled", "label", "list_file", "period_ms", "step"]
    assert face.names() == [f"{part}.{name}" for part in ("counter", "guard") for name in properties]
    given = ["counter.step", "counter.label", "counter.period_ms", "counter.enabled", "guard.step"]
    assert face.get(*given) == [2.0, "of the robot's file", 5, True, 1.0]
    step = face.describe("counter.step")
    assert (step.type, step.description) == (ParameterType.PARAMETER_DOUBLE, "[1]")
    (limits,) = step.floating_point_range
    assert (limits.from_value, limits.to_value) == (0.0, 10.0)
    assert "reconfigurable: false" in face.describe("guard.step").additional_constraints
    _changes_are_the_kernel_s(face, graph)
    _refusals_change_nothing(face, graph)
    _parameters_follow_requests(face, graph)
    _parameters_follow_the_life_cycle(face, graph)


def _changes_are_the_kernel_s(face: Face, graph: Any) -> None:
    events = graph.hear_events(NODE)
    _, revision = _listed(graph)
    odd = 'a: "b"\n\t\x7f\u2028é 😀 \\'
    assert [result.successful for result in face.set(counter__step=4, counter__label=odd)] == [True, True]
    assert face.get("counter.step", "counter.label") == [4.0, odd], "an integer serves as a float"
    face.await_told("changed", counter__step=4.0)
    face.await_told("changed", counter__label=odd)
    properties, after = _listed(graph)
    assert (properties["counter.step"], after) == ("4.0", revision + 2)
    assert face.set_all(counter__step=5.0, counter__enabled=False).successful
    face.await_told("changed", counter__step=5.0, counter__enabled=False)
    properties, after = _listed(graph)
    assert (properties["counter.step"], properties["counter.enabled"], after) == (
        "5.0",
        "false",
        revision + 3,
    )
    graph.spin_until(lambda: len(events) == 3, "their events")
    assert [event.success for event in events] == [True] * 3
    assert events[2].request == "set_property counter step 5.0; set_property counter enabled false"
    assert events[2].cause == "parameters set: counter.step, counter.enabled"


def test_a_value_gets_its_declared_type(face: Face) -> None:
    """ros2cli sends `5e-06` as text, `2` as an integer, and `[]` as an array of bytes."""
    assert face.set(counter__step="5e-06")[0].successful
    assert face.set(counter__label="007")[0].successful
    assert face.get("counter.step", "counter.label") == [5e-06, "007"]
    assert face.set(counter__step=2)[0].successful
    assert face.set(counter__enabled="true")[0].successful
    assert face.get("counter.step", "counter.enabled") == [2.0, True]
    arrays = [kind for kind in Parameter.Type if kind.name.endswith("_ARRAY")]
    for kind in arrays:
        empty = ParameterMessage(name="record_topics", value=ParameterValue(type=kind.value))
        (result,) = face.set(record_topics=empty)
        assert (result.successful, result.reason) == (True, ""), kind


REFUSED: dict[str, tuple[dict[str, object], str]] = {
    "out of range": ({"counter__step": 11.0}, "expected at least 0 and at most 10, found 11"),
    "wrong type": ({"counter__period_ms": 2.5}, "expected a whole number, found 2.5"),
    "text": ({"counter__step": "fast"}, "expected a number, found 'fast'"),
    "no number": ({"counter__step": float("nan")}, "expected at least 0"),
    "list": ({"counter__step": [1.0]}, "expected true, false, a number or text, found a double array"),
    "text that ros2 reads as a number": (
        {"counter__label": 7},
        "'counter.label': expected text, found 7, as ros2 reads some text. Put the text in quotes of its own",
    ),
    "unset": ({"counter__step": None}, "expected true, false, a number or text, found nothing"),
    "no type": (
        {"x": ParameterMessage(name="counter.step", value=ParameterValue(type=77))},
        "77 is not a valid",
    ),
    "no such property": ({"counter__stepp": 1.0}, "has no property 'stepp'; did you mean step?"),
    "no such component": ({"conter__step": 1.0}, "component 'conter' is unknown"),
    "no such parameter": ({"autostrat": True}, "no parameter 'autostrat'; did you mean autostart?"),
    "protected": (
        {"guard__step": 2.0},
        "component 'guard' is protected: it was declared with reconfigurable: false",
    ),
    "simulated time": ({"use_sim_time": True}, "components run by the monotonic clock"),
    "one of two": (
        {"counter__enabled": True, "counter__step": -1.0},
        "step 2 (set_property counter step -1.0)",
    ),
    "both kinds": ({"counter__enabled": True, "bag": "x"}, "all or none cannot be had of properties and"),
}


def _refusals_change_nothing(face: Face, graph: Any) -> None:
    before = _listed(graph), face.get(*face.names(), "bag", "use_sim_time")
    for what, (values, words) in REFUSED.items():
        result = face.set_all(**values)
        assert not result.successful, what
        assert words in result.reason, what
        if len(values) == 1:
            assert face.set(**values) == [result], what
    assert (_listed(graph), face.get(*face.names(), "bag", "use_sim_time")) == before
    assert [item.successful for item in face.set(counter__step=5.5, guard__step=2.0)] == [True, False]
    assert face.get("counter.step", "guard.step") == [5.5, 1.0], "each for itself"
    assert face.get("counter.step", "nobody.step") == []


def _parameters_follow_requests(face: Face, graph: Any) -> None:
    def reconfigure(*steps: tuple[str, ...]) -> Any:
        asked = [
            ReconfigurationStep(**dict(zip(("kind", "target", "name", "value"), step, strict=False)))
            for step in steps
        ]
        return graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=asked)

    assert reconfigure(("set_property", "counter", "step", "7")).success
    assert face.get("counter.step") == [7.0]
    face.await_told("changed", counter__step=7.0)
    added = reconfigure(
        ("add_component", "second", "", f"{PARTS}, properties: {{step: 3.0}}}}"), ("start", "second")
    )
    assert added.success, added.message
    assert face.get("second.step") == [3.0]
    face.await_told("new", second__step=3.0)
    assert reconfigure(("remove_component", "second")).success
    assert [name for name in face.names() if name.startswith("second.")] == []
    face.await_told("deleted", second__step=None)
    twin = [
        ("replace_shell", "counter", "executor_tests/TwinShell"),
        ("replace_core", "counter", "executor_tests/Twin"),
    ]
    replaced = reconfigure(*twin, ("replace_fsm", "counter", "executor_tests/TwinFsm"))
    assert replaced.success, replaced.message
    assert [name for name in face.names() if "counter" in name] == ["counter.factor", "counter.step"]
    assert face.set(counter__factor=3.0)[0].successful
    assert face.get("counter.step", "counter.factor") == [7.0, 3.0]


def _parameters_follow_the_life_cycle(face: Face, graph: Any) -> None:
    _change(graph, Transition.TRANSITION_DEACTIVATE)
    assert face.set(counter__factor=4.0)[0].successful, "while it is inactive"
    assert face.get("counter.factor") == [4.0]
    _change(graph, Transition.TRANSITION_CLEANUP)
    assert face.names() == []
    face.await_told("deleted", guard__step=None)
    refused = face.set(counter__step=4.0)[0]
    assert (refused.successful, "configure it first" in refused.reason) == (False, True)
    _change(graph, Transition.TRANSITION_CONFIGURE)
    assert face.get("counter.step", "counter.label") == [2.0, "of the robot's file"], "as at the start"
