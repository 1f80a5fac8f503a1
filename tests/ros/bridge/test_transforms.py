"""A transform_tree on /tf and /tf_static, both ways."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_msgs.msg import TransformOutcome
from mauve_msgs.srv import LookupTransform, SetTransform
from tf2_msgs.msg import TFMessage

FILE = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  count: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}
resources:
  sent: {kind: transform_tree, frames: 8, history: 16,
         topic: {name: /tf, direction: publish}, service: {name: set, offers: set}}
  seen: {kind: transform_tree,
         topic: {name: /tf, direction: subscribe}, service: {name: lookup, offers: lookup}}
"""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.fixture
def frames(start_executor: Callable[..., Any], tmp_path: Path) -> Any:
    """An executor that runs `FILE`."""
    path = tmp_path / "frames.yaml"
    path.write_text(FILE, encoding="utf-8")
    return start_executor("-p", f"architecture:={path}")


def _set(graph: Any, parent: str, child: str, x: float, *, is_static: bool = False) -> int:
    request = SetTransform.Request()
    request.transform.translation.x = x
    return int(
        graph.ask(
            SetTransform,
            "/robot_1/set",
            parent=parent,
            child=child,
            transform=request.transform,
            time_ns=time.monotonic_ns(),
            is_static=is_static,
        ).outcome
    )


def _lookup(graph: Any, target: str, source: str) -> Any:
    return graph.ask(LookupTransform, "/robot_1/lookup", target=target, source=source)


def _stamped(parent: str, child: str, y: float) -> TransformStamped:
    stamped = TransformStamped(child_frame_id=child)
    stamped.header.frame_id = parent
    stamped.header.stamp.sec, stamped.header.stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)
    stamped.transform.translation.y = y
    return stamped


def test_transforms_of_ros_are_looked_up(frames: Any, graph: Any) -> None:
    moving = graph.voice(TFMessage, "/tf")
    fixed = graph.voice(TFMessage, "/tf_static", LATCHED)
    fixed.publish(TFMessage(transforms=[_stamped("base", "camera", 10.0)]))

    def is_connected() -> bool:
        moving.publish(TFMessage(transforms=[_stamped("map", "base", 1.0)]))
        return bool(_lookup(graph, "map", "camera").outcome == TransformOutcome.DONE)

    before_ns = time.monotonic_ns()
    graph.spin_until(is_connected, "a transform over both topics")
    found = _lookup(graph, "map", "camera")
    assert found.transform.translation.y == 11.0
    assert found.time_ns >= before_ns, "stamps are of the real clock, times of the monotonic one"
    assert "WARN" not in frames.output
    moving.publish(TFMessage(transforms=[_stamped("base", "map", 1.0)]))
    frames.await_output("topic /tf of resource 'seen': 1 message refused: frame 'map': loop")


@pytest.mark.usefixtures("frames")
def test_transforms_that_are_set_are_published(graph: Any) -> None:
    heard = graph.hear(TFMessage, "/tf")
    assert _set(graph, "base", "camera", 10.0, is_static=True) == TransformOutcome.DONE
    assert _set(graph, "base", "lidar", 20.0, is_static=True) == TransformOutcome.DONE

    def has_come() -> bool:
        assert _set(graph, "map", "base", 1.0) == TransformOutcome.DONE
        return bool(heard)

    graph.spin_until(has_come, "a transform on /tf")
    [stamped] = heard[-1].transforms
    assert (stamped.header.frame_id, stamped.child_frame_id) == ("map", "base")
    late = graph.hear(TFMessage, "/tf_static", LATCHED)
    graph.spin_until(lambda: bool(late), "the static transforms")
    assert {each.child_frame_id for each in late[-1].transforms} == {"camera", "lidar"}
    graph.spin_until(
        lambda: _lookup(graph, "map", "lidar").outcome == TransformOutcome.DONE, "its own listener"
    )
