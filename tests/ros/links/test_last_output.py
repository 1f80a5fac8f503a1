"""The last message that a listener on another machine gets of an executor that ends, over a lossy cable."""

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
ENDS = 4
METRONOME = """\
mauve: 1
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
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64
rclpy.init()
node = rclpy.create_node("listener")
qos = QoSProfile(depth=100, reliability=ReliabilityPolicy[sys.argv[1].upper()])
node.create_subscription(Float64, "beat", lambda message: print(message.data, flush=True), qos)
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

    def values_of_an_end(self, qos: str, number: int) -> list[float]:
        """What the driver received of an executor, up to its last message."""
        file, log = self._folder / f"{qos}.yaml", self._folder / f"driver_{number}"
        file.write_text(METRONOME.replace("QOS", qos), encoding="utf-8")
        with log.open("w", encoding="utf-8") as output:
            words = [*self._hosts.wrapper("driver"), sys.executable, "-P", "-c", _LISTENER, qos]
            driver = subprocess.Popen(words, env=os.environ | self._environment, stdout=output)

        def received() -> list[float]:
            lines = log.read_text("utf-8").splitlines(keepends=True)
            return [float(line) for line in lines if line.endswith("\n")]

        wrapper = self._hosts.wrapper("robot")
        executor = ExecutorProcess(
            self._folder, self._environment, ["-p", f"architecture:={file}"], wrapper=wrapper
        )
        try:
            wait_until(lambda: len(received()) > 20)
            self._cable.set(loss=LOSS)
            time.sleep(0.3)
            assert executor.end(signal.SIGTERM)[0] == 0
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


def test_the_last_reliable_message_over_a_bad_cable_is_the_safe_one(machines: Any) -> None:
    assert [machines.values_of_an_end("reliable", number)[-1] for number in range(ENDS)] == [0.0] * ENDS


def test_best_effort_outputs_of_a_stop_come_over_a_bad_cable_more_than_once(machines: Any) -> None:
    """One each would be at most as many as there are ends; of three each a quarter is lost."""
    zeros = [machines.values_of_an_end("best_effort", number).count(0.0) for number in range(ENDS)]
    assert sum(zeros) > ENDS, zeros
