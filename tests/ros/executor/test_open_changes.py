"""A change that waits for a component is listed, and ended without a restart."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray

from mauve_msgs.msg import ComponentInfo, OpenChange, ReconfigurationStep
from mauve_msgs.srv import ListChanges, ListComponents, Reconfigure
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
FILE = """\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  late: {{shell: executor_tests/CounterShell, core: executor_tests/PyPausing, fsm: executor_tests/CounterFsm,
         properties: {{period_ms: 20, label: {folder}/late}}}}
  slow: {{shell: executor_tests/CounterShell, core: executor_tests/PyPausing, fsm: executor_tests/CounterFsm,
         properties: {{period_ms: 20, label: {folder}/slow}}}}
"""


class Stage:
    """An executor whose components `late` and `slow` stay in their states while files say so."""

    def __init__(self, graph: Any, folder: Path) -> None:
        self.graph, self.folder = graph, folder

    def hold(self, name: str) -> None:
        (self.folder / name).touch()

        def lasts() -> bool:
            listed = self.graph.ask(ListComponents, f"{NODE}/list_components").components
            part = next(part for part in listed if part.name == name)
            return not part.waiting and part.state_age_ns > 100_000_000

        self.graph.spin_until(lasts, f"a state of {name} to last")

    def release(self, name: str) -> None:
        (self.folder / name).unlink(missing_ok=True)

    def ask_for_change(self, timeout_s: float) -> Any:
        steps = [
            ReconfigurationStep(kind="set_property", target=name, name="step", value="2.0")
            for name in ("late", "slow")
        ]
        return self.graph.ask_later(
            Reconfigure,
            f"{NODE}/reconfigure",
            steps=steps,
            commit_timeout_s=timeout_s,
            requested_by="the operator",
        )

    def changes(self) -> list[Any]:
        found: list[Any] = self.graph.ask(ListChanges, f"{NODE}/list_changes").changes
        return found

    def await_open(self, phase: int, *late: str) -> Any:
        def is_so() -> bool:
            return [(each.phase, [part.name for part in each.late]) for each in self.changes()] == [
                (phase, [*late])
            ]

        self.graph.spin_until(is_so, f"a change in phase {phase} to wait for {late}")
        return self.changes()[0]

    def mauve(self, *words: str, text: str = "") -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(self.graph.node.context.get_domain_id())}
        command = [sys.executable, "-m", "mauve_rt.cli", *words]
        return subprocess.run(
            command, env=environment, input=text, capture_output=True, text=True, check=False, timeout=200
        )


@pytest.fixture
def stage(
    architecture: Path, tmp_path: Path, start_executor: Callable[..., Any], graph: Any
) -> Iterator[Stage]:
    architecture.write_text(FILE.format(folder=tmp_path), encoding="utf-8")
    start_executor("-p", f"architecture:={architecture}")
    stage = Stage(graph, tmp_path)
    assert not stage.changes()  # it is there: `mauve` waits for none
    yield stage
    stage.release("late")
    stage.release("slow")


def test_a_late_component_is_listed_abandoned_and_removed(stage: Stage) -> None:
    none = stage.mauve("changes", NODE)
    assert (none.returncode, none.stdout) == (0, "no open change\n"), none.stderr
    health = stage.graph.hear(DiagnosticArray, "/diagnostics")
    stage.hold("slow")
    reply = stage.ask_for_change(timeout_s=10.0)
    stage.await_open(OpenChange.WAITING, "slow")
    stage.hold("late")
    stage.release("slow")
    change = stage.await_open(OpenChange.MADE, "late")
    assert (change.author, len(change.steps), change.instant_ns > 0) == ("the operator", 2, True)

    listed = stage.mauve("changes", NODE)
    assert listed.returncode == 0, listed.stderr
    head, late, remedy = listed.stdout.splitlines()
    assert head.startswith("made, begun ")
    assert " ago by the operator: " in head
    assert late.startswith("  late: late has not taken the change, in state Count for ")
    assert remedy == f"to end it: mauve changes {NODE} --abandon late"
    as_json = json.loads(stage.mauve("changes", NODE, "--json").stdout)
    assert [part["name"] for part in as_json["changes"][0]["late"]] == ["late"]
    said = "late: late has not taken the change of the operator, in state Count for "
    stage.graph.spin_until(
        lambda: any(said in status.message for array in health for status in array.status), "/diagnostics"
    )

    done = stage.mauve("changes", NODE, "--abandon", "late")
    assert (done.returncode, "component 'late' is given up" in done.stdout) == (0, True), done.stderr
    stage.graph.spin_until(reply.done, "the answer to the change that is made")
    assert reply.result().success
    parts = {
        part.name: part.state
        for part in stage.graph.ask(ListComponents, f"{NODE}/list_components").components
    }
    assert parts == {"late": ComponentInfo.FAULTED, "slow": ComponentInfo.RUNNING}
    removed = stage.mauve("reconfigure", NODE, "-", text="- {kind: remove_component, target: late}\n")
    assert removed.returncode == 0, removed.stderr
    stage.release("late")
    stage.graph.spin_until(lambda: not stage.changes(), "the end of its thread")


def test_a_change_that_is_not_decided_is_called_off(stage: Stage) -> None:
    stage.hold("slow")
    reply = stage.ask_for_change(timeout_s=10.0)
    stage.await_open(OpenChange.WAITING, "slow")
    done = stage.mauve("changes", NODE, "--abandon", "slow")
    assert (done.returncode, "is called off" in done.stdout) == (0, True), done.stderr
    stage.graph.spin_until(reply.done, "the refusal")
    assert reply.result().code == Code.WRONG_REVISION
    assert "abandoned by another request" in reply.result().message
    assert not stage.changes()


def test_list_and_abandon_wait_for_no_preparation(stage: Stage) -> None:
    """A part that is being configured holds its request and all that wait behind it."""
    awaited = stage.folder / "configured"
    value = {
        "shell": "executor_tests/CounterShell",
        "core": "executor_tests/PyPatient",
        "fsm": "executor_tests/CounterFsm",
        "properties": {"label": str(awaited)},
    }
    steps = [ReconfigurationStep(kind="add_component", target="new", value=json.dumps(value))]
    reply = stage.graph.ask_later(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    stage.graph.spin_until(awaited.with_suffix(".begun").exists, "the preparation")
    behind = stage.graph.ask_later(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    stage.await_open(OpenChange.PREPARING)
    refused = stage.mauve("changes", NODE, "--abandon", "late")
    assert "NOT_RUNNING" in refused.stderr
    assert not reply.done()
    awaited.touch()
    stage.graph.spin_until(lambda: reply.done() and behind.done(), "the answers")
    assert reply.result().success, reply.result().message


def test_a_preparation_that_hangs_is_called_off(stage: Stage) -> None:
    """Who asked for it is answered, and the next change is made, while the hook lasts."""
    awaited = stage.folder / "configured"
    value = {
        "shell": "executor_tests/CounterShell",
        "core": "executor_tests/PyPatient",
        "fsm": "executor_tests/CounterFsm",
        "properties": {"label": str(awaited)},
    }
    steps = [ReconfigurationStep(kind="add_component", target="new", value=json.dumps(value))]
    reply = stage.graph.ask_later(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    stage.graph.spin_until(awaited.with_suffix(".begun").exists, "the preparation")
    stage.await_open(OpenChange.PREPARING)
    done = stage.mauve("changes", NODE, "--abandon", "new")
    assert (done.returncode, "is called off" in done.stdout) == (0, True), done.stderr
    stage.graph.spin_until(reply.done, "the answer")
    assert reply.result().code == Code.WRONG_REVISION, reply.result().message
    assert "called off while it was prepared" in reply.result().message
    listed = stage.mauve("changes", NODE)
    assert "(called off)" in listed.stdout, listed.stdout
    removed = stage.mauve("reconfigure", NODE, "-", text="- {kind: remove_component, target: late}\n")
    assert removed.returncode == 0, removed.stderr
    assert not awaited.exists()
    awaited.touch()
    stage.graph.spin_until(lambda: not stage.changes(), "the end of the hook")


def test_what_nothing_waits_for_is_not_abandoned(stage: Stage) -> None:
    refused = stage.mauve("changes", NODE, "--abandon", "late")
    assert (refused.returncode, "NOT_RUNNING" in refused.stderr) == (1, True), refused.stderr
    refused = stage.mauve("changes", NODE, "--abandon", "nobody")
    assert (refused.returncode, "UNKNOWN_COMPONENT" in refused.stderr) == (1, True), refused.stderr
