"""A network interface whose queue stands still: what listeners on the machine itself hear."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from needed_hosts import hosts_or_skip
from ros_processes import ExecutorProcess
from waiting import wait_until

from mauve_examples.mission.hosts import Hosts

RANGE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
METRONOME = """\
mauve: 1
components:
  metronome:
    shell: mauve_examples/MetronomeShell
    core: mauve_examples/Metronome
    fsm: mauve_examples/MetronomeFsm
    properties: {period_us: 1000, ticks_per_beat: 5}
resources:
  beat: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: beat, direction: publish}}
connections:
  - [metronome.beat, beat.write]
"""
LISTENER = Path(__file__).with_name("recorder_of_beats.py")
_STALL = ["tc", "qdisc", "add", "dev", "cable", "root", "tbf", "rate", "1kbit", "burst", "2k"]
_READER = """\
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
rclpy.init()
node = rclpy.create_node("reader")
def hear(array):
    print(*(f"{one.name}: {one.message}" for one in array.status), sep="\\n", flush=True)
node.create_subscription(DiagnosticArray, "/diagnostics", hear, 10)
rclpy.spin(node)
"""
LASTS_S = 4.0  # several times as long as the buffer of a socket takes to fill


class Robot:
    """An executor that publishes 200 times a second, a listener beside it, and one on another machine."""

    def __init__(self, folder: Path, domain: int) -> None:
        """Start them.

        Raises:
            HostsError: no such machines can be made here.
        """
        self.hosts = Hosts(["robot", "elsewhere"])
        self._environment = {"ROS_DOMAIN_ID": str(domain), **RANGE}
        file = folder / "metronome.yaml"
        file.write_text(METRONOME, encoding="utf-8")
        self.executor = ExecutorProcess(
            folder,
            self._environment,
            ["-p", f"architecture:={file}"],
            wrapper=self.hosts.wrapper("robot"),
        )
        self.near, self.far = folder / "near", folder / "far"
        self.health = folder / "health"
        with self.health.open("w", encoding="utf-8") as log:
            reader = self._run("robot", "-c", _READER, stdout=log)
        self._listeners = [self._listen("robot", self.near), self._listen("elsewhere", self.far), reader]

    def _run(self, host: str, *words: str, stdout: Any = None) -> subprocess.Popen[bytes]:
        wrapper = [*self.hosts.wrapper(host), sys.executable, "-P"]
        return subprocess.Popen([*wrapper, *words], env=os.environ | self._environment, stdout=stdout)

    def _listen(self, host: str, file: Path) -> subprocess.Popen[bytes]:
        return self._run(host, str(LISTENER), "beat", str(file))

    def stall(self) -> None:
        """From now on the network interface lets nothing through."""
        subprocess.run([*self.hosts.wrapper("robot"), *_STALL, "limit", "100000000"], check=True)

    def close(self) -> None:
        for process in (self.executor.process, *self._listeners):
            process.kill()
            process.wait()
        self.hosts.close()


def heard(file: Path, since_s: float = 0.0) -> list[float]:
    """The values that came since an instant."""
    lines = file.read_text("utf-8").splitlines(keepends=True) if file.exists() else []
    found = [tuple(map(float, line.split())) for line in lines if line.endswith("\n")]
    return [value for at_s, value in found if at_s >= since_s]


@pytest.fixture
def robot(tmp_path: Path, domain: int) -> Iterator[Robot]:
    with hosts_or_skip():
        made = Robot(tmp_path, domain)
    yield made
    made.close()


def test_a_stalled_interface_holds_up_nothing_on_the_machine_itself(robot: Robot) -> None:
    """Neither the topic, nor the safe output of the end."""
    wait_until(lambda: len(heard(robot.near)) > 100 and len(heard(robot.far)) > 100)
    wait_until(lambda: "/executor: process: " in robot.health.read_text("utf-8"))
    robot.stall()
    stalled_s = time.monotonic()
    time.sleep(LASTS_S)
    late_s = stalled_s + LASTS_S / 2
    wait_until(lambda: len(heard(robot.near, late_s)) > 100)
    assert len(heard(robot.far, late_s)) < 20, "the interface stands still"
    warning = "/executor: process: a network interface stands still: "
    wait_until(lambda: warning in robot.health.read_text("utf-8"))
    ended_s = time.monotonic()
    status, _ = robot.executor.end(signal.SIGTERM)
    assert status == 0
    wait_until(lambda: heard(robot.near, ended_s)[-1:] == [0.0])
