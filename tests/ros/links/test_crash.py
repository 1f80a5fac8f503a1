"""The last message that another machine gets after a crash of an executor, over a lossy cable."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lossy_cable import LossyCable
from needed_hosts import hosts_or_skip
from ros_processes import ExecutorProcess
from waiting import wait_until

from mauve_examples.mission.hosts import Hosts

RANGE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
LOSS = 0.25
QOS = ("reliable", "best_effort")
METRONOME = """\
mauve: 1
executor: {sentinel: true}
components:
  metronome:
    shell: mauve_examples/MetronomeShell
    core: mauve_examples/Metronome
    fsm: mauve_examples/MetronomeFsm
    properties: {period_us: 4000, ticks_per_beat: 5}
resources:
  beat: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: beat, direction: publish, qos: QOS}}
connections:
  - [metronome.beat, beat.write]
"""
_LISTENER = """\
import sys
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64

def report(array):
    for status in array.status:
        if status.name.endswith(": sentinel"):
            print(status.message, file=sys.stderr, flush=True)

rclpy.init()
node = rclpy.create_node("listener")
qos = QoSProfile(depth=100, reliability=ReliabilityPolicy[sys.argv[1].upper()])
node.create_subscription(Float64, "beat", lambda message: print(message.data, flush=True), qos)
node.create_subscription(DiagnosticArray, "/diagnostics", report, 10)
rclpy.spin(node)
"""


class Machines:
    """Two that a lossy cable joins."""

    def __init__(self, folder: Path, domain: int) -> None:
        """Make them.

        Raises:
            HostsError: no such machines can be made here.
        """
        self._folder = folder
        self._environment = {"ROS_DOMAIN_ID": str(domain), **RANGE}
        self._hosts = Hosts(["robot", "driver"])
        self._cable = LossyCable(self._hosts)

    def values_of_a_crash(self, qos: str, number: int) -> list[float]:
        """What the driver received of an executor and its sentinel."""
        file, log = self._folder / f"{qos}.yaml", self._folder / f"driver_{number}"
        file.write_text(METRONOME.replace("QOS", qos), encoding="utf-8")
        statuses = log.with_suffix(".statuses")
        with log.open("w", encoding="utf-8") as output, statuses.open("w", encoding="utf-8") as errors:
            words = [*self._hosts.wrapper("driver"), sys.executable, "-P", "-c", _LISTENER, qos]
            environment = os.environ | self._environment
            driver = subprocess.Popen(words, env=environment, stdout=output, stderr=errors)

        def received() -> list[float]:
            lines = log.read_text("utf-8").splitlines(keepends=True)
            return [float(line) for line in lines if line.endswith("\n")]

        wrapper = self._hosts.wrapper("robot")
        executor = ExecutorProcess(
            self._folder, self._environment, ["-p", f"architecture:={file}"], wrapper=wrapper
        )
        try:
            wait_until(lambda: len(received()) > 20)
            wait_until(lambda: "watches 1 output, 1 subscriber" in statuses.read_text("utf-8"))
            self._cable.set(loss=LOSS)
            time.sleep(0.3)
            executor.end(signal.SIGKILL)
            time.sleep(0.3)
            return received()
        finally:
            self._cable.set()
            for process in (executor.process, driver):
                process.kill()
                process.wait()

    def close(self) -> None:
        """End all of it."""
        self._cable.close()
        self._hosts.close()


@pytest.fixture
def machines(tmp_path: Path, domain: int) -> Iterator[Machines]:
    with hosts_or_skip():
        made = Machines(tmp_path, domain)
    yield made
    made.close()


def test_the_last_message_after_a_crash_is_the_safe_one_over_a_bad_cable(machines: Any) -> None:
    ends = [machines.values_of_a_crash(qos, number) for number, qos in enumerate(QOS)]
    assert [values[-1] for values in ends] == [0.0] * len(QOS)
