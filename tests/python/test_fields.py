"""One reader of field paths and one writer of JSON, for ROS messages, decoded messages and arrays."""

import array
import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Point
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import ByteMultiArray, Empty
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from mauve_rt.fields import field_at, flat_fields, json_value, number_at


@dataclass
class Joint:
    position: float = 0.0


@dataclass
class Decoded:
    """As a decoder makes messages."""

    ranges: Any = field(default_factory=lambda: np.array([1.5, math.nan, math.inf], np.float32))
    joints: list[Joint] = field(default_factory=lambda: [Joint(1.0), Joint(2.0), Joint(-math.inf)])
    name: str = "arm"
    length: int = 7


STATE = JointState(name=["a", "b"], position=[1.0, 2.0])
PATH = JointTrajectory(points=[JointTrajectoryPoint(positions=[0.5, 1.5]), JointTrajectoryPoint()])


@pytest.mark.parametrize(
    ("value", "path", "found"),
    [
        (STATE, "position[1]", 2.0),
        (STATE, "position.length", 2),
        (STATE, "velocity.length", 0),
        (STATE, "header.stamp.sec", 0),
        (STATE, "name[0]", "a"),
        (PATH, "points[0].positions[1]", 1.5),
        (PATH, "points[1].positions.length", 0),
        (Decoded(), "ranges[0]", 1.5),
        (Decoded(), "ranges.length", 3),
        (Decoded(), "joints[1].position", 2.0),
        (Decoded(), "length", 7),
    ],
)
def test_a_path_names_one_field_of_any_value(value: Any, path: str, found: object) -> None:
    assert field_at(value, path) == found


@pytest.mark.parametrize(
    ("value", "path", "problem"),
    [
        (STATE, "position[2]", "no element 'position[2]' in 'position[2]'; it has 2 elements"),
        (STATE, "positions", "no field 'positions' in 'positions'; expected one of header, name, position"),
        (STATE, "position[-1]", "no field 'position[-1]' in 'position[-1]'; expected a name, or name[index]"),
        (STATE, "position.1", "the field before has 2 elements, choose one as in ranges[0]"),
        (Decoded(), "name[0]", "no element 'name[0]' in 'name[0]'; 'name' is no list"),
        (Decoded(), "name.length", "no field 'length' in 'name.length'; the field before has none"),
        (Decoded(), "", "no field '' in ''"),
    ],
)
def test_a_path_that_leads_nowhere_says_why(value: Any, path: str, problem: str) -> None:
    with pytest.raises(ValueError, match="no ") as raised:
        field_at(value, path)
    assert problem in str(raised.value)
    assert math.isnan(number_at(value, path))


def test_a_number_is_read_of_each_type_of_field() -> None:
    assert number_at(ByteMultiArray(data=[b"\x00", b"\xff"]), "data[1]") == 255
    assert number_at(Decoded(), "ranges[2]") == math.inf
    assert math.isnan(number_at(Decoded(), "name"))


def test_an_array_is_one_field_in_types_of_json() -> None:
    flat = dict(flat_fields(Decoded()))
    assert flat["ranges"] == [1.5, None, "Infinity"]
    assert flat["joints"] == [{"position": 1.0}, {"position": 2.0}, {"position": "-Infinity"}]
    assert dict(flat_fields(Point(x=1.0), "at")) == {"at.x": 1.0, "at.y": 0.0, "at.z": 0.0}


@pytest.mark.parametrize(
    ("value", "found"),
    [
        (JointState(position=[math.nan, math.inf, 1.0]).position, [None, "Infinity", 1.0]),
        (array.array("d", [math.nan]), [None]),
        (np.array([1, 255], np.uint8), [1, 255]),
        (np.float32(0.5), 0.5),
        (b"\x01\xff", [1, 255]),
        ({"a": (math.nan, True)}, {"a": [None, True]}),
        (Empty(), {}),
        ("text", "text"),
        (Parameter("x", value=1).to_parameter_msg().name, "x"),
    ],
)
def test_a_value_is_json_whatever_has_its_numbers(value: Any, found: object) -> None:
    assert json_value(value) == found
    assert json.loads(json.dumps(json_value(value)), parse_constant=pytest.fail) == found
