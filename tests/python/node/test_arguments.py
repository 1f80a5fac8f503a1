"""What the executor reads of its command line before there is a node."""

import re
from pathlib import Path

import pytest

from mauve_rt.errors import ArchitectureFileError, ParameterError
from mauve_rt.node.executor.settings import Settings
from mauve_rt.node.shared.ros_arguments import parse_ros_arguments


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


def test_parameters_of_one_file_for_several_robots(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(
        "/**/executor: {ros__parameters: {guidance.path_step: 1}}\n"
        "/*/executor: {ros__parameters: {guidance.speed: 5}}\n"
        "/robot_1/executor: {ros__parameters: {guidance: {path_step: 2}}}\n"
        "robot_2: {executor: {ros__parameters: {guidance: {path_step: 3}}}}\n",
        encoding="utf-8",
    )
    architecture = tmp_path / "robot.yaml"
    architecture.write_text(
        "mauve: 1\nexecutor: {namespace: /robot_2}\n"
        "components:\n  guidance: {shell: a/A, core: a/A, fsm: a/A}\n",
        encoding="utf-8",
    )
    words = ["--ros-args", "--params-file", str(file), "-p", f"architecture:={architecture}"]
    step, speed = ("guidance", "path_step"), ("guidance", "speed")
    assert Settings.of([*words, "-r", "__ns:=/robot_1"]).overrides.properties == {step: 2, speed: 5}
    assert Settings.of(words).overrides.properties == {step: 3, speed: 5}, "the namespace of the file"
    assert Settings.of([*words, "-r", "__ns:=/"]).overrides.properties == {step: 1}


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
        ("conter.step:=1", "sets a property of an unknown component; did you mean counter?"),
        ("counter.stepp:=1", "(parameter counter.stepp); did you mean step?"),
        ("counter.q:=1", "(parameter counter.q); known: enabled, label, list_file, period_ms, step"),
        ("counter.step:=fast", "(parameter counter.step): expected a number, found 'fast'"),
        ("counter.period_ms:=2.5", "(parameter counter.period_ms): expected a whole number, found 2.5"),
        ("counter.label:=5", "(parameter counter.label): expected text, found 5; put it in quotes"),
        ("counter.step:=10.5", "(parameter counter.step): expected at least 0 and at most 10, found 10.5"),
    ],
)
def test_bad_properties(parameter: str, message: str, tmp_path: Path, plugin_prefix: Path) -> None:
    path = tmp_path / "robot.yaml"
    parts = "core: executor_tests/Counter, fsm: executor_tests/CounterFsm"
    path.write_text(
        f"mauve: 1\ncomponents:\n  counter: {{shell: executor_tests/CounterShell, {parts}}}\n",
        encoding="utf-8",
    )
    settings = Settings.of(["--ros-args", "-p", f"architecture:={path}", "-p", parameter])
    runtime = settings.runtime()
    with pytest.raises(ArchitectureFileError, match=re.escape(message)):
        runtime.configure()
    assert not runtime.configured


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        ("use_sim_time:=true", "use_sim_time: expected false"),
        ("autostart:=5", "parameter autostart: expected true or false, found 5"),
        ("architecture:=[a]", "parameter architecture: expected text"),
        ("peers:=robot_2", "parameter peers: expected a list of names"),
        ("guidance.path_step:=[1, 2]", r"parameter guidance.path_step: expected .* found a list of 2"),
    ],
)
def test_bad_settings(parameter: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        Settings.of(["--ros-args", "-p", parameter])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("bagg", "parameter bagg: an executor has none of that name; did you mean bag?"),
        ("architectur", "did you mean architecture?"),
        ("colour", "known: architecture, autostart, bag, "),
    ],
)
def test_an_unknown_parameter_is_refused(name: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(f"executor: {{ros__parameters: {{{name}: x}}}}\n", encoding="utf-8")
    for words in (["-p", f"{name}:=x"], ["-p", f"executor:{name}:=x"], ["--params-file", str(file)]):
        with pytest.raises(ParameterError) as caught:
            Settings.of(["executor", "--ros-args", *words])
        assert message in str(caught.value)


def test_qos_overrides_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    text = "executor: {ros__parameters: {qos_overrides: {/count: {publisher: {depth: 5}}}}}\n"
    file.write_text(text, encoding="utf-8")
    for words in (["-p", "qos_overrides./count.publisher.depth:=5"], ["--params-file", str(file)]):
        with pytest.raises(ParameterError, match="quality of service is in the architecture file"):
            Settings.of(["executor", "--ros-args", *words])


def test_a_parameter_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text("executor: {ros__parameters: {counter.step: 1, counter.step: 2}}\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=r"parameter file .*parameters\.yaml: .*counter\.step"):
        Settings.of(["executor", "--ros-args", "--params-file", str(file)])


def test_parameters_for_nodes_of_any_name_may_be_for_others(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text("/**: {ros__parameters: {colour: red, bags: here}}\n", encoding="utf-8")
    words = ["executor", "--ros-args", "--params-file", str(file), "-p", "other:colour:=red"]
    assert Settings.of(words).remarks == ()
    file.write_text("/**: {ros__parameters: {colour: red, bagg: here}}\n", encoding="utf-8")
    (remark,) = Settings.of(words).remarks
    assert remark.startswith(
        "parameter bagg: given to nodes of any name, and an executor has none of it; did"
    )
