"""The supervisor and the executor as processes: a real core is replaced in flight, and back."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest
import rclpy
from domains import draw_domain
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Bool, Float64
from stepped_clock import SteppedClock

from mauve_msgs.msg import ArchitectureState, SupervisorDecision
from mauve_rt.parts.ament_index import share_folder

RULES = """\
mauve: 1
rules:
  - name: quiet
    when: {silence: {topic: peer, type: std_msgs/msg/Float64, longer_than_s: 2.0}}
    do: [{kind: replace_core, target: metronome, name: mauve_examples/Accelerando}]
    undo: {for_s: 0.5, do: [{kind: replace_core, target: metronome, name: mauve_examples/Metronome}]}
"""
PATIENCE_S = 100.0


LASTING_S = 2.0  # longer than the rule waits for anything


class Band:
    """A metronome under an executor, its supervisor, and a peer that plays while `playing`."""

    def __init__(self, folder: Path, environment: Mapping[str, str] = MappingProxyType({})) -> None:
        """`environment`: of executor and supervisors."""
        self.domain = draw_domain()
        self.environment = environment
        self.playing = True
        self.folder = folder
        self.decisions: list[Any] = []
        self.states: list[Any] = []
        self.processes: list[subprocess.Popen[str]] = []  # of supervisors
        self.start_executor()
        self.start_supervisor()
        self.context = Context()
        rclpy.init(context=self.context, domain_id=self.domain)
        self.node = Node("peer", context=self.context)
        self.spinner = SingleThreadedExecutor(context=self.context)
        self.spinner.add_node(self.node)
        voice = self.node.create_publisher(Float64, "/band/peer", 10)
        self.node.create_timer(0.1, lambda: self.playing and voice.publish(Float64()))
        latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        listen = self.node.create_subscription
        listen(SupervisorDecision, "/band/supervisor/decisions", self.decisions.append, latched)
        listen(ArchitectureState, "/band/executor/state", self.states.append, latched)

    def start_executor(self) -> None:
        share = share_folder("mauve_examples")
        assert share is not None
        architecture = share / "architecture" / "metronome.yaml"
        self.executor_process = self._start("executor", f"architecture:={architecture}")

    def start_supervisor(self, rules: str = RULES) -> None:
        self.supervisor_process = self.another_supervisor(rules)

    def another_supervisor(self, rules: str = RULES, *parameters: str) -> subprocess.Popen[str]:
        path = self.folder / "rules.yaml"
        path.write_text(rules, encoding="utf-8")
        process = self._start("supervisor", f"rules:={path}", *parameters)
        self.processes.append(process)
        return process

    def kill_supervisor(self) -> None:
        self.supervisor_process.kill()
        self.supervisor_process.communicate()

    def end_supervisor(self) -> str:
        """What it has written to stderr: all, as it ends in order."""
        self.supervisor_process.send_signal(signal.SIGINT)
        return self.supervisor_process.communicate()[1]

    def _start(self, node: str, *parameters: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-m",
                f"mauve_rt.node.{node}.main",
                "--ros-args",
                "-r",
                "__ns:=/band",
                *(word for parameter in parameters for word in ("-p", parameter)),
            ],
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "ROS_DOMAIN_ID": str(self.domain), **self.environment},
        )

    def until(self, condition: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline_s, f"it did not happen; {self.report()}"
            self.spinner.spin_once(timeout_sec=0.1)

    def report(self) -> str:
        """What is known, for who reads a failure. Ends the supervisor: what it wrote to stderr counts."""
        executor, supervisor = self.executor_process, self.supervisor_process
        ended = f"; the executor ended: {executor.communicate()[1]}" if executor.poll() is not None else ""
        publishers = self.node.count_publishers("/band/supervisor/decisions")
        status = supervisor.poll()
        supervisor.kill()
        ended += f"; {publishers} supervisors publish decisions; the last one's status is {status}"
        ended += f", it wrote: {supervisor.communicate()[1]}"
        decided = [f"{decision.decision} ({decision.reason})" for decision in self.decisions]
        return f"decisions: {decided}; instances: {[state.instance_id for state in self.states]}{ended}"

    def await_rest(self) -> None:
        """The peer is heard: the rule is armed, and decides nothing for longer than it waits for anything."""
        told, since_s = -1, 0.0
        deadline_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < since_s + 2 * LASTING_S:
            assert time.monotonic() < deadline_s, f"no rest; decisions: {self.said()}"
            self.spinner.spin_once(timeout_sec=0.1)
            if len(self.decisions) != told or self.core() != "mauve_examples/Metronome":
                told, since_s = len(self.decisions), time.monotonic()

    def said(self) -> list[str]:
        return [decision.decision for decision in self.decisions]

    def degrade(self) -> None:
        """The peer falls silent, and the rule acts.

        On a busy machine it also acts before the peer is heard, and takes that back, or is about to when the
        peer falls silent: what it did has to last, without a decision.
        """
        self.until(lambda: "armed" in self.said())
        self.playing = False
        lasting_since_s = time.monotonic()
        deadline_s = lasting_since_s + PATIENCE_S
        while time.monotonic() < lasting_since_s + LASTING_S:
            assert time.monotonic() < deadline_s, f"it did not last; decisions: {self.said()}"
            told = len(self.decisions)
            self.spinner.spin_once(timeout_sec=0.1)
            if len(self.decisions) != told or self.core() != "mauve_examples/Accelerando":
                lasting_since_s = time.monotonic()
        assert "done" in self.said()

    def core(self) -> str:
        return str(self.states[-1].components[0].core) if self.states else ""

    def close(self) -> None:
        for process in (self.executor_process, *self.processes):
            process.kill()
            process.wait()
        self.spinner.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def stepped_clock(tmp_path: Path) -> SteppedClock:
    return SteppedClock(tmp_path)


@pytest.fixture
def stepped_band(tmp_path: Path, stepped_clock: SteppedClock) -> Iterator[Band]:
    band = Band(tmp_path, stepped_clock.environment)
    yield band
    band.close()


@pytest.fixture
def band(tmp_path: Path) -> Iterator[Band]:
    band = Band(tmp_path)
    yield band
    band.close()


def test_a_core_is_replaced_in_flight_and_back(band: Band):
    band.until(lambda: "armed" in band.said())
    band.playing = False
    band.until(lambda: "done" in band.said())
    band.until(lambda: band.core() == "mauve_examples/Accelerando")
    band.playing = True
    band.until(lambda: band.said()[-2:] == ["undo", "done"])
    band.until(lambda: band.core() == "mauve_examples/Metronome")
    swapped = [decision for decision in band.decisions if decision.decision == "done"]
    assert swapped[-1].revision == band.states[-1].revision


@pytest.mark.parametrize("step_s", [-600, 600])  # longer than the test waits for anything
def test_a_step_of_the_clock_is_no_silence(stepped_band: Band, stepped_clock: SteppedClock, step_s: int):
    band = stepped_band
    band.await_rest()
    told = len(band.decisions)
    stepped_clock.step(step_s)
    band.await_rest()
    assert len(band.decisions) == told
    band.playing = False
    band.until(lambda: band.said()[-1:] == ["done"])
    band.until(lambda: band.core() == "mauve_examples/Accelerando")
    band.playing = True
    band.until(lambda: band.said()[-2:] == ["undo", "done"])
    band.end_supervisor()
    assert band.supervisor_process.returncode == 0


def test_a_supervisor_without_input_ends_after_a_step_of_the_clock(
    stepped_band: Band, stepped_clock: SteppedClock
):
    band = stepped_band
    band.until(lambda: "armed" in band.said())
    band.playing = False
    band.executor_process.kill()
    band.executor_process.communicate()
    time.sleep(LASTING_S)  # it waits, for nothing comes any longer
    stepped_clock.step(-600)
    band.end_supervisor()
    assert band.supervisor_process.returncode == 0


def test_an_executor_that_is_killed_and_started_anew_is_supervised_again(band: Band):
    band.until(lambda: "armed" in band.said() and len(band.states) > 0)
    band.executor_process.kill()
    band.executor_process.communicate()
    band.start_executor()
    band.until(lambda: band.said().count("armed") == 2)
    band.until(lambda: len({state.instance_id for state in band.states}) == 2)
    band.playing = False
    band.until(lambda: band.said()[-1:] == ["done"])
    band.until(lambda: band.core() == "mauve_examples/Accelerando")


def degraded(band: Band) -> None:
    """The rule acted, and its supervisor is gone."""
    band.degrade()
    band.kill_supervisor()
    band.decisions.clear()


def test_a_supervisor_started_anew_undoes_what_the_one_before_did(band: Band):
    degraded(band)
    band.start_supervisor()
    band.until(lambda: band.said()[:3] == ["armed", "adopted", "condition_true"])
    assert band.core() == "mauve_examples/Accelerando"  # nobody plays yet
    band.playing = True
    band.until(lambda: band.said()[3:] == ["condition_false", "undo", "done"])
    band.until(lambda: band.core() == "mauve_examples/Metronome")
    assert "quiet: adopted: " in band.end_supervisor()


def test_an_executor_started_anew_while_degraded_is_as_its_file_says(band: Band):
    degraded(band)
    band.start_supervisor()
    band.until(lambda: "adopted" in band.said())
    band.executor_process.kill()
    band.executor_process.communicate()
    band.start_executor()
    band.until(lambda: band.said().count("armed") == 2)
    band.until(lambda: band.said()[-2:] == ["do", "done"])
    band.until(lambda: band.core() == "mauve_examples/Accelerando")
    assert band.said().count("adopted") == 1
    assert "undo" not in band.said()


def cores_since(band: Band, number: int) -> set[str]:
    """Cores that ~/state has shown since the message of this number."""
    return {state.components[0].core for state in band.states[number:]}


def test_a_second_supervisor_of_the_name_is_refused(band: Band):
    band.until(lambda: "armed" in band.said())
    second = band.another_supervisor()
    error = second.communicate()[1]
    assert second.returncode == 2
    assert f"/band/supervisor runs already, process {band.supervisor_process.pid} on " in error
    assert "-p replace:=true" in error
    assert band.supervisor_process.poll() is None
    band.playing = False
    band.until(lambda: "done" in band.said())
    band.until(lambda: band.core() == "mauve_examples/Accelerando")


def test_a_supervisor_takes_the_place_of_another_and_changes_nothing(band: Band):
    band.degrade()
    number = len(band.states) - 1
    first = band.supervisor_process
    band.supervisor_process = band.another_supervisor(RULES, "replace:=true")
    error = first.communicate()[1]
    assert first.returncode == 0
    assert f"/band/supervisor is replaced by process {band.supervisor_process.pid} on " in error
    band.until(lambda: "adopted" in band.said())
    assert cores_since(band, number) == {"mauve_examples/Accelerando"}
    band.playing = True
    band.until(lambda: band.core() == "mauve_examples/Metronome")


def test_supervisors_that_are_killed_at_random_change_nothing(band: Band):
    """MAUVE_KILLS: how many; each at another instant of the start and the work of the next one."""
    degraded(band)
    number = len(band.states) - 1
    chance = random.Random(1)  # noqa: S311
    for _ in range(int(os.environ.get("MAUVE_KILLS", "3"))):
        band.start_supervisor()
        end_s = time.monotonic() + chance.uniform(0.0, 3.0)
        while time.monotonic() < end_s:
            band.spinner.spin_once(timeout_sec=0.05)
        band.kill_supervisor()
    band.decisions.clear()
    band.start_supervisor()
    band.until(lambda: "adopted" in band.said())
    assert cores_since(band, number) == {"mauve_examples/Accelerando"}
    band.playing = True
    band.until(lambda: band.core() == "mauve_examples/Metronome")


def test_a_frozen_supervisor_is_stood_in_for_until_it_goes_on(band: Band):
    band.degrade()
    number = len(band.states) - 1
    first = band.supervisor_process
    first.send_signal(signal.SIGSTOP)
    band.decisions.clear()
    second = band.another_supervisor()
    band.until(lambda: "adopted" in band.said())
    first.send_signal(signal.SIGCONT)
    error = second.communicate()[1]
    assert second.returncode == 2
    assert f"process {first.pid}" in error
    assert first.poll() is None
    assert cores_since(band, number) == {"mauve_examples/Accelerando"}


def test_what_a_supervisor_has_in_force_may_end_with_it(band: Band):
    band.kill_supervisor()  # before it has done anything
    band.decisions.clear()
    band.start_supervisor(RULES.replace("rules:", "on_supervisor_loss: release\nrules:"))
    band.degrade()
    band.end_supervisor()
    band.until(lambda: band.core() == "mauve_examples/Metronome")
    assert not band.states[-1].active_rules


STOP = RULES.replace(
    "{silence: {topic: peer, type: std_msgs/msg/Float64, longer_than_s: 2.0}}",
    "{boolean: {topic: stop}}\n    in: supervisor",
)


@pytest.mark.parametrize(
    ("durability", "known"),
    [
        (DurabilityPolicy.TRANSIENT_LOCAL, "condition_true"),
        (DurabilityPolicy.VOLATILE, "condition_unknown"),
    ],
)
def test_a_stop_that_lasts_outlives_its_supervisor(band: Band, durability: Any, known: str):
    """Its writer keeps the last message for who comes later; or it does not, and nobody knows."""

    def start() -> None:
        band.kill_supervisor()
        band.decisions.clear()
        band.start_supervisor(STOP)

    stop = band.node.create_publisher(Bool, "/band/stop", QoSProfile(depth=1, durability=durability))
    start()
    band.until(lambda: "armed" in band.said())
    band.until(lambda: stop.publish(Bool(data=True)) or "done" in band.said())
    start()
    band.until(lambda: known in band.said())
    until_s = time.monotonic() + 1.5  # it would undo after 0.5
    band.until(lambda: time.monotonic() > until_s)
    assert "undo" not in band.said()
    assert band.core() == "mauve_examples/Accelerando"
    band.until(lambda: stop.publish(Bool(data=False)) or band.said()[-2:] == ["undo", "done"])


def test_rules_that_the_executor_would_refuse_are_told_at_arming(band: Band):
    band.kill_supervisor()
    band.decisions.clear()
    band.start_supervisor(RULES.replace("Accelerando", "NoSuchCore"))
    band.until(lambda: "refused" in band.said())
    refused = next(decision for decision in band.decisions if decision.decision == "refused")
    assert "would refuse to do: replace_core metronome mauve_examples/NoSuchCore" in refused.reason
    assert refused.message.startswith("core 'mauve_examples/NoSuchCore' is not installed")
    errors = band.end_supervisor()
    assert "[ERROR]" in errors
    assert "quiet: refused: " in errors


def test_both_end_cleanly_on_ctrl_c(band: Band):
    band.until(lambda: "armed" in band.said())
    for process in (band.supervisor_process, band.executor_process):
        process.send_signal(signal.SIGINT)
    for process in (band.supervisor_process, band.executor_process):
        _, errors = process.communicate(timeout=PATIENCE_S)
        assert process.returncode == 0
        assert "Traceback" not in errors
