"""Robots on machines of their own: an executor each, and a supervisor that minds whether the other speaks."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from mauve_examples.mission.hosts import Hosts
from mauve_rt.parts.ament_index import share_folder

PATIENCE_S = 100.0
SILENCE_S, UNDO_S, COOLDOWN_S = 1.0, 0.5, 2.0
USUAL, ALONE = "mauve_examples/Metronome", "mauve_examples/Accelerando"
RULES = f"""\
mauve: 1
rules:
  - name: alone
    when: {{silence: {{topic: /OTHER/beat, type: std_msgs/msg/Float64, longer_than_s: {SILENCE_S}}}}}
    do: [{{kind: replace_core, target: metronome, name: {ALONE}}}]
    undo: {{for_s: {UNDO_S}, do: [{{kind: replace_core, target: metronome, name: {USUAL}}}]}}
    cooldown_s: {COOLDOWN_S}
"""
_TOLD = re.compile(r"\[(\d+\.\d+)\] \[\w+\.supervisor\]: alone: (\w+): (.*)")
_ENVIRONMENT = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "PYTHONUNBUFFERED": "1"}


class Decision(NamedTuple):
    """Of a supervisor, as its log has it."""

    time_s: float  # of the clock that all of them have
    what: str  # armed, do, undo, done, ...
    reason: str


class Robot:
    """The processes of one; all on one machine."""

    def __init__(self, hosts: Hosts, folder: Path, name: str, other: str) -> None:
        self._hosts, self._folder, self.name = hosts, folder, name
        self._rules = folder / f"{name}.yaml"
        self._rules.write_text(RULES.replace("OTHER", other), encoding="utf-8")
        self._logs: list[Path] = []
        self._running: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, *nodes: str) -> None:
        """Start its executor, its supervisor, or both."""
        share = share_folder("mauve_examples")
        given = {
            "executor": f"architecture:={share}/architecture/metronome.yaml",
            "supervisor": f"rules:={self._rules}",
        }
        for node in nodes or tuple(given):
            log = self._folder / f"{self.name}_{node}_{len(self._logs)}.log"
            self._logs.append(log)
            words = ["-P", "-m", f"mauve_rt.node.{node}.main", "--ros-args", "-r", f"__ns:=/{self.name}"]
            with log.open("wb") as output:
                self._running[node] = subprocess.Popen(
                    [*self._hosts.wrapper(self.name), sys.executable, *words, "-p", given[node]],
                    env=os.environ | _ENVIRONMENT,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                )

    def signal(self, node: str, number: signal.Signals) -> None:
        """Freeze (SIGSTOP), thaw (SIGCONT) or kill (SIGKILL) one of its processes."""
        process = self._running[node]
        process.send_signal(number)
        if number == signal.SIGKILL:
            process.wait()

    def close(self) -> None:
        """End its processes, by force."""
        for process in self._running.values():
            process.kill()
            process.wait()

    def decisions(self, *, since_s: float = 0.0) -> list[Decision]:
        """What its supervisors decided, from the first on."""
        text = "".join(log.read_text("utf-8", "replace") for log in self._logs)
        told = (Decision(float(at), what, why) for at, what, why in _TOLD.findall(text))
        return [decision for decision in told if decision.time_s >= since_s]

    def said(self, *, since_s: float = 0.0) -> list[str]:
        """In one word each."""
        return [decision.what for decision in self.decisions(since_s=since_s)]

    def acted(self, *, since_s: float = 0.0) -> list[str]:
        """What it did of what it decided, in order: `do` and `undo` that were done."""
        done = [decision for decision in self.decisions(since_s=since_s) if decision.what == "done"]
        return [decision.reason.partition(":")[0] for decision in done]

    def logs(self) -> str:
        """All that its processes said."""
        return "\n".join(f"== {log.name}\n{log.read_text('utf-8', 'replace')[-3000:]}" for log in self._logs)


class Pair:
    """Two robots that mind each other."""

    def __init__(self, folder: Path) -> None:
        """Their machines, joined; no process yet.

        Raises:
            HostsError: no such machines can be made here.
        """
        self.hosts = Hosts(["robot_1", "robot_2"])
        self.one = Robot(self.hosts, folder, "robot_1", "robot_2")
        self.two = Robot(self.hosts, folder, "robot_2", "robot_1")

    @property
    def both(self) -> tuple[Robot, Robot]:
        """The robots."""
        return self.one, self.two

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for what shows in the logs."""
        deadline_s = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > deadline_s:
                logs = "\n".join(robot.logs() for robot in self.both)
                raise AssertionError(f"gave up waiting for: {what}\n{logs}")
            time.sleep(0.05)

    def close(self) -> None:
        """End all of it."""
        for robot in self.both:
            robot.close()
        self.hosts.close()
