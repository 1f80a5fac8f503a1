"""Ports that must stay connected, by the services."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ros_processes import ExecutorProcess

from mauve_msgs.msg import ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
CALLER = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  caller: {shell: executor_tests/CallerShell, core: executor_tests/Caller, fsm: executor_tests/CallerFsm}
resources:
  lamp: {kind: executor_tests/Lamp}
  spare: {kind: executor_tests/Lamp}
connections:
  - [caller.lamp, lamp.set]
"""


def _start(start_executor: Callable[..., ExecutorProcess], folder: Path, text: str) -> None:
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    start_executor("-p", f"architecture:={path}")


def _step(kind: str, target: str, name: str = "", value: str = "") -> Any:
    return ReconfigurationStep(kind=kind, target=target, name=name, value=value)


def test_a_required_port_stays_connected(
    graph: Any, start_executor: Callable[..., ExecutorProcess], tmp_path: Path
) -> None:
    _start(start_executor, tmp_path, CALLER)
    cut = _step("disconnect", "caller", "lamp")
    refused = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[cut])
    assert (refused.success, refused.code) == (False, Code.INVALID)
    assert "a required port is not connected" in refused.message
    assert "port lamp" in refused.message
    assert "connect it, in the same transaction" in refused.message
    added = "{shell: executor_tests/CallerShell, core: executor_tests/Caller, fsm: executor_tests/CallerFsm}"
    refused = graph.ask(
        Reconfigure, f"{NODE}/reconfigure", steps=[_step("add_component", "second", value=added)]
    )
    assert (refused.success, refused.code) == (False, Code.INVALID)
    rewired = [cut, _step("connect", "caller", "lamp", "spare.set")]
    done = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=rewired)
    assert done.success, done.message
    (caller,) = graph.ask(ListComponents, f"{NODE}/list_components").components
    assert [(port.resource, port.service) for port in caller.ports if port.name == "lamp"] == [
        ("spare", "set")
    ]
    assert caller.state == ComponentInfo.RUNNING
