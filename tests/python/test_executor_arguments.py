"""What the executor reads of its command line before there is a node."""

from pathlib import Path

import pytest

from mauve_rt.errors import ParameterError
from mauve_rt.node.executor_settings import Settings
from mauve_rt.node.ros_arguments import parse_ros_arguments


def _parse(*words: str) -> dict[str, object]:
    return parse_ros_arguments(["executor", *words], node="executor").parameters


def test_parameters_only_within_ros_args() -> None:
    words = ("-p", "a:=1", "--ros-args", "-p", "b:=2", "--param", "c:=x", "--", "-p", "d:=4")
    assert _parse(*words) == {"b": 2, "c": "x"}


def test_values_are_yaml() -> None:
    given = _parse(
        "--ros-args", "-p", "a:=true", "-p", "b:=[x, y]", "-p", "c:=1.5", "-p", "d:='5'", "-p", "e:=["
    )
    assert given == {"a": True, "b": ["x", "y"], "c": 1.5, "d": "5", "e": "["}


def test_parameters_of_other_nodes_are_not_ours() -> None:
    assert _parse("--ros-args", "-p", "other:a:=1", "-p", "executor:a:=2") == {"a": 2}


def test_parameter_files_and_their_wildcards(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {bag: everybody}\n"
        "/robot_1/executor:\n  ros__parameters: {architecture: robot.yaml, guidance: {path_step: 2}}\n"
        "/robot_1/other:\n  ros__parameters: {architecture: other.yaml}\n",
        encoding="utf-8",
    )
    given = _parse("--ros-args", "--params-file", str(file), "-p", "bag:=mine")
    assert given == {"bag": "mine", "architecture": "robot.yaml", "guidance.path_step": 2}
    assert _parse("--ros-args", "--params-file", str(tmp_path / "none.yaml")) == {}


@pytest.mark.parametrize(
    ("rules", "namespace"),
    [
        (("__ns:=/robot_7", "other:__ns:=/elsewhere"), "/robot_7"),
        (("__ns:=/first", "__ns:=/second"), "/first"),
        (("executor:__ns:=/old", "__node:=boss", "boss:__ns:=/new"), "/new"),
        (("other:__node:=boss", "executor:__ns:=/old"), "/old"),
        (("count:=__ns",), ""),
    ],
)
def test_namespace(rules: tuple[str, ...], namespace: str) -> None:
    words = [word for rule in rules for word in ("--remap", rule)]
    assert parse_ros_arguments(["--ros-args", *words], node="executor").namespace == namespace


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("__ns:=robot_7", "remapping __ns: expected a full namespace such as /robot_1, found robot_7"),
        ("__ns:=/robot 7", "found /robot 7"),
        ("__node:=7up", "remapping __node: expected a name such as boss, found 7up"),
    ],
)
def test_names_that_are_none(rule: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Settings.of(["--ros-args", "-r", rule])


def test_parameters_of_a_node_that_is_renamed() -> None:
    assert _parse("--ros-args", "-p", "boss:a:=1", "-p", "executor:b:=2", "-r", "__node:=boss") == {"a": 1}


def test_settings() -> None:
    parameters = ("architecture:=a.yaml", "trace:=false", "peers:=[b]", "guidance.path_step:=2")
    words = [word for parameter in parameters for word in ("-p", parameter)]
    settings = Settings.of(["--ros-args", *words, "-r", "__ns:=/robot_2"])
    assert (settings.architecture, settings.trace, settings.autostart) == ("a.yaml", False, True)
    assert settings.overrides.namespace == "/robot_2"
    assert settings.overrides.peers == ["b"]
    assert settings.overrides.properties == {("guidance", "path_step"): 2}


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        ("use_sim_time:=true", "use_sim_time: expected false"),
        ("autostart:=5", "parameter autostart: expected true or false, found 5"),
        ("architecture:=[a]", "parameter architecture: expected text"),
        ("peers:=robot_2", "parameter peers: expected a list of names"),
    ],
)
def test_bad_settings(parameter: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Settings.of(["--ros-args", "-p", parameter])
