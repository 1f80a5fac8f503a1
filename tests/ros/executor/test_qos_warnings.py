"""An executor says at its start which of its subscriptions ordinary publishers will not match."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from std_msgs.msg import Float64

DEADLINE = "topic: {name: set, direction: subscribe, qos: {deadline_ms: 200}}"
OTHER = """\
  other: {kind: shared_data, type: std_msgs/msg/Float64,
          topic: {name: other, direction: subscribe, qos: {profile: sensor_data, depth: 1}}}
"""


def test_a_deadline_that_nobody_promises_is_logged_and_matches_nobody(
    start_executor: Callable[..., Any], architecture: Path, graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("topic: {name: set, direction: subscribe}", DEADLINE)
    text = text.replace("connections:", f"{OTHER}connections:")
    architecture.write_text(text, encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}")
    graph.voice(Float64, "/robot_1/other")  # an ordinary publisher finds README's example ...
    ordinary = graph.node.create_publisher(Float64, "/robot_1/set", 10)
    graph.spin_until(lambda: graph.node.count_subscribers("/robot_1/set") > 0, "the other subscription")
    assert ordinary.get_subscription_count() == 0  # ... and not one with a deadline
    executor.await_output("will not receive")
    warnings = [line for line in executor.output.splitlines() if "will not receive" in line]
    assert len(warnings) == 1
    assert "topic 'set' of resource 'set' will not receive, by its deadline_ms" in warnings[0]
