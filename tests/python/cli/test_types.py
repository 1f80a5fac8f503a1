"""`mauve types`: which structs of data plug-ins register, their fields, and the .msg file of one."""

import json
from pathlib import Path
from typing import Any

import pytest
from rosidl_adapter.parser import parse_message_string

from mauve_rt.cli.main import main

ATTITUDE = """\
float64 roll
float32[3] rates
geometry_msgs/Point origin
geometry_msgs/Point[2] corners
int32[<=4] codes
string<=16 mode
bool level
uint64 round
"""


def run(*words: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["types", *words]) == 0
    return capsys.readouterr().out


def test_all_types_have_their_size_capacities_and_library(
    plugin_prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found: dict[str, Any] = {row["type"]: row for row in json.loads(run("--json", capsys=capsys))}
    joints = found["sensor_msgs/msg/JointState"]
    assert joints["capacities"] == ["name", "position", "velocity", "effort"]
    assert found["executor_tests/Attitude"]["library"] == "executor_tests"
    assert found["std_msgs/msg/Float64"]["bytes"] == 8
    assert found["executor_tests/Attitude"]["capacities"] == []
    table = run(capsys=capsys)
    assert "name, position, velocity, effort" in table


def test_a_type_has_its_fields(plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = run("sensor_msgs/msg/JointState", capsys=capsys).splitlines()
    assert lines[0].startswith("sensor_msgs/msg/JointState: ")
    assert "  std_msgs/msg/Header header" in lines
    assert "    string<=255 frame_id" in lines
    assert "  float64[] position" in lines
    fields = json.loads(run("executor_tests/Attitude", "--json", capsys=capsys))["fields"]
    assert [field["type"] for field in fields][1:4] == [
        "float32[3]",
        "geometry_msgs/msg/Point",
        "geometry_msgs/msg/Point[2]",
    ]


def test_a_struct_is_written_as_a_msg_file(plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = run("msg", "executor_tests/Attitude", capsys=capsys)
    assert text == ATTITUDE
    parsed = parse_message_string("my_interfaces", "Attitude", text)  # as ROS reads it
    assert [str(field) for field in parsed.fields] == text.splitlines()
    joints = run("msg", "sensor_msgs/msg/JointState", capsys=capsys)
    assert parse_message_string("my_interfaces", "Joints", joints).fields[2].type.is_dynamic_array()


def test_other_words_are_bad_usage(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["types", "idl", "executor_tests/Attitude"])
    assert "expected TYPE or msg TYPE, found idl executor_tests/Attitude" in capsys.readouterr().err


def test_an_unknown_type_is_refused(plugin_prefix: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["types", "executor_tests/Atitude"]) == 2
    assert "executor_tests/Attitude" in capsys.readouterr().err


def test_an_action_has_the_fields_of_its_parts(
    plugin_prefix: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = "mauve_msgs/action/DriveTo"
    lines = run(name, capsys=capsys).splitlines()
    parts = [line.partition(":")[0] for line in lines if not line.startswith(" ")]
    assert parts == [f"{name}_{part}" for part in ("Goal", "Result", "Feedback")]
    assert lines[-2:] == ["  float64 distance_m", "  float64 elapsed_s"]
    assert [each["type"] for each in json.loads(run(name, "--json", capsys=capsys))] == parts
    goal, result, feedback = run("msg", name, capsys=capsys).split("---\n")
    assert goal == "geometry_msgs/PoseStamped pose\nfloat64 tolerance_m\n"
    assert result == "float64 distance_m\nbool reached\n"
    assert feedback == "float64 distance_m\nfloat64 elapsed_s\n"
    listed = {row["type"] for row in json.loads(run("--json", capsys=capsys))}
    assert {*parts} <= listed
