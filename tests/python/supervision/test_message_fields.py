"""Types of messages' fields by their paths, as rules are checked with."""

import pytest

from mauve_rt.supervision.message_fields import FieldType, field_type


@pytest.mark.parametrize(
    ("message", "path", "found"),
    [
        ("sensor_msgs/msg/JointState", "position[1]", "double"),
        ("sensor_msgs/msg/JointState", "position.length", "uint32"),
        ("sensor_msgs/msg/JointState", "position", "sequence<double>"),
        ("shape_msgs/msg/SolidPrimitive", "dimensions[2]", "double"),  # a bounded list
        ("shape_msgs/msg/SolidPrimitive", "dimensions.length", "uint32"),
        ("trajectory_msgs/msg/JointTrajectory", "points[0].positions[3]", "double"),
        ("sensor_msgs/msg/Imu", "orientation_covariance[8]", "double"),
        ("sensor_msgs/msg/Imu", "orientation_covariance[9]", "no element 9 of double[9]"),
        ("sensor_msgs/msg/Imu", "orientation.x[0]", "no list (x is double)"),
        ("sensor_msgs/msg/Imu", "orientation[0].x", "no list (orientation is geometry_msgs/Quaternion)"),
        ("std_msgs/msg/String", "data.length", "no message (string)"),
    ],
)
def test_a_path_has_the_declared_type(message: str, path: str, found: str) -> None:
    known = field_type(message, path)
    assert known is not None
    assert (known.type, known.unknown) == (found, "")


@pytest.mark.parametrize("path", ["positions", "position[-1]", "position[x]", ""])
def test_a_path_that_no_message_has_is_unknown(path: str) -> None:
    known = field_type("sensor_msgs/msg/JointState", path)
    assert isinstance(known, FieldType)
    assert known.unknown == path


def test_a_type_that_is_not_installed_is_not_judged() -> None:
    assert field_type("no_msgs/msg/Thing", "x") is None
