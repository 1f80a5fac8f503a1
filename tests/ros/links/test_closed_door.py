"""An executor that stays on this machine, and another machine that knows its address and does what it can.

Next to it, on the same machine, runs an executor that is open: what the other machine does works on that one.
"""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from needed_hosts import hosts_or_skip
from ros_processes import PATIENCE_S, RELAY, ExecutorProcess
from udp_sockets import udp_sockets

from mauve_examples.mission.hosts import ADDRESS, Hosts

ROBOT, ELSEWHERE = f"{ADDRESS}1", f"{ADDRESS}2"
RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"
OPEN = {RANGE: "SUBNET"}
FOLDER = Path(__file__).parent
SERVICES = ["executor/stop", "executor/set_parameters", "executor/change_state"]


class Robot:
    """A machine with two executors, and another machine on the same switch."""

    def __init__(self, folder: Path, domain: int) -> None:
        """Start the executors.

        Raises:
            HostsError: no such machines can be made here.
        """
        self._domain = domain
        self._hosts = Hosts(["robot", "elsewhere"])
        self.closed = self._start(folder, "closed", {RANGE: ""})
        self.opened = self._start(folder, "opened", OPEN)

    def _start(self, folder: Path, name: str, environment: dict[str, str]) -> ExecutorProcess:
        file = folder / f"{name}.yaml"
        file.write_text(f"{RELAY}executor: {{namespace: /{name}}}\n", encoding="utf-8")
        return ExecutorProcess(
            folder,
            {"ROS_DOMAIN_ID": str(self._domain), **environment},
            ["-p", f"architecture:={file}"],
            wrapper=self._hosts.wrapper("robot"),
        )

    def run(self, host: str, *words: str, **environment: str) -> str:
        """What a Python program on a host prints, at its end."""
        done = subprocess.run(
            [*self._hosts.wrapper(host), sys.executable, "-P", *words],
            env=os.environ | {"ROS_DOMAIN_ID": str(self._domain)} | environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
        )
        assert done.returncode == 0, done.stderr + self.closed.output + self.opened.output
        return done.stdout

    def intrude(self, host: str, *names: str, **environment: str) -> dict[str, Any]:
        """What a node on a host reached: see intruder.py."""
        said = self.run(host, str(FOLDER / "intruder.py"), *names, **OPEN, **environment)
        answer: dict[str, Any] = json.loads(said)
        return answer

    def close(self) -> None:
        """End all of it."""
        for executor in (self.closed, self.opened):
            executor.process.kill()
            executor.process.wait()
        self._hosts.close()


@pytest.fixture
def robot(tmp_path: Path, domain: int) -> Iterator[Robot]:
    with hosts_or_skip():
        made = Robot(tmp_path, domain)
    yield made
    made.close()


def test_nothing_from_another_machine_comes_through_a_closed_door(robot: Robot, domain: int) -> None:
    before = robot.run("robot", "-m", "mauve_rt.cli", "list", "/closed/executor")
    assert "RUNNING" in before
    robot.run("robot", "-m", "mauve_rt.cli", "list", "/opened/executor", **OPEN)
    said = robot.closed.output
    assert said.count("on this machine only: UDP bound to 127.0.0.1;") == 1

    # Forged and replayed discovery, to every port and to the group: one participant answers, not two.
    forge = [str(FOLDER / "forger.py"), ELSEWHERE, ROBOT, str(domain)]
    assert len(robot.run("elsewhere", *forge).split()) == 1

    # Service calls, a parameter, a lifecycle transition and a topic: by multicast and by static peers.
    reached = robot.intrude("elsewhere", "opened", "closed", ROS_STATIC_PEERS=ROBOT)
    assert reached["opened"]["answered"] == SERVICES
    assert reached["opened"]["subscribers"] == 1
    assert reached["closed"] == {"answered": [], "subscribers": 0}

    assert robot.closed.process.poll() is None
    assert robot.closed.output == said
    assert "RUNNING" in robot.run("robot", "-m", "mauve_rt.cli", "list", "/closed/executor")
    assert {address for address, _ in udp_sockets(robot.closed.process.pid)} == {"127.0.0.1"}

    # On the robot itself a node with the default range of ROS reaches both.
    assert robot.intrude("robot", "closed")["closed"] == {"answered": SERVICES, "subscribers": 1}
