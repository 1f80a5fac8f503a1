"""What the executor reads of its command line before there is a node."""

import json
import re
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from mauve_rt.errors import ArchitectureFileError, ParameterError
from mauve_rt.node.executor.settings import Settings
from mauve_rt.node.shared.ros_arguments import parse_ros_arguments


def _parse(*words: str) -> dict[str, object]:
    return parse_ros_arguments(["executor", *words], node="executor").parameters


def test_parameters_only_within_ros_args() -> None:
    words = ("-p", "a:=1", "--ros-args", "-p", "b:=2", "--param", "c:=x", "--", "-p", "d:=4")
    assert _parse(*words) == {"b": 2, "c": "x"}


def test_values_are_as_rcl_reads_them() -> None:
    words = ("a:=true", "b:=[x, z]", "c:=1.5", "d:='5'", "e:=no", "f:=0x10", "g:='no'")
    given = _parse("--ros-args", *(word for value in words for word in ("-p", value)))
    assert given == {"a": True, "b": ["x", "z"], "c": 1.5, "d": "5", "e": False, "f": 16, "g": "no"}


@pytest.mark.parametrize("value", ["a:=[", "a:=[1, x]", "a:="])
def test_what_rcl_refuses_is_refused(value: str) -> None:
    with pytest.raises(ParameterError, match="Couldn't parse parameter override rule: '-p a:="):
        _parse("--ros-args", "-p", value)


def test_parameters_of_other_nodes_are_not_ours() -> None:
    assert _parse("--ros-args", "-p", "other:a:=1", "-p", "executor:a:=2") == {"a": 2}


def test_parameter_files_and_their_wildcards(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(
        "/**:\n  ros__parameters: {bag: everybody, bags: here}\n"
        "/robot_1/executor:\n  ros__parameters: {architecture: robot.yaml, guidance: {path_step: 2}}\n"
        "/robot_1/other:\n  ros__parameters: {architecture: other.yaml}\n",
        encoding="utf-8",
    )
    given = _parse("--ros-args", "--params-file", str(file), "-p", "bag:=mine")
    assert given == {
        "bag": "mine", "bags": "here", "architecture": "robot.yaml", "guidance.path_step": 2
    }  # fmt: skip
    with pytest.raises(ParameterError, match=r"none\.yaml'\. Error: Error opening YAML file"):
        _parse("--ros-args", "--params-file", str(tmp_path / "none.yaml"))


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
        (("count:=ns",), ""),
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
    assert (settings.architecture, settings.values["trace"], settings.autostart) == ("a.yaml", False, True)
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
        ("bag_split_s:=soon", "parameter bag_split_s: expected a number of at least 0, found 'soon'"),
        ("bag_split_s:=-1", "parameter bag_split_s: expected a number of at least 0, found -1"),
        (
            "max_request_bytes:=1.5",
            "parameter max_request_bytes: expected a whole number of at least 1, found",
        ),
        ("record_topics:=[1]", "parameter record_topics: expected a list of texts, found a list of 1"),
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
    file.write_text("executor: {ros__parameters: {counter.step: [1, x]}}\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=r"parameters\.yaml'. Error: .* at line_num 1"):
        Settings.of(["executor", "--ros-args", "--params-file", str(file)])


def test_an_integer_is_a_number_and_words_of_ros_are_booleans(tmp_path: Path) -> None:
    settings = Settings.of(["--ros-args", "-p", "bag_split_s:=5", "-p", "trace:=no", "-p", "autostart:=off"])
    assert (settings.values["bag_split_s"], settings.values["trace"], settings.autostart) == (
        5.0,
        False,
        False,
    )
    assert isinstance(settings.values["bag_split_s"], float)
    file = tmp_path / "parameters.yaml"
    file.write_text("\ufeffexecutor: {ros__parameters: {bag_split_s: 7}}\n", encoding="utf-8")
    assert Settings.of(["--ros-args", "--params-file", str(file)]).values["bag_split_s"] == 7.0


def test_simulated_time_for_everybody_is_a_remark(tmp_path: Path) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text("/**: {ros__parameters: {use_sim_time: true}}\n", encoding="utf-8")
    (remark,) = Settings.of(["--ros-args", "--params-file", str(file)]).remarks
    assert remark.startswith("parameter use_sim_time: given to nodes of any name, and ignored")
    file.write_text("executor: {ros__parameters: {use_sim_time: true}}\n", encoding="utf-8")
    with pytest.raises(ParameterError, match="use_sim_time: expected false"):
        Settings.of(["--ros-args", "--params-file", str(file)])


NAMES = ("executor", "/robot_1/executor", "/robot_2/executor", "/**", "/**/executor", "/*/executor", "/other")
VALUES = ("1", "2.5", "no", "on", "'no'", "text", "[1, 2]", "[a, b]", "1e3", "0x1F", "true")


def test_everything_is_as_a_plain_node_has_it(tmp_path: Path) -> None:
    """Any files and words in any order: the own settings and the properties as rclpy's node has them."""
    lines, cases = [], 60
    for seed in range(cases):
        random = Random(seed)  # noqa: S311 - not for secrets
        words: list[str] = []
        for number in range(random.randint(1, 4)):
            if random.random() < 0.5:
                sections = random.sample(NAMES, random.randint(1, 3))
                file = tmp_path / f"{seed}_{number}.yaml"
                body = ""
                for section in sections:
                    values = {random.choice("abc"): random.choice(VALUES) for _ in range(2)}
                    told = ", ".join(f"{name}: {value}" for name, value in values.items())
                    body += (
                        f"{section}: {{ros__parameters: {{{told}, part: {{x: {random.choice(VALUES)}}}}}}}\n"
                    )
                file.write_text(body, encoding="utf-8")
                words += ["--params-file", str(file)]
            else:
                scope = random.choice(("", "", "executor:", "other:"))
                words += ["-p", f"{scope}{random.choice('abc')}:={random.choice(VALUES)}"]
        lines.append(json.dumps([random.choice(("/", "/robot_1", "/robot_2")), *words]))
    command = [sys.executable, "-c", PLAIN]
    done = subprocess.run(command, input="\n".join(lines), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    plain = done.stdout.splitlines()
    assert len(plain) == cases
    for line, expected in zip(lines, plain, strict=True):
        namespace, *words = json.loads(line)
        found = parse_ros_arguments(["executor", "--ros-args", *words], node="executor").within(namespace)
        assert found == json.loads(expected), line


PLAIN = """
import json, sys
import rclpy
from rclpy.node import Node
for line in sys.stdin:
    namespace, *words = json.loads(line)
    context = rclpy.Context()
    context.init(["executor", "--ros-args", *words])
    node = Node("executor", namespace=namespace, context=context, enable_rosout=False,
                start_parameter_services=False, enable_logger_service=False)
    values = {name: one.value for name, one in node._parameter_overrides.items()}
    print(json.dumps({name: list(one) if hasattr(one, "tolist") else one for name, one in values.items()}))
    node.destroy_node()
    context.shutdown()
"""


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
