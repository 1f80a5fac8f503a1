"""A driver with a time of its own is safe whatever becomes of the executor."""

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from std_msgs.msg import Float64

from mauve_rt.driver import CommandWatch

TIMEOUT_S = 0.3
SAFE = -1.0  # not what the executor writes at a stop


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_killed_executor_leaves_a_driver_safe(
    end: signal.Signals, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text("utf-8")
    bound = "topic: {name: count, direction: publish"
    assert bound in text
    timeout = f"{bound}, driver_timeout_ms: {TIMEOUT_S * 1e3:g}"
    architecture.write_text(text.replace(bound, timeout), encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}")
    watch = CommandWatch(TIMEOUT_S, safe=SAFE)
    last_s = 0.0

    def received(message: Float64) -> None:
        nonlocal last_s
        last_s = time.monotonic()
        watch.received(message.data)

    # The executor offers the deadline: else the two would not be connected.
    qos = QoSProfile(depth=1, deadline=Duration(seconds=TIMEOUT_S))
    graph.node.create_subscription(Float64, "/robot_1/count", received, qos)
    graph.spin_until(lambda: watch.value > 0, "commands")
    try:
        executor.process.send_signal(end)
        graph.spin_until(lambda: watch.value == SAFE, "the safe command")
        assert watch.is_safe
        assert time.monotonic() - last_s >= TIMEOUT_S
    finally:
        executor.process.send_signal(signal.SIGCONT)
        executor.process.kill()
