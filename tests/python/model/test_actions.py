"""Resources of ROS actions in architecture files: what is built, and what `mauve check` refuses."""

from pathlib import Path
from typing import Any

import pytest

from mauve_msgs.action import DriveTo
from mauve_msgs.msg import ActionGoal
from mauve_rt._kernel import PluginRegistry, Simulation
from mauve_rt.api import AnyResource, Core, PeriodicFsm, Shell, ms_to_ns, read_port, write_port
from mauve_rt.cli.main import main
from mauve_rt.control.limits import bytes_of_resource
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.model import ArchitectureModel, PluginIndex, build, configure, load_architecture
from mauve_rt.model.plugins import PluginLoader
from mauve_rt.model.resource_kinds import EXAMPLES_OF_TYPES, given_kinds, needed_binding
from mauve_rt.model.resource_parts import resource_part

DRIVE = """\
drive: {kind: action_server, type: mauve_msgs/action/DriveTo, action: {name: drive_to, answer_ms: 50},
          goals: 4}"""
SEND = "send: {kind: action_client, type: mauve_msgs/action/DriveTo, action: {name: /robot_2/drive_to}}"
CONNECTIONS = """\
connections:
  - [driver.status, drive.status]
  - [driver.goal, drive.goal]
  - [driver.asked, drive.asked]
  - [driver.decide, drive.decide]
  - [driver.feedback, drive.feedback]
  - [driver.result, drive.result]
  - [sender.goal, send.goal]
  - [sender.decide, send.decide]
  - [sender.status, send.status]
  - [sender.feedback, send.feedback]
  - [sender.result, send.result]
"""
GOOD = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  driver: {{shell: test/DriverShell, core: test/Idle, fsm: test/DriverFsm}}
  sender: {{shell: test/SenderShell, core: test/Send, fsm: test/SenderFsm}}
resources:
  {DRIVE}
  {SEND}
{CONNECTIONS}"""


class DriverShell(Shell):
    status = read_port(ActionGoal)
    goal = read_port(DriveTo.Goal)
    asked = read_port(DriveTo.Goal)
    decide = write_port(ActionGoal)
    feedback = write_port(DriveTo.Feedback)
    result = write_port(DriveTo.Result)


class SenderShell(Shell):
    goal = write_port(DriveTo.Goal)
    decide = write_port(ActionGoal)
    status = read_port(ActionGoal)
    feedback = read_port(DriveTo.Feedback)
    result = read_port(DriveTo.Result)


class Idle(Core[Any]):
    def act(self) -> None:
        pass


class Send(Core[SenderShell]):
    seen: tuple[int, int] = (0, 0)

    def configure(self) -> None:
        Send.seen = (0, 0)

    def act(self) -> None:
        if self.shell.status.read().value.number == 0:
            self.shell.goal.write(DriveTo.Goal(tolerance_m=0.5))
        status = self.shell.status.read().value
        Send.seen = (status.number, status.state)


class ActPeriodically(PeriodicFsm[Any, Any]):
    def define(self) -> None:
        self.period(ms_to_ns(10))
        self.set_initial(self.periodic_state("Act", "act"))


@pytest.fixture
def registry() -> PluginRegistry:
    made = PluginRegistry()
    for name, shell, core in (("Driver", DriverShell, Idle), ("Sender", SenderShell, Send)):
        made.shell(f"test/{name}Shell", shell)
        made.core(f"test/{core.__name__}", core, f"test/{name}Shell")
        made.fsm(f"test/{name}Fsm", ActPeriodically, f"test/{name}Shell")
    return made


def loaded(folder: Path, text: str) -> ArchitectureModel:
    path = folder / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    return load_architecture(path)


def test_components_in_python_use_a_server_and_a_client(
    tmp_path: Path, plugin_prefix: Path, registry: PluginRegistry
) -> None:
    model = loaded(tmp_path, GOOD)
    architecture = build(model, registry)
    configure(model, architecture)
    services = {
        resource.name: {(each.name, each.kind, each.type.rpartition("/")[2]) for each in resource.services}
        for resource in architecture.resources()
    }
    assert services == {
        "drive": {
            ("status", "read", "ActionGoal"),
            ("goal", "read", "DriveTo_Goal"),
            ("asked", "read", "DriveTo_Goal"),
            ("decide", "write", "ActionGoal"),
            ("feedback", "write", "DriveTo_Feedback"),
            ("result", "write", "DriveTo_Result"),
        },
        "send": {
            ("goal", "write", "DriveTo_Goal"),
            ("decide", "write", "ActionGoal"),
            ("status", "read", "ActionGoal"),
            ("feedback", "read", "DriveTo_Feedback"),
            ("result", "read", "DriveTo_Result"),
        },
    }
    simulation = Simulation()
    simulation.add(architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + ms_to_ns(50))
    simulation.shutdown()
    assert Send.seen == (1, ActionGoal.UNKNOWN), "the first goal waits for the answer of a server"


def test_the_time_for_an_answer_is_a_parameter_of_the_kind(tmp_path: Path, plugin_prefix: Path) -> None:
    resources = loaded(tmp_path, GOOD).resources
    registry = PluginRegistry()
    PluginLoader(registry, PluginIndex.installed()).require("action_type", "mauve_msgs/action/DriveTo")
    assert resource_part(resources["drive"], registry) == {
        "kind": "action_server",
        "type": "mauve_msgs/action/DriveTo",
        "goals": 4,
        "answer_ns": 50_000_000,
    }
    assert "answer_ns" not in resource_part(resources["send"], registry), "the kernel's own"


def test_serialized_goals_count_as_memory_of_requests(tmp_path: Path, plugin_prefix: Path) -> None:
    resources = loaded(tmp_path, GOOD).resources
    registry = PluginRegistry()
    part = resource_part(resources["drive"], registry)
    assert isinstance(part["resource"], AnyResource), "no library registers the type: it is held serialized"
    max_bytes, goals = 65_536, 4
    assert bytes_of_resource(resources["drive"], registry) >= 2 * goals * 2 * max_bytes
    assert bytes_of_resource(resources["send"], registry) >= 3 * max_bytes
    PluginLoader(registry, PluginIndex.installed()).require("action_type", "mauve_msgs/action/DriveTo")
    assert bytes_of_resource(resources["drive"], registry) == 0


def test_each_kind_of_types_has_an_example_that_is_installed(plugin_prefix: Path) -> None:
    kinds = {kind.type_kind for kind in given_kinds().values()} - {""}
    assert {*EXAMPLES_OF_TYPES} == kinds
    assert {needed_binding(kind) for kind in given_kinds().values()} == {"", "service", "action"}
    loader = PluginLoader(PluginRegistry(), PluginIndex.installed())
    for kind in kinds:
        assert loader.has(kind, EXAMPLES_OF_TYPES[kind])


@pytest.mark.parametrize(
    ("change", "error"),
    [
        (
            ("mauve_msgs/action/DriveTo, action: {name: /", "mauve_msgs/action/DriveT, action: {name: /"),
            "did you mean mauve_msgs/action/DriveTo?",
        ),
        (("drive.status]", "drive.statu]"), "resource 'drive' has no service 'statu'; did you mean status?"),
        (
            ("driver.goal, drive.goal", "driver.goal, drive.status"),
            "expected a service of kind read and type mauve_msgs/action/DriveTo_Goal",
        ),
    ],
)
def test_a_bad_use_is_refused(
    change: tuple[str, str], error: str, tmp_path: Path, plugin_prefix: Path, registry: PluginRegistry
) -> None:
    assert change[0] in GOOD
    with pytest.raises(ArchitectureFileError) as refused:
        build(loaded(tmp_path, GOOD.replace(*change)), registry)
    assert error in str(refused.value)


def test_the_names_of_actions_are_drawn(
    tmp_path: Path, plugin_prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    counter = (
        "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}"
    )
    head, _, rest = GOOD.partition("  driver:")
    resources = rest.partition("resources:")[2].partition("connections:")[0]
    path = tmp_path / "robot.yaml"
    path.write_text(f"{head}  counter: {counter}\nresources:{resources}", encoding="utf-8")
    assert main(["graph", str(path)]) == 0
    drawn = capsys.readouterr().out
    assert "offers /robot_1/drive_to" in drawn
    assert "calls /robot_2/drive_to" in drawn
    assert main(["check", str(path)]) == 0
