"""The topics of a bag as CSV files, held against what rosbags wrote into the bag."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rosbags.typesys import Stores, get_typestore

from mauve_rt.trace import open as open_trace
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.export.topic_files import _file_name
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

TYPES = get_typestore(Stores.ROS2_JAZZY)
MS = 1_000_000


def of(type_name: str, **fields: Any) -> tuple[str, Any]:
    return type_name, TYPES.types[type_name](**fields)


def vector(x: float, y: float, z: float) -> Any:
    return of("geometry_msgs/msg/Vector3", x=x, y=y, z=z)[1]


def header(number: int) -> Any:
    stamp = of("builtin_interfaces/msg/Time", sec=number, nanosec=7)[1]
    return of("std_msgs/msg/Header", stamp=stamp, frame_id=f'frame {number}, "or"')[1]


def twist(number: int) -> tuple[str, Any]:
    turn = of("geometry_msgs/msg/Twist", linear=vector(number / 8, 2.5, 0.1), angular=vector(0, 0, -1.0))[1]
    return of("geometry_msgs/msg/TwistStamped", header=header(number), twist=turn)


def scan(length: int) -> tuple[str, Any]:
    numbers = np.arange(length, dtype=np.float32) / 4
    limits = (
        "angle_min",
        "angle_max",
        "angle_increment",
        "time_increment",
        "scan_time",
        "range_min",
        "range_max",
    )
    fields = dict.fromkeys(limits, 0.5)
    none = np.empty(0, np.float32)
    return of("sensor_msgs/msg/LaserScan", header=header(1), ranges=numbers, intensities=none, **fields)


def path_of(length: int) -> tuple[str, Any]:
    points = [of("geometry_msgs/msg/Point32", x=float(n), y=0.0, z=0.0)[1] for n in range(length)]
    return of("geometry_msgs/msg/Polygon", points=points)


def serialized(typed: tuple[str, Any]) -> bytes:
    return bytes(TYPES.serialize_cdr(typed[1], typed[0]))


def export(folder: Path, messages: list[tuple[str, tuple[str, Any]]], **recorder: Any) -> Path:
    """Record (topic, message) 1 ms apart, and export the bag."""
    source = SyntheticSource(["c"])
    made = Recorder(source, folder / "bag", node_name="/executor", **recorder)
    made.start()
    for number, (topic, message) in enumerate(messages):
        assert made.record(topic, message[0], serialized(message), monotonic_ns=number * MS)
    made.stop()
    export_csv(open_trace(folder / "bag"), folder / "csv")
    return folder / "csv"


def test_each_topic_has_a_file_with_a_row_for_each_message(tmp_path: Path) -> None:
    turns = [("/robot_1/cmd_vel", twist(number)) for number in range(5)]
    folder = export(tmp_path, [*turns, ("/robot_1/words", of("std_msgs/msg/String", data='a,\n"b"'))])
    table = pd.read_csv(folder / "topic.robot_1.cmd_vel.csv")
    assert list(table.columns) == [
        *("log_time_ns", "monotonic_ns", "header.stamp.sec", "header.stamp.nanosec", "header.frame_id"),
        *(f"twist.{part}.{axis}" for part in ("linear", "angular") for axis in "xyz"),
    ]
    assert table["monotonic_ns"].tolist() == [number * MS for number in range(5)]
    assert table["header.frame_id"].tolist() == [f'frame {number}, "or"' for number in range(5)]
    assert table["twist.linear.x"].tolist() == [number / 8 for number in range(5)]
    assert table["twist.angular.z"].tolist() == [-1.0] * 5
    words = pd.read_csv(folder / "topic.robot_1.words.csv")
    assert words["data"].tolist() == ['a,\n"b"']
    own = [path.name for path in folder.iterdir() if path.name.startswith("topic.executor")]
    assert own == [], "the trace's own topics are the other files"


def test_an_array_is_one_column_and_has_all_its_elements(tmp_path: Path) -> None:
    long = 1080  # as a laser scanner's
    folder = export(tmp_path, [("/scan", scan(3)), ("/scan", scan(long)), ("/path", path_of(2))])
    ranges = pd.read_csv(folder / "topic.scan.csv")["ranges"].tolist()
    assert json.loads(ranges[0]) == [0.0, 0.25, 0.5]
    assert json.loads(ranges[1]) == [number / 4 for number in range(long)]
    points = pd.read_csv(folder / "topic.path.csv")["points"].tolist()
    assert json.loads(points[0]) == [{"x": 0.0, "y": 0.0, "z": 0.0}, {"x": 1.0, "y": 0.0, "z": 0.0}]


def test_an_array_with_nan_and_infinities_is_json(tmp_path: Path) -> None:
    name, message = scan(4)
    message.ranges[:3] = [np.nan, np.inf, -np.inf]
    folder = export(tmp_path, [("/scan", (name, message))])
    (ranges,) = pd.read_csv(folder / "topic.scan.csv")["ranges"].tolist()
    assert json.loads(ranges, parse_constant=pytest.fail) == [None, "Infinity", "-Infinity", 0.75]
    numbers = np.array(json.loads(ranges), np.float64)
    assert np.array_equal(numbers, message.ranges, equal_nan=True)


def test_a_topic_that_cannot_be_read_costs_no_other_one(tmp_path: Path) -> None:
    words = [of("std_msgs/msg/String", data=word) for word in ("one", "two")]
    source = SyntheticSource(["c"])
    made = Recorder(source, tmp_path / "bag", node_name="/executor")
    made.start()
    for number, word in enumerate(words):
        for topic in ("/good", "/bad"):
            assert made.record(topic, word[0], serialized(word), monotonic_ns=number * MS)
    assert made.record("/bad", "std_msgs/msg/String", b"\0\1\0\0\xff\xff\xff\xff", monotonic_ns=9 * MS)
    made.stop()
    problems = export_csv(open_trace(tmp_path / "bag"), tmp_path / "csv")
    assert len(problems) == 1
    assert "topic /bad" in problems[0]
    assert [path.name for path in (tmp_path / "csv").glob("topic.*")] == ["topic.good.csv"]
    assert pd.read_csv(tmp_path / "csv" / "topic.good.csv")["data"].tolist() == ["one", "two"]


@pytest.mark.parametrize(
    ("topic", "taken", "name"),
    [
        ("/a/b", [], "topic.a.b.csv"),
        ("/../../etc/x", [], "topic.......etc.x.csv"),
        ("/a b\\c:d", [], "topic.a_b_c_d.csv"),
        ("/a.b", ["topic.a.b.csv"], "topic.a.b.2.csv"),
        ("/a.b", ["topic.a.b.csv", "topic.a.b.2.csv"], "topic.a.b.3.csv"),
    ],
)
def test_no_topic_writes_elsewhere_or_over_another(topic: str, taken: list[str], name: str) -> None:
    assert _file_name(topic, taken=taken) == name
