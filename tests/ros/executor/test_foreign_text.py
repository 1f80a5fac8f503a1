"""What users' code says when it fails may be no text at all: the executor tells it, and goes on answering."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Parameter
from rcl_interfaces.srv import ListParameters, SetParameters, SetParametersAtomically
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import PATIENCE_S
from std_msgs.msg import Float64

import mauve_rt.trace
from mauve_msgs.msg import ArchitectureState, ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start, Stop
from mauve_rt.control.requests import Code
from mauve_rt.node.shared.service_thread import refused_reply
from mauve_rt.trace.bag.repair import examine_bag

NODE = "/robot_1/executor"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MORE_CORES = """\
            alternatives: [executor_tests/Unspeakable, executor_tests/PyLeaving, executor_tests/PyGarbled,
                           """
BROKEN_THREAD = """\
import sys
from mauve_rt.node.executor import main as executor
from mauve_rt.node.executor import state as executor_state
from mauve_rt.node.shared import watch

def fail(self, *arguments):
    raise SystemExit("the eyes are gone")

watch._PATIENCE, watch._PAUSE_S = 3, 0.0
executor_state.StatePublisher._look = fail
executor.main(sys.argv)
"""


@pytest.fixture
def executor(architecture: Path, start_executor: Callable[..., Any], tmp_path: Path) -> Any:
    text = architecture.read_text("utf-8")
    architecture.write_text(text.replace("            alternatives: [", MORE_CORES, 1), "utf-8")
    return start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={tmp_path / 'bag'}")


def _list(graph: Any) -> dict[str, Any]:
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    return {component.name: component for component in reply.components}


def _replace(graph: Any, core: str) -> Any:
    return graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=f"executor_tests/{core}")


def _add(graph: Any, kind: str, value: str) -> Any:
    step = ReconfigurationStep(kind=kind, target="late", value=value)
    return graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[step])


@pytest.mark.parametrize(
    ("number", "words"),
    [(-2e7, "bytes \ufffd\ufffd, no text"), (-2e8, "an exception that is no std::exception")],
    ids=["bytes", "no exception"],
)
def test_a_fault_that_is_no_text(executor: Any, graph: Any, tmp_path: Path, number: float, words: str):
    states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    health = graph.hear(DiagnosticArray, "/diagnostics")
    graph.voice(Float64, "/robot_1/set").publish(Float64(data=number))

    def faults() -> list[str]:
        return [part.fault for part in states[-1].components if part.state == ComponentInfo.FAULTED]

    graph.spin_until(lambda: bool(states) and bool(faults()), "the fault in ~/state")
    assert words in faults()[0]
    assert words in _list(graph)["counter"].fault
    health.clear()

    def unwell() -> list[str]:
        statuses = [status for array in health for status in array.status]
        return [status.message for status in statuses if status.level == DiagnosticStatus.ERROR]

    graph.spin_until(lambda: any(words in message for message in unwell()), "the fault in /diagnostics")
    refused = graph.ask(Start, f"{NODE}/start", component="counter")
    assert (refused.success, words in refused.message) == (False, True)
    before = len(states)
    stopped = graph.ask(Stop, f"{NODE}/stop", component="sleepy")
    assert stopped.success, stopped.message
    graph.spin_until(lambda: len(states) > before, "the next ~/state")
    executor.process.terminate()
    assert executor.wait() == 0
    assert words in executor.output
    assert mauve_rt.trace.open(tmp_path / "bag").architecture


@pytest.mark.parametrize(
    ("core", "words"),
    [
        ("Unspeakable", "\ufffd( is no text"),
        ("PyLeaving", "the core has left"),
        ("PyGarbled", "_Garbled"),
    ],
)
@pytest.mark.usefixtures("executor")
def test_a_core_that_leaves_or_babbles_is_a_refusal(graph: Any, core: str, words: str) -> None:
    reply = _replace(graph, core)
    assert (reply.success, reply.code) == (False, Code.PREPARE_FAILED)
    assert words in reply.message
    again = _replace(graph, "Backwards")
    assert again.success, again.message
    assert _list(graph)["counter"].core == "executor_tests/Backwards"


@pytest.mark.usefixtures("executor")
def test_what_fails_while_it_is_loaded_or_made_is_a_refusal(graph: Any) -> None:
    names = ("CounterShell", "PyLeftMissing", "CounterFsm")
    part = "{{shell: executor_tests/{}, core: executor_tests/{}, fsm: executor_tests/{}}}".format(*names)
    reply = _add(graph, "add_component", part)
    assert (reply.success, reply.code) == (False, Code.UNKNOWN_CORE)
    assert "cannot load executor_tests_gone:PyLeftMissing: SystemExit: this module is gone" in reply.message
    reply = _add(graph, "add_resource", "{kind: executor_tests/UnspeakableResource}")
    assert (reply.success, reply.code) == (False, Code.PREPARE_FAILED)
    assert "executor_tests/UnspeakableResource" in reply.message
    assert "the plug-in cannot be made: \ufffd( is no text" in reply.message
    assert graph.ask(Stop, f"{NODE}/stop", component="sleepy").success


def test_a_thread_that_cannot_go_on_ends_the_process_in_order(
    architecture: Path, domain: int, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    arguments = ["--ros-args", "-p", f"architecture:={architecture}", "-p", f"bag:={bag}"]
    ended = subprocess.run(
        [sys.executable, "-c", BROKEN_THREAD, *arguments],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        stderr=subprocess.STDOUT,
        stdout=subprocess.PIPE,
        check=False,
        encoding="utf-8",
        timeout=PATIENCE_S,
    )
    assert ended.returncode == 1
    assert ended.stdout.count("thread 'state' failed and goes on: SystemExit: the eyes are gone") == 1
    assert "thread 'state' failed 3 times in a row: the executor ends" in ended.stdout
    assert examine_bag(bag).is_finished


def test_a_handler_that_raises_is_a_refusal_of_every_service() -> None:
    gone = SystemExit("gone")
    reply = refused_reply(ReplaceCore.Request(), ReplaceCore.Response(success=True), gone)
    assert (reply.success, reply.code) == (False, Code.PREPARE_FAILED)
    assert reply.message == "internal error: SystemExit: gone"
    two = SetParameters.Request(parameters=[Parameter(), Parameter()])
    results = refused_reply(two, SetParameters.Response(), gone).results
    assert [(result.successful, result.reason) for result in results] == [(False, reply.message)] * 2
    result = refused_reply(SetParametersAtomically.Request(), SetParametersAtomically.Response(), gone).result
    assert (result.successful, result.reason) == (False, reply.message)
    for service in (ListComponents, ListParameters):  # without words for it
        assert refused_reply(service.Request(), service.Response(), gone) == service.Response()
