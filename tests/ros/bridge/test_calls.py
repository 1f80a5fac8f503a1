"""Calls between components and ROS services, both ways; topics and services that come and go."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Float64
from std_srvs.srv import SetBool

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import Reconfigure
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
CALLER = "{shell: executor_tests/CallerShell, core: executor_tests/Caller, fsm: executor_tests/CallerFsm}"
FILE = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  caller: {CALLER}
resources:
  lamp: {{kind: client, type: std_srvs/srv/SetBool, service: {{name: lamp, timeout_ms: 60}}}}
  count: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {{name: count, direction: publish}}}}
  own: {{kind: executor_tests/Lamp, service: {{name: own/set, offers: set}}}}
connections:
  - [caller.lamp, lamp.call]
  - [caller.count, count.write]
"""
NO_SERVER, TIMED_OUT = -1.0, -2.0  # what the caller counts then


@pytest.fixture
def calling(start_executor: Callable[..., Any], tmp_path: Path, graph: Any) -> list[Any]:
    """An executor that runs `FILE`: what its caller counts."""
    path = tmp_path / "calls.yaml"
    path.write_text(FILE, encoding="utf-8")
    start_executor("-p", f"architecture:={path}")
    return graph.hear(Float64, "/robot_1/count")


def _said(counts: list[Any]) -> float:
    return counts[-1].data if counts else 0.0


def _health(graph: Any, heard: list[Any], name: str) -> Any:
    """The next status of that name."""
    seen = len(heard)
    graph.spin_until(lambda: len(heard) > seen, "diagnostics")
    return next(status for status in heard[-1].status if status.name.endswith(name))


def test_a_component_calls_a_ros_service_and_never_waits_longer_than_declared(
    calling: list[Any], graph: Any
) -> None:
    health = graph.hear(DiagnosticArray, "/diagnostics")
    graph.spin_until(lambda: _said(calling) == NO_SERVER, "a call without a server")
    served: list[bool] = []
    delay_s = [0.0]

    def serve(request: Any, response: Any) -> Any:
        served.append(request.data)
        time.sleep(delay_s[0])
        response.success, response.message = True, "on" if request.data else "off"
        return response

    service = graph.node.create_service(SetBool, "/robot_1/lamp", serve)
    graph.spin_until(lambda: _said(calling) >= 20.0, "twenty answers")
    assert {True, False} == set(served)
    delay_s[0] = 0.2  # over the client's time
    graph.spin_until(lambda: _said(calling) == TIMED_OUT, "a call that timed out")
    graph.spin_until(
        lambda: "timed out" in _health(graph, health, "service /robot_1/lamp (lamp)").message,
        "a warning of it",
    )
    delay_s[0] = 0.0
    answered = max(count.data for count in calling)
    graph.spin_until(lambda: _said(calling) > answered, "answers again")
    status = _health(graph, health, "service /robot_1/lamp (lamp)")
    values = {item.key: item.value for item in status.values}
    assert int(values["answered"]) >= answered
    assert int(values["timed_out"]) > 0
    assert int(values["no_server"]) > 0
    graph.node.destroy_service(service)
    graph.spin_until(lambda: _said(calling) == NO_SERVER, "the server's end")


def test_a_response_that_does_not_fit_the_declared_type_is_told(calling: list[Any], graph: Any) -> None:
    def serve(_request: Any, response: Any) -> Any:
        response.message = "longer than the component's type has room for"
        return response

    graph.node.create_service(SetBool, "/robot_1/lamp", serve)
    graph.spin_until(lambda: _said(calling) == -5.0, "a malformed answer")


@pytest.mark.usefixtures("calling")
def test_a_resources_call_is_a_ros_service(graph: Any) -> None:
    for data in (True, False, True):
        reply = graph.ask(SetBool, "/robot_1/own/set", data=data)
        assert (reply.success, reply.message) == (True, "on" if data else "off")
    health = graph.hear(DiagnosticArray, "/diagnostics")
    status = _health(graph, health, "service /robot_1/own/set (own)")
    values = {item.key: item.value for item in status.values}
    assert (values["side"], values["answered"], status.level) == ("server", "3", DiagnosticStatus.OK)


def test_a_request_that_is_no_text_is_answered(
    start_executor: Callable[..., Any], tmp_path: Path, graph: Any
) -> None:
    path = tmp_path / "calls.yaml"
    stopper = CALLER.replace("/Caller", "/Stopper")
    stop = "{kind: client, type: mauve_msgs/srv/Stop, service: {name: executor/stop, timeout_ms: 2000}}"
    path.write_text(
        FILE.replace(CALLER, stopper)
        .replace("caller.lamp, lamp.call", "caller.stop, lamp.call")
        .replace("{kind: client, type: std_srvs/srv/SetBool, service: {name: lamp, timeout_ms: 60}}", stop),
        encoding="utf-8",
    )
    start_executor("-p", f"architecture:={path}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 10, "ten replies")
    assert {count.data for count in counts} == {float(Code.UNKNOWN_COMPONENT)}


def _step(kind: str, target: str, name: str = "", value: str = "") -> Any:
    return ReconfigurationStep(kind=kind, target=target, name=name, value=value)


ADD = [
    _step("add_resource", "spare", value="{kind: executor_tests/Lamp, service: {name: spare, offers: ask}}"),
    _step(
        "add_resource",
        "spare_lamp",
        value="{kind: client, type: std_srvs/srv/SetBool, service: {name: own/set}}",
    ),
    _step(
        "add_resource",
        "spare_count",
        value="{kind: shared_data, type: std_msgs/msg/Float64, "
        "topic: {name: spare_count, direction: publish}}",
    ),
    _step(
        "add_resource",
        "wanted",
        value="{kind: latest_value, type: std_msgs/msg/Float64, topic: {name: wanted, direction: subscribe}}",
    ),
    _step("add_component", "second", value=CALLER),
    _step("connect", "second", "lamp", "spare_lamp.call"),
    _step("connect", "second", "count", "spare_count.write"),
    _step("start", "second"),
]
REMOVE = [
    _step("remove_component", "second"),
    *(_step("remove_resource", name) for name in ("spare", "spare_lamp", "spare_count", "wanted")),
]


@pytest.mark.usefixtures("calling")
def test_topics_and_services_come_and_go_while_all_runs(graph: Any) -> None:
    def change(steps: list[Any], *, dry_run: bool = False) -> Any:
        return graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps, dry_run=dry_run)

    def left() -> int:
        """How much of what is added can be found."""
        services = [name for name, _ in graph.node.get_service_names_and_types()]
        topics = graph.node.count_publishers("/robot_1/spare_count")
        return topics + graph.node.count_subscribers("/robot_1/wanted") + services.count("/robot_1/spare")

    def once() -> None:
        dry = change(ADD, dry_run=True)
        assert dry.success, dry.message
        failing = change([*ADD, _step("connect", "second", "count", "spare_count.write")])
        assert failing.code == Code.INVALID, "connected already: the last step"
        graph.spin_until(lambda: not left(), "nothing is left of both")
        added = change(ADD)
        assert added.success, added.message
        counts = graph.hear(Float64, "/robot_1/spare_count")
        graph.spin_until(lambda: _said(counts) > 10.0, "answers from the executor's own service")
        voice = graph.voice(Float64, "/robot_1/wanted")
        second_writer = change([_step("connect", "caller", "count", "wanted.write")])
        assert not second_writer.success, "the topic is the latest_value's writer"
        removed = change(REMOVE)
        assert removed.success, removed.message
        graph.spin_until(lambda: not left(), "the end of all that was added")
        graph.node.destroy_publisher(voice)

    for _ in range(2):
        once()


@pytest.mark.usefixtures("calling")
def test_a_topic_of_another_type_refuses_the_whole_transaction(graph: Any) -> None:
    publisher = graph.node.create_publisher(Float64, "/robot_1/taken", 1)
    graph.spin_until(lambda: graph.node.count_publishers("/robot_1/taken") > 0, "the publisher")
    other = "{kind: shared_data, type: geometry_msgs/msg/Point, topic: {name: taken, direction: publish}}"

    def refused() -> bool:
        steps = [ADD[2], _step("add_resource", "other", value=other)]
        reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps, dry_run=True)
        return "carries another type already" in reply.message

    graph.spin_until(refused, "the executor to know of the publisher")
    assert publisher.get_subscription_count() == 0
    graph.spin_until(
        lambda: graph.node.count_publishers("/robot_1/spare_count") == 0, "the other topic's end"
    )
