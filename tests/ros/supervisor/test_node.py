"""The supervisor node against a stand-in for the executor: real topics, services and times."""

import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from domains import draw_domain
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import PATIENCE_S, wait_for_signals

from mauve_msgs.msg import (
    ArchitectureState,
    ComponentInfo,
    ComponentStatus,
    PeerMessage,
    ReplyCode,
    SupervisorDecision,
)
from mauve_msgs.srv import Reconfigure, WriteSnapshot
from mauve_rt.errors import ArchitectureFileError
from mauve_rt.node.supervisor.node import Supervisor
from mauve_rt.supervision.rules import RulesFile

LOCAL, USUAL = "mauve_examples/LocalExploration", "mauve_examples/Exploration"
RULES = f"""\
mauve: 1
rules:
  - name: link_lost
    when: {{silence: {{topic: radio/in, type: mauve_msgs/msg/PeerMessage, longer_than_s: 0.5}}}}
    do: [{{kind: replace_core, target: exploration, name: {LOCAL}}}]
    undo: {{for_s: 0.5, do: [{{kind: replace_core, target: exploration, name: {USUAL}}}]}}
"""
LATCHED = DurabilityPolicy.TRANSIENT_LOCAL


class StandIn:
    """Answers as an executor would, and speaks as a peer while `talking`."""

    def __init__(self, context: Context) -> None:
        self.requests: list[Any] = []
        self.refuse_with = 0
        self.talking = True
        self.number = 0
        self.core = USUAL
        self.active: set[str] = set()  # rules
        self.revision = 0
        self.node = Node("executor", namespace="/robot_1", context=context)
        latched = QoSProfile(depth=1, durability=LATCHED)
        self._state = self.node.create_publisher(ArchitectureState, "~/state", latched)
        self._voice = self.node.create_publisher(PeerMessage, "radio/in", 10)
        self.snapshots: list[Any] = []
        self.node.create_service(Reconfigure, "~/reconfigure", self._reconfigure)
        self.node.create_service(WriteSnapshot, "~/write_snapshot", self._write_snapshot)
        self.node.create_timer(0.1, self._speak)

    def tell(self) -> None:
        self.revision += 1
        status = ComponentStatus(name="exploration", state=ComponentInfo.RUNNING, core=self.core)
        state = ArchitectureState(instance_id="one", revision=self.revision, components=[status])
        state.active_rules = sorted(self.active)
        self._state.publish(state)

    def _speak(self) -> None:
        if self.talking:
            self._voice.publish(PeerMessage(sender="robot_2", sequence=self.number))

    def _write_snapshot(self, request: Any, response: Any) -> Any:
        self.snapshots.append(request)
        response.success = True
        return response

    def _reconfigure(self, request: Any, response: Any) -> Any:
        self.requests.append(request)
        if self.refuse_with:
            response.code, self.refuse_with = self.refuse_with, 0
            response.message = "refused for the test"
        else:
            (self.active.discard if request.release else self.active.add)(request.rule)
            self.core = request.steps[0].name
            self.tell()
            response.success = True
        response.revision = self.revision
        return response


class Graph:
    """A context of its own, everything in it spun by the test."""

    def __init__(self) -> None:
        self.context = Context()
        rclpy.init(context=self.context, domain_id=draw_domain())
        self.executor = SingleThreadedExecutor(context=self.context)

    def add(self, node: Node) -> Node:
        self.executor.add_node(node)
        return node

    def until(self, condition: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert time.monotonic() < deadline_s, "it did not happen"
            self.executor.spin_once(timeout_sec=0.1)

    def spin(self, seconds: float) -> None:
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            self.executor.spin_once(timeout_sec=0.05)

    def close(self) -> None:
        for node in self.executor.get_nodes():
            node.destroy_node()
        self.executor.shutdown()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def graph() -> Iterator[Graph]:
    graph = Graph()
    yield graph
    graph.close()


@pytest.fixture
def rules(tmp_path: Path) -> Path:
    path = tmp_path / "rules.yaml"
    path.write_text(RULES, encoding="utf-8")
    return path


def supervised(graph: Graph, rules: Path) -> tuple[StandIn, list[Any]]:
    """The stand-in, and the decisions as a subscriber that joined late gets them."""
    stand_in = StandIn(graph.context)
    graph.add(stand_in.node)
    node = graph.add(Node("supervisor", namespace="/robot_1", context=graph.context))
    supervisor = Supervisor(node, RulesFile(rules))
    node.supervisor_kept_alive = supervisor  # type: ignore[attr-defined]
    graph.until(lambda: node.count_subscribers("/robot_1/executor/state") > 0)
    graph.until(lambda: stand_in.node.count_clients("/robot_1/executor/reconfigure") > 0)
    graph.spin(0.5)
    stand_in.tell()
    decisions: list[Any] = []
    listener = graph.add(Node("listener", context=graph.context))
    qos = QoSProfile(depth=100, durability=LATCHED)
    listener.create_subscription(SupervisorDecision, "/robot_1/supervisor/decisions", decisions.append, qos)
    graph.until(lambda: len(decisions) > 0)
    return stand_in, decisions


def said(decisions: list[Any]) -> list[str]:
    return [decision.decision for decision in decisions]


def test_a_silent_peer_leads_to_the_swap_and_its_return_to_the_swap_back(graph: Graph, rules: Path):
    stand_in, decisions = supervised(graph, rules)
    graph.spin(1.0)
    assert said(decisions) == ["armed"]
    stand_in.talking = False
    graph.until(lambda: "done" in said(decisions))
    stand_in.talking = True
    graph.until(lambda: said(decisions).count("done") == 2)
    assert said(decisions) == ["armed", "condition_true", "do", "done", "condition_false", "undo", "done"]
    assert [decision.rule for decision in decisions] == ["link_lost"] * 7
    first, second = stand_in.requests
    assert [(step.kind, step.target, step.name) for step in first.steps] == [
        ("replace_core", "exploration", LOCAL)
    ]
    assert second.steps[0].name == USUAL
    assert first.requested_by == "/robot_1/supervisor"
    assert first.cause.startswith("link_lost: nothing on /robot_1/radio/in for 0.")
    assert [first.expected_revision, second.expected_revision] == [1, 2]
    assert uuid.UUID(first.request_id) != uuid.UUID(second.request_id)
    do = decisions[2]
    assert do.silence_s > 0.5
    assert do.revision == 1
    assert do.stamp.sec > 0


def test_the_command_lists_the_rules_of_a_supervisor(graph: Graph, rules: Path, tmp_path: Path):
    stand_in, decisions = supervised(graph, rules)
    stand_in.talking = False
    graph.until(lambda: "done" in said(decisions))
    command = [sys.executable, "-m", "mauve_rt.cli", "rules", "list", "/robot_1/supervisor"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(graph.context.get_domain_id())}
    with (tmp_path / "out").open("w+", encoding="utf-8") as out:
        process = subprocess.Popen(command, env=environment, stdout=out, text=True)
        graph.until(lambda: process.poll() is not None)
        assert process.returncode == 0
        out.seek(0)
        listed = out.read()
    (row,) = [line.split() for line in listed.splitlines() if line.lstrip().startswith("link_lost")]
    assert row[:3] == ["link_lost", "yes", "true"]
    assert "in effect" in listed
    assert not [line for line in listed.splitlines() if line != line.rstrip()], "blanks at the end of a line"


def test_a_rule_asks_the_executor_for_a_snapshot_when_its_action_begins(graph: Graph, rules: Path):
    rules.write_text(f"{RULES.rstrip()}\n    snapshot: true\n", encoding="utf-8")
    stand_in, decisions = supervised(graph, rules)
    graph.spin(1.0)
    stand_in.talking = False
    graph.until(lambda: "done" in said(decisions) and len(stand_in.snapshots) > 0)
    stand_in.talking = True
    graph.until(lambda: said(decisions).count("done") == 2)
    assert [each.requested_by for each in stand_in.snapshots] == ["/robot_1/supervisor"]
    assert stand_in.snapshots[0].cause.startswith("link_lost: nothing on /robot_1/radio/in for 0.")


def test_the_value_of_a_field_and_a_tree(graph: Graph, rules: Path):
    """The peer's number is out of bounds while the peer is heard."""
    value = "{value: {topic: radio/in, type: mauve_msgs/msg/PeerMessage, field: sequence, above: 5}}"
    silence = RULES[RULES.index("{silence") : RULES.index("    do:")].strip()
    rules.write_text(RULES.replace(silence, f"{{all: [{value}, {{not: {silence}}}]}}"), encoding="utf-8")
    stand_in, decisions = supervised(graph, rules)
    graph.spin(1.0)
    assert said(decisions) == ["armed"]
    stand_in.number = 6
    graph.until(lambda: "done" in said(decisions))
    assert "sequence of /robot_1/radio/in above 5" in stand_in.requests[0].cause
    stand_in.number = 5
    graph.until(lambda: said(decisions).count("done") == 2)


def watching(rules: Path, when: str) -> None:
    """Let the rule be the supervisor's, and wait for something else."""
    silence = RULES[RULES.index("{silence") : RULES.index("    do:")].strip()
    rules.write_text(RULES.replace(silence, f"{when}\n    in: supervisor"), encoding="utf-8")


@pytest.mark.parametrize("state", ["faulted", "another_instance", "gone"])
def test_another_executor(graph: Graph, rules: Path, state: str):
    watching(rules, f"{{peer: {{executor: robot_2, is: {state}}}}}")
    stand_in, decisions = supervised(graph, rules)
    node = graph.add(Node("executor", namespace="/robot_2", context=graph.context))
    latched = QoSProfile(depth=1, durability=LATCHED)
    states = node.create_publisher(ArchitectureState, "~/state", latched)
    running = ComponentStatus(name="camera", state=ComponentInfo.RUNNING)
    states.publish(ArchitectureState(instance_id="one", components=[running]))
    graph.spin(1.0)
    assert said(decisions) == ["armed"]
    if state == "gone":
        graph.executor.remove_node(node)
        node.destroy_node()
    else:
        instance = "one" if state == "faulted" else "two"
        states.publish(
            ArchitectureState(
                instance_id=instance,
                components=[ComponentStatus(name="camera", state=ComponentInfo.FAULTED)]
                if state == "faulted"
                else [running],
            )
        )
    graph.until(lambda: "done" in said(decisions))
    assert f"executor robot_2: {state}" in stand_in.requests[0].cause


def test_a_diagnostic(graph: Graph, rules: Path):
    watching(rules, '{diagnostic: {status: "battery: cells", level: ERROR}}')
    stand_in, decisions = supervised(graph, rules)
    node = graph.add(Node("battery", context=graph.context))
    diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)

    def say(name: str, level: bytes) -> None:
        diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(name=name, level=level)]))
        graph.spin(0.5)

    graph.spin(0.5)
    say("battery: cells", DiagnosticStatus.WARN)
    say("battery: case", DiagnosticStatus.ERROR)
    assert said(decisions) == ["armed"]
    say("battery: cells", DiagnosticStatus.STALE)
    graph.until(lambda: "done" in said(decisions))
    assert stand_in.requests[0].cause == "link_lost: diagnostic 'battery: cells' says ERROR or worse"
    say("battery: cells", DiagnosticStatus.OK)
    graph.until(lambda: said(decisions).count("done") == 2)


def test_what_only_the_executor_hears_is_refused(graph: Graph, rules: Path):
    watching(rules, "{overruns: {component: exploration}}")
    with pytest.raises(
        ArchitectureFileError, match=r":4:.*overruns of exploration are known.*`in: executor`"
    ):
        RulesFile(rules)


def test_a_field_that_is_not_there_is_refused_at_the_start(graph: Graph, rules: Path):
    value = "{value: {topic: radio/in, type: mauve_msgs/msg/PeerMessage, field: sender, above: 5}}"
    silence = RULES[RULES.index("{silence") : RULES.index("    do:")].strip()
    rules.write_text(RULES.replace(silence, value), encoding="utf-8")
    with pytest.raises(ArchitectureFileError, match=r"field 'sender' of .* is no number"):
        Supervisor(graph.add(Node("supervisor", context=graph.context)), RulesFile(rules))


def test_a_refusal_is_told_and_tried_again(graph: Graph, rules: Path):
    stand_in, decisions = supervised(graph, rules)
    stand_in.refuse_with = ReplyCode.PREPARE_FAILED
    stand_in.talking = False
    graph.until(lambda: "done" in said(decisions))
    assert said(decisions) == ["armed", "condition_true", "do", "failed", "do", "done"]
    assert decisions[3].message == "refused for the test"


def test_who_swapped_by_hand_before_is_told_that_the_rule_is_active(graph: Graph, rules: Path):
    """The executor finds that nothing is to be done; and gives back what was chosen by hand."""
    stand_in, decisions = supervised(graph, rules)
    stand_in.core = LOCAL
    stand_in.tell()
    stand_in.talking = False
    graph.until(lambda: len(decisions) >= 4)
    assert said(decisions) == ["armed", "condition_true", "do", "done"]
    (request,) = stand_in.requests
    assert (request.rule, request.release, request.priority) == ("link_lost", False, 0)


def test_an_executor_that_is_gone_is_a_failure_that_is_told(graph: Graph, rules: Path):
    stand_in, decisions = supervised(graph, rules)
    graph.executor.remove_node(stand_in.node)
    stand_in.node.destroy_node()
    graph.until(lambda: "failed" in said(decisions))
    assert "not sent" in decisions[-1].reason
    assert decisions[-1].message == "service /robot_1/executor/reconfigure is not there"


def test_a_message_type_that_is_not_installed_is_refused(graph: Graph, rules: Path):
    rules.write_text(RULES.replace("PeerMessage", "NoMessage"), encoding="utf-8")
    node = graph.add(Node("supervisor", context=graph.context))
    with pytest.raises(ArchitectureFileError, match=r":4:45: message type mauve_msgs/msg/NoMessage is"):
        Supervisor(node, RulesFile(rules))


def run(*arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "mauve_rt.node.supervisor.main", "--ros-args", *arguments],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"ROS_DOMAIN_ID": str(draw_domain())},
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], "parameter 'rules' is missing"),
        (["-p", "rules:=/nowhere.yaml"], "/nowhere.yaml:1:1: "),
        (["-p", "rules:=7"], "parameter rules: expected text, found 7"),
        (["--no-such-option"], "supervisor: "),
    ],
)
def test_bad_input_ends_the_process_with_one_line(arguments: list[str], words: str):
    process = run(*arguments)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 2
    assert errors.count("\n") == 1
    assert words in errors


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_cleanly(rules: Path, number: signal.Signals):
    process = run("-r", "__ns:=/robot_1", "-p", f"rules:={rules}")
    wait_for_signals(process.pid)
    time.sleep(random.uniform(0.0, 2.0))  # noqa: S311  any moment is a good one
    process.send_signal(number)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert "Traceback" not in errors
