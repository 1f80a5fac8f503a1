"""A component whose state does not end is stopped and removed by force; all others run on."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64

from mauve_msgs.msg import ComponentInfo
from mauve_msgs.srv import ListComponents

NODE = "/robot_1/executor"
FILE = """\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  hung: {{shell: executor_tests/CounterShell, core: executor_tests/{core}, fsm: executor_tests/CounterFsm,
         cpus: [0], priority: 20, properties: {{period_ms: 20, label: {way}}}}}
  neighbour: {{shell: executor_tests/CounterShell, core: executor_tests/Counter,
              fsm: executor_tests/CounterFsm, cpus: [0], priority: 50, properties: {{period_ms: 20}}}}
resources:
  count: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {{name: count, direction: publish}}}}
  set: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {{name: set, direction: subscribe}}}}
connections:
  - [hung.count, count.write]
  - [hung.set, set.read]
"""
ANEW = """\
force: true
steps:
- {kind: remove_component, target: hung}
- kind: add_component
  target: hung
  value: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
- {kind: connect, target: hung, name: count, value: count.write}
- {kind: start, target: hung}
"""


class Stage:
    """An executor with a component that hangs by now."""

    def __init__(self, graph: Any, executor: Any) -> None:
        self.graph, self.executor = graph, executor
        self.counts = graph.hear(Float64, "/robot_1/count")
        self.health = graph.hear(DiagnosticArray, "/diagnostics")
        graph.spin_until(lambda: self.part("hung").hung, "the component to hang")

    def part(self, name: str) -> Any:
        listed = self.graph.ask(ListComponents, f"{NODE}/list_components").components
        return next(part for part in listed if part.name == name)

    def left_behind(self) -> str:
        values = (
            item.value
            for array in self.health[-1:]
            for status in array.status
            for item in status.values
            if item.key == "threads_left_behind"
        )
        return next(values, "")

    def mauve(self, *words: str, text: str = "") -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self.graph.node.context.get_domain_id())}
        command = [sys.executable, "-m", "mauve_rt.cli", *words]
        return subprocess.run(
            command, env=environment, input=text, capture_output=True, text=True, check=False, timeout=200
        )

    def await_neighbour(self) -> None:
        before = self.part("neighbour").releases
        self.graph.spin_until(lambda: self.part("neighbour").releases > before + 5, "the neighbour")


@pytest.fixture(
    params=[("Hanging", "loop"), ("Hanging", "lock"), ("PyHanging", "loop"), ("PyHanging", "lock")]
)
def stage(request: Any, architecture: Path, start_executor: Callable[..., Any], graph: Any) -> Stage:
    core, way = request.param
    architecture.write_text(FILE.format(core=core, way=way), encoding="utf-8")
    return Stage(graph, start_executor("-p", f"architecture:={architecture}"))


def test_a_hung_component_is_stopped_by_force(stage: Stage) -> None:
    refused = stage.mauve("stop", NODE, "hung", "--timeout", "0.2")
    assert (refused.returncode, "TIMEOUT" in refused.stderr) == (1, True), refused.stderr
    assert "by force" in refused.stderr
    forced = stage.mauve("stop", NODE, "hung", "--timeout", "0.2", "--force")
    words = "is stopped by force: it is FAULTED, and its thread is left behind until its state ends"
    assert (forced.returncode, forced.stdout) == (0, f"component 'hung' {words}\n"), forced.stderr
    part = stage.part("hung")
    assert part.state == ComponentInfo.FAULTED
    assert "stopped by force while state Count was executing" in part.fault
    stage.graph.spin_until(lambda: stage.counts[-1].data == 0.0, "the output that is safe")
    stage.await_neighbour()
    again = stage.mauve("reconfigure", NODE, "-", text=ANEW)
    assert again.returncode == 0, again.stderr
    stage.graph.spin_until(lambda: stage.part("hung").releases > 5, "the new one")
    stage.graph.spin_until(lambda: stage.left_behind() == "1", "the old thread in /diagnostics")
    assert stage.executor.process.poll() is None


def test_a_hung_component_is_removed_by_force(stage: Stage) -> None:
    without = stage.mauve(
        "reconfigure", NODE, "-", "--timeout", "0.2", text=ANEW.replace("force: true\n", "")
    )
    assert (without.returncode, "TIMEOUT" in without.stderr) == (1, True), without.stderr
    assert stage.part("hung").state == ComponentInfo.RUNNING
    forced = stage.mauve("reconfigure", NODE, "-", "--timeout", "0.2", text=ANEW)
    assert forced.returncode == 0, forced.stderr
    stage.graph.spin_until(lambda: stage.part("hung").releases > 5, "the new one")
    stage.graph.spin_until(lambda: stage.left_behind() == "1", "the old thread in /diagnostics")
    stage.await_neighbour()


def test_a_new_core_for_a_hung_component_is_refused(stage: Stage) -> None:
    core = stage.part("hung").core
    refused = stage.mauve("replace-core", NODE, "hung", core, "--timeout", "0.2", "--force")
    assert (refused.returncode, "FAULTED" in refused.stderr) == (1, True), refused.stderr
    assert "remove the component and add it anew" in refused.stderr
    assert stage.part("hung").state == ComponentInfo.FAULTED
    stage.await_neighbour()
