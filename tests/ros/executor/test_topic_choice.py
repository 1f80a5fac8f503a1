"""Which topics patterns take, by a real graph of nodes."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rclpy.lifecycle import LifecycleNode
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64, String

from mauve_rt.node.executor.topic_choice import TopicChoice

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def node(graph: Any) -> Iterator[LifecycleNode]:
    made = LifecycleNode("recorder", namespace="/robot_1", context=graph.node.context)
    yield made
    made.destroy_node()


@pytest.fixture
def choice(graph: Any, node: LifecycleNode) -> TopicChoice:
    """Of a graph with these topics; a resource is bound to /camera/bound."""
    graph.node.create_publisher(Float64, "/camera/left", 10)
    graph.node.create_publisher(Float64, "/camera/bound", 10)
    graph.node.create_publisher(String, "/camera/info", LATCHED)
    graph.node.create_publisher(Float64, "/camera/_hidden", 10)
    graph.node.create_publisher(String, "/robot_1/camera/left", 10)
    known = {"/camera/left", "/camera/bound", "/camera/info", "/camera/_hidden", "/robot_1/camera/left"}
    graph.spin_until(lambda: known <= {name for name, _ in node.get_topic_names_and_types()}, "the topics")
    return TopicChoice(node, lambda: {"/camera/bound": "std_msgs/msg/Float64"})


def taken(choice: TopicChoice, *topics: str, expressions: tuple[str, ...] = ()) -> dict[str, tuple[str, str]]:
    chosen = choice.choose(topics, expressions).topics
    assert len({topic.full_name for topic in chosen}) == len(chosen)
    return {topic.full_name: (topic.type_name, topic.qos) for topic in chosen}


BEST_EFFORT = ("std_msgs/msg/Float64", "best_effort")


def test_a_pattern_takes_whole_names_and_what_is_below(choice: TopicChoice) -> None:
    assert taken(choice, "/camera/*") == {
        "/camera/left": BEST_EFFORT,
        "/camera/info": ("std_msgs/msg/String", "transient_local"),
    }
    assert set(taken(choice, "/*/left")) == {"/camera/left", "/robot_1/camera/left"}
    assert set(taken(choice, "/camera/l?ft")) == set(taken(choice, "/camera/[kl]eft")) == {"/camera/left"}
    assert taken(choice, "/camera*x") == {}


def test_a_regular_expression_takes_names_that_contain_a_match(choice: TopicChoice) -> None:
    assert set(taken(choice, expressions=("camera/l",))) == {"/camera/left", "/robot_1/camera/left"}
    assert set(taken(choice, expressions=("^/camera/l.*t$",))) == {"/camera/left"}


def test_a_pattern_names_a_type_and_a_quality_of_service(choice: TopicChoice) -> None:
    assert taken(choice, "/camera/*:std_msgs/msg/Float64") == {"/camera/left": BEST_EFFORT}
    assert taken(choice, "/camera/i*::reliable") == {"/camera/info": ("std_msgs/msg/String", "reliable")}


def test_a_hidden_topic_has_to_be_named(choice: TopicChoice) -> None:
    assert set(taken(choice, "/camera/_*")) == {"/camera/_hidden"}


def test_a_topic_that_is_named_stays_as_it_is_named(choice: TopicChoice) -> None:
    assert taken(choice, "/camera/left:std_msgs/msg/Float64:reliable", "/camera/*")["/camera/left"] == (
        "std_msgs/msg/Float64",
        "reliable",
    )


def test_a_type_that_is_not_installed_is_named_once(
    choice: TopicChoice, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    for _ in range(3):
        assert taken(choice, "/camera/*") == {}
    said = capfd.readouterr().err
    assert said.count("/camera/* takes it") == 2
    what = (
        "its type std_msgs/msg/String is not installed; install the package of the type: it is not recorded"
    )
    assert f"topic /camera/info to record: /camera/* takes it, but {what}" in said
