"""The native bridge: any installed message type, both ways, by quality of service; and what goes wrong."""

import os
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import rclpy
from nav_msgs.msg import OccupancyGrid
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSPolicyKind,
    QoSProfile,
    ReliabilityPolicy,
)
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState, LaserScan
from std_msgs.msg import Bool, Empty, Float64, String

from mauve_rt._bridge import TopicReport
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import MauveError
from mauve_rt.model import load_architecture
from mauve_rt.node.executor.bound_resources import BoundResources

PARTS = """\
mauve: 1
executor: {sender: {priority: 7, cpus: [0]}}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            properties: {period_ms: 20}}
connections: []
resources:
"""


@dataclass
class Bound:
    """An architecture with its topics open and flowing, in the test's process."""

    runtime: Runtime
    topics: BoundResources

    def report(self, topic: str) -> TopicReport:
        """How a topic fares."""
        return next(report for report in self.topics.topics() if report.topic == topic)

    def received(self, resource: str, message_type: Any) -> Any:
        """What a resource holds."""
        return deserialize_message(self.runtime.host.read_resource(resource)[0], message_type)

    def raised(self, resource: str) -> int:
        """How often an event was raised."""
        return self.runtime.host.read_resource(resource)[1]

    def write(self, resource: str, message: Any) -> bool:
        """Write a message to a resource, as a component would."""
        return self.runtime.host.write_resource(resource, serialize_message(message))


Bind = Callable[[str], Bound]


@pytest.fixture
def bind(graph: Any, tmp_path: Path, plugin_prefix: Path) -> Iterator[Bind]:
    """bind(RESOURCES): the resources, with their topics, of a node /robot/executor."""
    del plugin_prefix
    node = LifecycleNode("executor", namespace="/robot", context=graph.node.context)
    opened: list[Bound] = []

    def make(resources: str) -> Bound:
        path = tmp_path / "robot.yaml"
        path.write_text(PARTS + resources, encoding="utf-8")
        runtime = Runtime(lambda: load_architecture(path))
        runtime.configure()
        opened.append(Bound(runtime, BoundResources(node)))
        opened[-1].topics.configure(runtime.model, runtime.architecture)
        opened[-1].topics.start()
        return opened[-1]

    yield make
    for bound in opened:
        bound.topics.close()
        bound.runtime.cleanup()
    node.destroy_node()


def test_a_type_nobody_registered_is_received_and_written(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  scan: {kind: shared_data, type: sensor_msgs/msg/LaserScan, topic: {name: scan, direction: subscribe,
         qos: sensor_data}}
""")
    voice = graph.voice(
        LaserScan, "/robot/scan", QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
    )
    said = LaserScan(ranges=[1.0, 2.5, 4.0], range_max=30.0)
    said.header.frame_id = "laser"

    def heard() -> bool:
        voice.publish(said)
        return bound.report("/robot/scan").passed > 0

    graph.spin_until(heard, "the scan")
    assert bound.received("scan", LaserScan) == said


def test_a_ring_s_messages_all_leave_in_order(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  words: {kind: ring_buffer, capacity: 100, type: std_msgs/msg/String,
          topic: {name: /words, direction: publish}}
""")
    heard = graph.hear(String, "/words", QoSProfile(depth=100))

    def matched() -> bool:
        bound.write("words", String(data="hello"))
        return bool(heard)

    graph.spin_until(matched, "a first word")
    for number in range(100):
        while not bound.write("words", String(data=str(number))):
            time.sleep(0.001)  # the ring is full: the bridge empties it
    graph.spin_until(lambda: heard[-1].data == "99", "the last word")
    assert [word.data for word in heard if word.data != "hello"] == [str(number) for number in range(100)]


def test_who_comes_late_hears_the_last_message_of_a_latched_topic(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  grid: {kind: shared_data, type: nav_msgs/msg/OccupancyGrid, topic: {name: map, direction: publish,
         qos: transient_local}}
""")
    grid = OccupancyGrid(data=[0, 100, -1])
    assert bound.write("grid", grid)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    heard = graph.hear(OccupancyGrid, "/robot/map", latched)
    graph.spin_until(lambda: bool(heard), "the map")
    assert heard[0] == grid


def test_a_message_that_is_too_large_is_refused_and_counted(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: subscribe}}
""")
    voice = graph.voice(String, "/robot/word")

    def told(word: str, report: Callable[[], int]) -> None:
        def is_told() -> bool:
            voice.publish(String(data=word))
            return report() > 0

        graph.spin_until(is_told, word[:10])

    told("short", lambda: bound.report("/robot/word").passed)
    told("x" * 100_000, lambda: bound.report("/robot/word").refused)
    assert bound.received("word", String).data == "short"


@pytest.mark.parametrize(
    ("of_class", "capacities", "filled"),
    [
        (LaserScan, "", ""),
        (JointState, "capacity: {name: 1, position: 1, velocity: 1, effort: 1}, ", "robot/base"),
    ],
    ids=["only Python has the type", "a library has the type"],
)
def test_a_message_in_another_frame_is_refused_counted_and_explained(
    bind: Bind, graph: Any, of_class: Any, capacities: str, filled: str
) -> None:
    bound = bind(f"""\
  value: {{kind: shared_data, type: sensor_msgs/msg/{of_class.__name__}, frame: robot/base,
           {capacities}topic: {{name: value, direction: subscribe}}}}
""")
    voice = graph.voice(of_class, "/robot/value")
    value = of_class()

    def told(frame: str, report: Callable[[], int]) -> None:
        value.header.frame_id = frame

        def is_told() -> bool:
            voice.publish(value)
            return report() > 0

        graph.spin_until(is_told, frame)

    told("robot/base", lambda: bound.report("/robot/value").passed)
    told("map", lambda: bound.report("/robot/value").refused)
    report = bound.report("/robot/value")
    assert report.refusal == "header.frame_id is 'map', expected 'robot/base'"
    assert bound.received("value", of_class).header.frame_id == "robot/base"
    resource = next(each for each in bound.runtime.described_resources() if each.name == "value")
    assert resource.refused_values >= 1
    assert resource.why_refused_value == report.refusal
    passed = report.passed
    told("", lambda: bound.report("/robot/value").passed - passed)
    assert bound.received("value", of_class).header.frame_id == filled


def test_an_event_is_an_empty_message_or_a_true_one(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  bump: {kind: event, type: std_msgs/msg/Empty, topic: {name: bump, direction: publish}}
  alarm: {kind: event, type: std_msgs/msg/Bool, topic: {name: alarm, direction: subscribe}}
""")
    bumps = graph.hear(Empty, "/robot/bump")
    alarms = graph.voice(Bool, "/robot/alarm")

    def matched() -> bool:
        bound.write("bump", Empty())
        return bool(bumps)

    graph.spin_until(matched, "a first bump")
    raised = 1
    while raised < 20:
        raised += bound.write("bump", Empty())
    graph.spin_until(lambda: len(bumps) >= 20, "a message a raise")

    def told(*, data: bool, passed: int) -> None:
        def is_told() -> bool:
            alarms.publish(Bool(data=data))
            return bound.report("/robot/alarm").passed >= passed

        graph.spin_until(is_told, "the alarm")

    told(data=False, passed=3)
    assert bound.raised("alarm") == 0
    told(data=True, passed=bound.report("/robot/alarm").passed + 20)
    assert bound.raised("alarm") > 0


def test_qualities_of_service_by_field_are_those_of_the_topic(bind: Bind, graph: Any) -> None:
    bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: publish,
         qos: {profile: best_effort, durability: transient_local, depth: 7, deadline_ms: 250,
               lifespan_ms: 1500, liveliness: manual_by_topic, lease_ms: 2000}}}
""")
    graph.spin_until(lambda: graph.node.count_publishers("/robot/word") > 0, "the publisher")
    (info,) = graph.node.get_publishers_info_by_topic("/robot/word")
    found = info.qos_profile
    assert (found.reliability, found.durability) == (
        ReliabilityPolicy.BEST_EFFORT,
        DurabilityPolicy.TRANSIENT_LOCAL,
    )
    assert (found.deadline, found.lifespan) == (
        Duration(nanoseconds=250_000_000),
        Duration(nanoseconds=1_500_000_000),
    )
    assert found.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
    assert found.liveliness_lease_duration == Duration(seconds=2)


def test_messages_are_sent_where_and_as_urgently_as_the_file_says(bind: Bind) -> None:
    bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: publish}}
""")
    tasks = Path("/proc/self/task").iterdir()
    senders = {(task / "comm").read_text().strip(): int(task.name) for task in tasks}
    sender, of_stops = senders["topics_out"], senders["stops_out"]
    assert os.sched_getaffinity(sender) == os.sched_getaffinity(of_stops) == {0}
    if resource.getrlimit(resource.RLIMIT_RTPRIO)[0] == 0 and os.geteuid() != 0:
        pytest.skip("needs the right to real-time priorities (rtprio)")
    assert os.sched_getscheduler(sender) == os.SCHED_FIFO
    assert os.sched_getparam(sender).sched_priority == 7
    assert os.sched_getparam(of_stops).sched_priority == 8


def test_a_quality_of_service_that_does_not_fit_is_told(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String,
         topic: {name: word, direction: subscribe, qos: reliable}}
""")
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = graph.node.create_publisher(String, "/robot/word", best_effort)
    graph.spin_until(lambda: bound.report("/robot/word").troubles.incompatible_qos > 0, "the complaint")
    assert QoSPolicyKind(bound.report("/robot/word").troubles.policy) == QoSPolicyKind.RELIABILITY
    assert publisher.get_subscription_count() == 0


def test_missed_deadlines_are_counted(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: subscribe,
         qos: {deadline_ms: 50}}}
""")
    hasty = QoSProfile(depth=1, deadline=Duration(nanoseconds=50_000_000))
    publisher = graph.node.create_publisher(String, "/robot/word", hasty)

    def heard() -> bool:
        publisher.publish(String(data="once"))
        return bound.report("/robot/word").passed > 0

    graph.spin_until(heard, "a word")  # then no more
    graph.spin_until(lambda: bound.report("/robot/word").troubles.deadlines_missed > 2, "missed deadlines")


def test_who_waits_for_events_is_not_woken_by_messages(bind: Bind, graph: Any) -> None:
    bound = bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: subscribe}}
""")
    publisher = graph.node.create_publisher(String, "/robot/word", 10)

    def heard(count: int) -> bool:
        for _ in range(10):
            publisher.publish(String(data="again"))
        return bound.report("/robot/word").passed >= count

    graph.spin_until(lambda: heard(1), "a word")
    [thread] = (
        task for task in Path("/proc/self/task").iterdir() if "topic_events" in (task / "comm").read_text()
    )

    def wakes() -> int:
        lines = (thread / "status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("voluntary_ctxt_switches"))

    before, began_s = wakes(), time.monotonic()
    graph.spin_until(lambda: heard(500), "500 words")
    pauses = 10 * (time.monotonic() - began_s)
    assert wakes() - before <= 4 * pauses + 20


def test_another_type_that_comes_to_the_topic_is_told(bind: Bind, graph: Any, domain: int) -> None:
    bound = bind("""\
  word: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: subscribe}}
""")
    elsewhere = Context()
    rclpy.init(context=elsewhere, domain_id=domain)
    stranger = Node("stranger", context=elsewhere)
    publisher = stranger.create_publisher(Float64, "/robot/word", 1)
    others = {"/robot/word": ["std_msgs/msg/Float64"]}
    graph.spin_until(lambda: bound.topics.other_types() == others, "the other type")
    assert publisher.get_subscription_count() == 0
    stranger.destroy_node()
    elsewhere.try_shutdown()


def test_a_topic_of_another_type_is_refused_and_nothing_stays_open(bind: Bind, graph: Any) -> None:
    publisher = graph.node.create_publisher(Float64, "/robot/word", 1)
    graph.spin_until(lambda: graph.node.count_publishers("/robot/word") > 0, "the publisher")
    expected = (
        "topic /robot/word carries another type already: expected std_msgs/msg/String, found std_msgs/msg/F"
    )
    with pytest.raises(MauveError, match=f"resource 'second': {expected}"):
        bind("""\
  first: {kind: shared_data, type: std_msgs/msg/String, topic: {name: first, direction: publish}}
  second: {kind: shared_data, type: std_msgs/msg/String, topic: {name: word, direction: subscribe}}
""")
    assert publisher.get_subscription_count() == 0
    graph.spin_until(lambda: graph.node.count_publishers("/robot/first") == 0, "the first topic's end")


def test_the_silence_of_a_link_is_listened_for_by_best_effort_too(bind: Bind, graph: Any) -> None:
    """While rules listen; a message is written once all the same. A best-effort topic needs no second one."""
    bound = bind("""\
  sure: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: sure, direction: subscribe}}
  quick: {kind: shared_data, type: std_msgs/msg/Float64,
          topic: {name: quick, direction: subscribe, qos: best_effort}}
""")
    sure, quick = (graph.voice(Float64, f"/robot/{name}") for name in ("sure", "quick"))
    bound.topics.listen_for_silence({"sure", "quick"}, ())
    assert sure.get_subscription_count() <= 1
    bound.topics.listen_for_silence((), {"sure", "quick"})
    graph.spin_until(lambda: sure.get_subscription_count() == 2, "the second subscription")
    for _ in range(5):
        sure.publish(Float64(data=1.0))
    graph.spin_until(lambda: bound.report("/robot/sure").passed >= 5, "the messages")
    assert quick.get_subscription_count() == 1
    bound.topics.listen_for_silence({"sure"}, ())
    graph.spin_until(lambda: sure.get_subscription_count() == 1, "the second subscription to be gone")
    assert bound.report("/robot/sure").passed == 5


def test_sequences_go_from_topic_to_topic_and_what_is_too_long_is_explained(bind: Bind, graph: Any) -> None:
    capacity = "capacity: {name: 3, position: 3, velocity: 3, effort: 3}"
    bound = bind(f"""\
  joints: {{kind: shared_data, type: sensor_msgs/msg/JointState, {capacity},
           topic: {{name: joints, direction: subscribe}}}}
  turned: {{kind: shared_data, type: sensor_msgs/msg/JointState, {capacity},
           topic: {{name: turned, direction: publish}}}}
""")
    voice = graph.voice(JointState, "/robot/joints", QoSProfile(depth=5))
    heard = graph.hear(JointState, "/robot/turned", QoSProfile(depth=5))
    said = JointState(name=["elbow", "wrist"], position=[1.0, 2.5])

    def passed() -> bool:
        voice.publish(said)
        return bound.report("/robot/joints").passed > 0

    graph.spin_until(passed, "the joints")
    assert bound.received("joints", JointState) == said
    message = bound.runtime.host.read_resource("joints")[0]

    def came() -> bool:
        bound.runtime.host.write_resource("turned", message)
        return bool(heard)

    graph.spin_until(came, "what was written")
    assert heard[-1] == said

    said.position = [0.0] * 4

    def refused() -> bool:
        voice.publish(said)
        return bool(bound.report("/robot/joints").refusal)

    graph.spin_until(refused, "the refusal")
    assert bound.report("/robot/joints").refusal.startswith(
        "position has 4 elements, the resource's capacity is 3"
    )
