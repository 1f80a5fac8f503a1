"""Messages of a simulation are what rclpy makes of them, but for what lies between their fields."""

from typing import Any

import pytest
from geometry_msgs.msg import Point, PoseWithCovariance, Twist
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Bool, Float64MultiArray, Header, MultiArrayDimension, String

from mauve_msgs.msg import (
    ArchitectureState,
    ComponentInfo,
    ComponentStatus,
    PortInfo,
    ReconfigurationEvent,
    StepReport,
    TraceArchitecture,
)
from mauve_rt.simulation.messages import serialize

PORT = PortInfo(name="a port", kind=2, type="geometry_msgs/msg/Point", resource="r", service="write")
COMPONENT = ComponentInfo(
    name="c\u00e4",
    state=2,
    clock_ns=-5,
    priority=80,
    cpus=[1, 2, 65535],
    ports=[PORT, PORT],
    properties=["a=1", ""],
)
MESSAGES = [
    Bool(data=True),
    String(data="word"),
    Point(x=1.0, y=-2.5, z=1e300),
    Twist(),
    Header(frame_id="map"),
    PoseWithCovariance(covariance=[float(number) for number in range(36)]),
    Float64MultiArray(data=[1.0, 2.0]),
    OccupancyGrid(data=[-1, 0, 100]),
    PORT,
    COMPONENT,
    TraceArchitecture(epoch_ns=7, components=[COMPONENT, ComponentInfo(), COMPONENT]),
    ArchitectureState(components=[ComponentStatus(name="x", state=1, core="abc")]),
    ReconfigurationEvent(success=True, code=7, report=[StepReport(step="replace_core", blackout_ns=1)]),
]


@pytest.mark.parametrize("message", MESSAGES, ids=lambda message: type(message).__name__)
def test_rclpy_reads_the_same_message(message: Any) -> None:
    data = serialize(message)
    assert deserialize_message(data, type(message)) == message
    theirs = bytes(serialize_message(message))
    assert len(theirs) - len(data) in range(4)  # rclpy fills up the end
    assert all(ours in (their, 0) for ours, their in zip(data, theirs, strict=False))


def test_nested_sequences() -> None:
    message = Float64MultiArray(data=[0.5])
    message.layout.dim = [MultiArrayDimension(label="x", size=3), MultiArrayDimension(label="yy", size=1)]
    assert deserialize_message(serialize(message), Float64MultiArray) == message
