"""Names of an executor and of a supervisor: relative to the namespace, remapped as those of any ROS node."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.srv import GetState
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.highlevel import AnyReader
from std_msgs.msg import Float64

from mauve_msgs.msg import ArchitectureState, ReconfigurationEvent
from mauve_msgs.srv import ListComponents, Stop
from mauve_rt.node.supervisor.node import Supervisor
from mauve_rt.supervision.rules import RulesFile

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
REMAPPINGS = (
    "__node:=boss",
    "boss:__ns:=/robot_7",  # not /robot_1, as the architecture file says
    "__ns:=/robot_8",  # the first one counts
    "executor:__ns:=/robot_9",  # its name no longer
    "count:=set",  # an exchange: each name is remapped once, not twice
    "boss:set:=count",
    "executor:count:=never",
    "talk:=/speech",
    "~/events:=events",
    "~/stop:=/halt",
    "/diagnostics:=health",
)
PARAMETERS = """\
/robot_7/boss: {ros__parameters: {counter: {step: 3}}}
/robot_8/boss: {ros__parameters: {guard: {step: 4}}}
/robot_7/executor: {ros__parameters: {guard: {step: 5}}}
"""
RULES = """\
mauve: 1
rules:
  - name: quiet
    when: {silence: {topic: peer, type: std_msgs/msg/Float64, longer_than_s: 5.0}}
    do: [{kind: stop, target: guard}]
"""


def test_an_executor_s_names_are_remapped(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    parameters = tmp_path / "parameters.yaml"
    parameters.write_text(PARAMETERS, encoding="utf-8")
    arguments = [word for rule in REMAPPINGS for word in ("-r", rule)]
    arguments += ["--params-file", str(parameters)]
    topics = "record_topics:=['talk:std_msgs/msg/Float64']"
    for parameter in (f"architecture:={architecture}", f"bag:={bag}", topics, "boss:guard.step:=6"):
        arguments += ["-p", parameter]  # `boss:` stands for `/boss`, as in rcl
    executor = start_executor(*arguments)

    states = graph.hear(ArchitectureState, "/robot_7/boss/state", LATCHED)
    events = graph.hear(ReconfigurationEvent, "/robot_7/events")
    health = graph.hear(DiagnosticArray, "/robot_7/health")
    counts = graph.hear(Float64, "/robot_7/set")
    voice, speech = graph.voice(Float64, "/robot_7/count"), graph.voice(Float64, "/speech")

    counter, guard, _ = graph.ask(ListComponents, "/robot_7/boss/list_components").components
    assert "step=3.0" in counter.properties
    assert not {"step=4.0", "step=5.0", "step=6.0"} & set(guard.properties)
    graph.spin_until(lambda: len(counts) > 2, "counts by their other name")
    graph.spin_until(lambda: len(states) > 0, "the state")
    graph.spin_until(lambda: len(health) > 0, "diagnostics by their other name")
    assert health[-1].status[0].name == "/robot_7/boss: counter"
    assert graph.ask(GetState, "/robot_7/boss/get_state").current_state.label == "active"

    def heard_event() -> bool:
        graph.ask(Stop, "/halt", component="nobody", cause="a test")
        return any(event.cause == "a test" for event in events)

    graph.spin_until(heard_event, "an event by its other name")
    names = dict(graph.node.get_topic_names_and_types())
    assert {"/robot_1/count", "/robot_7/never", "/robot_7/talk", "/diagnostics"}.isdisjoint(names)
    assert graph.node.count_publishers("/robot_7/count") == 1  # the test's own
    topics = {"/robot_7/set", "/robot_7/count", "/speech", "/robot_7/events", "/robot_7/boss/state"}

    def recorded() -> bool:
        voice.publish(Float64(data=5.0))
        speech.publish(Float64(data=1.0))
        metadata = (bag / "metadata.yaml").read_text(encoding="utf-8")  # replaced as a whole
        return all(f'"{topic}"' in metadata for topic in topics)

    graph.spin_until(recorded, "the bag's topics by their other names")
    assert executor.end(signal.SIGTERM)[0] == 0, executor.output
    with AnyReader([bag]) as reader:
        assert topics <= set(reader.topics)


def test_a_supervisor_s_names_are_remapped(graph: Any, domain: int, tmp_path: Path) -> None:
    file = tmp_path / "rules.yaml"
    file.write_text(RULES, encoding="utf-8")
    rules = ("executor:=boss", "peer:=noise", "noise:=peer", "~/decisions:=decisions")
    words = [word for rule in ("__ns:=/robot_7", *rules) for word in ("-r", rule)]
    context = Context()
    rclpy.init(context=context, domain_id=domain)
    node = Node("supervisor", context=context, cli_args=["--ros-args", *words])
    supervisor = Supervisor(node, RulesFile(file))
    node_name, namespace = "supervisor", "/robot_7"
    try:
        subscribed = dict(node.get_subscriber_names_and_types_by_node(node_name, namespace))
        assert {"/robot_7/boss/state", "/robot_7/noise"} <= set(subscribed)
        assert "/robot_7/peer" not in subscribed
        asked = dict(node.get_client_names_and_types_by_node(node_name, namespace))
        assert "/robot_7/boss/reconfigure" in asked
        published = dict(node.get_publisher_names_and_types_by_node(node_name, namespace))
        assert "/robot_7/decisions" in published
    finally:
        del supervisor
        node.destroy_node()
        context.try_shutdown()
