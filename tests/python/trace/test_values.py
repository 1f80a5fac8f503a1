"""Values of a trace: numeric fields of recorded messages by name, as pandas Series."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from synthetic_traces import MS, ROOT, Pose, periodic_trace, with_values

from mauve_rt.trace import TraceError
from mauve_rt.trace import open as open_trace
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

POSE = "/robot_1/executor/values/pose"


@dataclass
class Everything:
    header: Any = field(default_factory=lambda: Stamp(5, 6))
    word: str = "none"
    ready: bool = True
    count: int = 3
    covariance: Any = field(default_factory=lambda: np.arange(3.0))
    ranges: Any = field(default_factory=lambda: np.zeros(17))
    poses: Any = field(default_factory=lambda: [Pose(1.0, 2.0)])


@dataclass
class Stamp:
    sec: int
    nanosec: int


def test_a_value_is_a_series_over_the_clock_of_the_records() -> None:
    trace = with_values(periodic_trace(), {POSE: [(MS, Pose(1, 2)), (3 * MS, Pose(1.5, -2))]})
    found = trace.values["pose.y"]
    assert found.name == "pose.y"
    assert found.dtype == np.float64
    assert found.index.name == "monotonic_ns"
    assert found.index.tolist() == [MS, 3 * MS]
    assert found.tolist() == [2.0, -2.0]


def test_values_of_resources_come_first_and_are_called_by_the_resource() -> None:
    trace = with_values(periodic_trace(), {"/beat": [(MS, Pose(1, 2))], POSE: [(MS, Pose(1, 2))]})
    assert trace.values.names == ("pose.x", "pose.y", "/beat.x", "/beat.y")
    assert list(trace.values) == list(trace.values.names)
    assert len(trace.values) == 4


def test_a_resource_of_two_executors_is_called_by_its_topic() -> None:
    other = "/robot_2/executor/values/pose"
    trace = with_values(periodic_trace(), {POSE: [(MS, Pose(1, 2))], other: [(MS, Pose(3, 4))]})
    assert trace.values.names == (f"{POSE}.x", f"{POSE}.y", f"{other}.x", f"{other}.y")
    assert trace.values[f"{other}.x"].tolist() == [3.0]


def test_numbers_and_short_arrays_are_values_but_no_texts_times_and_long_arrays() -> None:
    trace = with_values(periodic_trace(), {"/all": [(MS, Everything())]})
    elements = [f"/all.covariance[{index}]" for index in range(3)]
    expected = ("/all.ready", "/all.count", *elements, "/all.poses[0].x", "/all.poses[0].y")
    assert trace.values.names == expected
    assert trace.values["/all.covariance[2]"].tolist() == [2.0]


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    trace = with_values(periodic_trace(), {POSE: [(MS, Pose(1, 2))], "/beat": [(MS, Pose(1, 2))]})
    with pytest.raises(TraceError, match=r"value 'pose\.z': .*has 4; the nearest is 'pose\.[xy]'"):
        trace.values["pose.z"]
    with pytest.raises(TraceError, match=r"value 'x': the bag has no values"):
        periodic_trace().values["x"]


def test_only_the_topic_of_a_value_is_read_and_once() -> None:
    trace = with_values(periodic_trace(), {POSE: [(MS, Pose(1, 2))], "/beat": [(MS, Pose(1, 2))]})
    asked: list[tuple[str, ...]] = []
    source = trace.message_source

    def noting(topics: tuple[str, ...]) -> Any:
        asked.append(topics)
        return source(topics)

    object.__setattr__(trace, "message_source", noting)
    assert [len(trace.values[name]) for name in ("pose.x", "pose.y")] == [1, 1]
    assert asked == [(POSE,)]
    assert len(trace.values) == 4
    assert asked == [(POSE,), ("/beat",)]


def test_infinities_stay_and_messages_out_of_order_are_sorted() -> None:
    trace = with_values(periodic_trace(), {POSE: [(MS, Pose(np.inf, 0)), (0, Pose(np.nan, 1))]})
    assert trace.values["pose.y"].index.tolist() == [0, MS]
    assert trace.values["pose.x"].tolist()[1] == np.inf


def test_values_of_a_bag_with_names_of_their_own_and_none_of_what_the_executor_reports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(record_named(tmp_path)))
    trace = open_trace(tmp_path / "bag")
    assert trace.values.names == ("filter.gain", *(f"filter.state[{index}]" for index in range(30)))
    assert trace.values["filter.state[0]"].tolist() == [10.0, 11.0, 12.0]
    assert trace.values["filter.gain"].index.tolist() == [MS, 2 * MS, 3 * MS]


def record_named(folder: Path) -> Path:
    """Record mauve_msgs/msg/Values and their names; returns a prefix with the definitions."""
    types = get_typestore(Stores.ROS2_JAZZY)
    for name in ("Values", "ValueNames"):
        text = (ROOT / "mauve_msgs" / "msg" / f"{name}.msg").read_text(encoding="utf-8")
        types.register(get_types_from_msg(text, f"mauve_msgs/msg/{name}"))
    share = folder / "prefix" / "share" / "mauve_msgs"
    share.mkdir(parents=True)
    (share / "msg").symlink_to(ROOT / "mauve_msgs" / "msg")
    made = Recorder(SyntheticSource(["c"]), folder / "bag", node_name="/executor")
    made.start()

    def put(topic: str, name: str, at_ns: int, **fields: Any) -> None:
        type_name = f"mauve_msgs/msg/{name}"
        data = types.serialize_cdr(types.types[type_name](**fields), type_name)
        assert made.record(topic, type_name, bytes(data), monotonic_ns=at_ns)

    stamp = types.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    topic = "/executor/values/filter"
    names = ["gain", *(f"state[{index}]" for index in range(30))]
    for number in range(3):
        numbers = np.array([number / 2, *[10.0 + number] * 30])
        put(topic, "Values", (number + 1) * MS, stamp=stamp, values=numbers)
    put(f"{topic}/names", "ValueNames", 4 * MS, type="pkg::Filter", names=names)
    made.stop()
    return folder / "prefix"


def test_a_csv_file_of_a_resource_has_its_name_and_a_column_for_each_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(record_named(tmp_path)))
    assert export_csv(open_trace(tmp_path / "bag"), tmp_path / "csv") == []
    table = pd.read_csv(tmp_path / "csv" / "topic.executor.values.filter.csv")
    assert list(table.columns)[2:6] == ["stamp.sec", "stamp.nanosec", "gain", "state[0]"]
    assert table["state[0]"].tolist() == [10.0, 11.0, 12.0]
    assert table["monotonic_ns"].tolist() == [MS, 2 * MS, 3 * MS]
