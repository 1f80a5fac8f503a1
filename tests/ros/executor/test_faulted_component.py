"""A faulted component is repaired in place, by services and by the command line."""

import os
import subprocess
import sys
from typing import Any

import pytest
from preparations import NODE
from std_msgs.msg import Float64

from mauve_msgs.msg import ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Start
from mauve_rt.control.requests import Code

BACKWARDS = "executor_tests/Backwards"


class Counter:
    """The counter, which faults when it is told to, and what it counts."""

    def __init__(self, graph: Any) -> None:
        self._graph = graph
        self.counts = graph.hear(Float64, "/robot_1/count")
        self._voice = graph.voice(Float64, "/robot_1/set")

    def look(self) -> Any:
        return self._graph.ask(ListComponents, f"{NODE}/list_components").components[0]

    def fault(self) -> None:
        self._voice.publish(Float64(data=-1e9))
        self._graph.spin_until(lambda: self.look().state == ComponentInfo.FAULTED, "the fault")
        self._voice.publish(Float64(data=0.0))  # or the next core would find the same

    def await_counts(self) -> None:
        self.counts.clear()
        self._graph.spin_until(lambda: sum(count.data != 0.0 for count in self.counts) > 2, "counts")


@pytest.fixture
def counter(executor: Any, graph: Any) -> Counter:
    counter = Counter(graph)
    counter.await_counts()
    counter.fault()
    return counter


def _start(graph: Any) -> Any:
    return graph.ask(Start, f"{NODE}/start", component="counter")


def test_by_a_new_core_and_a_start(counter: Counter, graph: Any) -> None:
    refused = _start(graph)
    assert refused.code == Code.FAULTED
    assert "replace" in refused.message
    reply = graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=BACKWARDS)
    assert reply.success, reply.message
    assert (reply.report[0].from_core, reply.report[0].to_core) == ("executor_tests/Counter", BACKWARDS)
    found = counter.look()
    assert (found.state, found.core, found.fault) == (ComponentInfo.STOPPED, BACKWARDS, "")
    assert _start(graph).success
    counter.await_counts()


@pytest.mark.parametrize("kinds", [("configure",), ("configure", "start")])
def test_by_configuring_it_anew_and_a_start(counter: Counter, graph: Any, kinds: tuple[str, ...]) -> None:
    steps = [ReconfigurationStep(kind=kind, target="counter") for kind in kinds]
    reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    assert reply.success, reply.message
    if "start" not in kinds:
        assert (counter.look().state, counter.look().fault) == (ComponentInfo.STOPPED, "")
        assert _start(graph).success
    counter.await_counts()
    counter.fault()  # and again
    assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps).success


def test_by_the_command_line(counter: Counter, graph: Any) -> None:
    def mauve(*words: str, told: str = "") -> tuple[int, str]:
        environment = {**os.environ, "ROS_DOMAIN_ID": str(graph.node.context.get_domain_id())}
        command = [sys.executable, "-m", "mauve_rt.cli", *words]
        done = subprocess.run(
            command, env=environment, input=told, capture_output=True, text=True, check=False
        )
        return done.returncode, done.stdout + done.stderr

    status, said = mauve("start", NODE, "counter")
    assert (status, "refused, FAULTED (6): " in said) == (1, True), said
    repair = "- {kind: configure, target: counter}\n- {kind: start, target: counter}\n"
    status, said = mauve("reconfigure", NODE, "-", told=repair)
    assert (status, "2 steps are in force" in said) == (0, True), said
    counter.await_counts()
