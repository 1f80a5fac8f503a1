"""The launch files, run for real where `launch` is installed.

tests/python/node/test_launch_files.py reads them anywhere.
"""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.srv import GetState
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import PATIENCE_S
from rosbags.highlevel import AnyReader
from std_msgs.msg import Bool, Float64

from mauve_msgs.msg import SupervisorDecision
from mauve_msgs.srv import ListComponents
from mauve_rt.parts.ament_index import share_folder

for module in ("launch", "launch_ros"):
    pytest.importorskip(module, reason=f"{module} is not installed: it is no wheel")

LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
LAUNCH = """\
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource

file, *arguments = sys.argv[1:]
source = PythonLaunchDescriptionSource(file)
included = IncludeLaunchDescription(source, launch_arguments=[word.split(":=", 1) for word in arguments])
service = LaunchService()
service.include_launch_description(LaunchDescription([included]))
sys.exit(service.run())
"""
RULES = """\
mauve: 1
rules:
  - name: quiet
    when: {silence: {topic: peer, type: std_msgs/msg/Float64, longer_than_s: 60.0}}
    in: supervisor
    do: [{kind: stop, target: guard}]
"""


class Launched:
    """A launch in a process group of its own, as from a terminal."""

    def __init__(
        self, log: Path, environment: dict[str, str], file: Path, arguments: tuple[str, ...]
    ) -> None:
        self._log = log
        with log.open("w", encoding="utf-8") as output:
            self.process = subprocess.Popen(
                [sys.executable, "-c", LAUNCH, str(file), *arguments],
                env={**os.environ, **environment},
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    @property
    def output(self) -> str:
        return self._log.read_text(encoding="utf-8")

    def interrupt(self) -> int:
        """Ctrl-C: a signal for the whole group; the exit status."""
        os.killpg(self.process.pid, signal.SIGINT)
        return self.process.wait(PATIENCE_S)


@pytest.fixture
def launch(tmp_path: Path, domain: int, plugin_prefix: Path) -> Iterator[Callable[..., Launched]]:
    """launch("mauve_rt", "executor.launch.py", "architecture:=FILE", ...): ended with the test."""
    started: list[Launched] = []
    environment = {"ROS_DOMAIN_ID": str(domain), "ROS_LOG_DIR": str(tmp_path / "log")}

    def start(package: str, file: str, *arguments: str) -> Launched:
        share = share_folder(package)
        assert share is not None
        log = tmp_path / f"launch_{len(started)}.log"
        started.append(Launched(log, environment, share / "launch" / file, arguments))
        return started[-1]

    yield start
    for launched in started:
        if launched.process.poll() is None:
            launched.interrupt()


def test_an_executor_with_its_supervisor(
    launch: Callable[..., Launched], architecture: Path, graph: Any, tmp_path: Path
) -> None:
    (tmp_path / "rules.yaml").write_text(RULES, encoding="utf-8")
    parameters = "/**:\n  ros__parameters:\n    counter.step: 3.0\n    autostart: false\n"
    (tmp_path / "parameters.yaml").write_text(parameters, encoding="utf-8")
    bag = tmp_path / "bag"
    launched = launch(
        "mauve_rt",
        "executor.launch.py",
        f"architecture:={architecture}",
        f"rules:={tmp_path / 'rules.yaml'}",
        f"params_file:={tmp_path / 'parameters.yaml'}",
        f"bag:={bag}",
        "record_topics:=[talk:std_msgs/msg/Float64]",
        "autostart:=true",
        "namespace:=robot_7",
        "remappings:=count:=tally  executor:__node:=boss executor:=boss",
    )
    counts = graph.hear(Float64, "/robot_7/tally")
    decisions = graph.hear(SupervisorDecision, "/robot_7/supervisor/decisions", LATCHED)
    graph.spin_until(lambda: len(counts) > 2, "counts")
    graph.spin_until(lambda: any(said.decision == "armed" for said in decisions), "the armed rule")
    assert graph.ask(GetState, "/robot_7/boss/get_state").current_state.label == "active"
    counter = graph.ask(ListComponents, "/robot_7/boss/list_components").components[0]
    assert "step=3.0" in counter.properties
    assert graph.node.count_subscribers("/robot_7/talk") == 1
    assert launched.interrupt() == 0, launched.output
    assert launched.output.count("process has finished cleanly") == 2, launched.output
    with AnyReader([bag]) as reader:
        assert "/robot_7/tally" in reader.topics


def test_a_supervisor_ends_with_its_executor(
    launch: Callable[..., Launched], architecture: Path, tmp_path: Path
) -> None:
    (tmp_path / "rules.yaml").write_text(RULES, encoding="utf-8")
    (tmp_path / "bag").mkdir()  # a reason for the executor to refuse
    arguments = (
        f"architecture:={architecture}",
        f"rules:={tmp_path / 'rules.yaml'}",
        f"bag:={tmp_path / 'bag'}",
    )
    launched = launch("mauve_rt", "executor.launch.py", *arguments)
    launched.process.wait(PATIENCE_S)
    assert "exit code 2" in launched.output
    assert str(tmp_path / "bag") in launched.output


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("architecture:=none.yaml", "none.yaml:1:1: cannot read the file"),
        ("rules:=none.yaml", "none.yaml:1:1: cannot read the file"),
        ("params_file:=none.yaml", "params_file:=none.yaml: no such file"),
        ("remappings:=a=b", "remappings: expected FROM:=TO or NODE:FROM:=TO, found 'a=b'"),
        ("trace:=perhaps", "perhaps"),
    ],
)
def test_bad_arguments_start_nothing(
    argument: str, message: str, launch: Callable[..., Launched], architecture: Path
) -> None:
    launched = launch("mauve_rt", "executor.launch.py", f"architecture:={architecture}", argument)
    assert launched.process.wait(PATIENCE_S) == 1
    assert message in launched.output
    assert "process started" not in launched.output


def test_a_mission_that_cannot_be_starts_nothing(launch: Callable[..., Launched]) -> None:
    launched = launch("mauve_examples", "exploration.launch.py", "robots:=99")
    assert launched.process.wait(PATIENCE_S) == 1
    assert "--robots 99: expected 1 to 16" in launched.output
    assert "process started" not in launched.output


def test_the_mission_loses_its_link_and_gets_it_back(
    launch: Callable[..., Launched], graph: Any, tmp_path: Path
) -> None:
    arguments = ("map:=room", "link_loss_at:=2.0", "link_back_at:=2.5", f"out:={tmp_path / 'out'}")
    launched = launch("mauve_examples", "exploration.launch.py", *arguments)
    links = graph.hear(Bool, "/radio/link", LATCHED)
    graph.spin_until(
        lambda: [link.data for link in links][-2:] == [False, True], "the link, cut and restored"
    )
    for robot in ("robot_1", "robot_2"):
        decisions = graph.hear(SupervisorDecision, f"/{robot}/supervisor/decisions", LATCHED)
        graph.spin_until(lambda decisions=decisions: len(decisions) > 0, f"{robot}'s supervisor")
    assert launched.interrupt() == 0, launched.output
    ended = re.findall(r"(executor|supervisor|radio)-\d+\]: process has finished cleanly", launched.output)
    assert sorted(ended) == ["executor"] * 2 + ["radio"] + ["supervisor"] * 2, launched.output
    assert "Traceback" not in launched.output
