"""Architecture files: what is read from good ones, and the one line that each bad one gets."""

from pathlib import Path

import pytest
from bad_architectures import BAD, GOOD

from mauve_rt._kernel import Architecture, PluginRegistry
from mauve_rt.errors import ArchitectureFileError, MauveError
from mauve_rt.model import Overrides, build, configure, load_architecture

REGISTRY = PluginRegistry()


def _load(folder: Path, text: str | bytes, *, overrides: Overrides | None = None) -> Architecture:
    path = folder / "robot.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    model = load_architecture(path, overrides=overrides)
    architecture = build(model, REGISTRY)
    configure(model, architecture)
    return architecture


@pytest.mark.parametrize("case", BAD)
def test_bad_file_gets_one_line_with_its_place(case: str, tmp_path: Path, plugin_prefix: Path) -> None:
    before, after, culprit, message = BAD[case]
    text = GOOD.replace(before, after, 1) if case != "wrong type" else GOOD.replace(before, after)
    if case == "wrong type":
        text = text.replace(
            "connections:", "  point: {kind: shared_data, type: geometry_msgs/msg/Point}\nconnections:"
        )
    if "different frames" in case:
        text = text.replace("priority: 40", "priority: 40, frames: {count: map}")
    if case == "too many readers":
        text += "  - [source.set, count.read]\n"
    if case == "second writer":
        text += "  - [sink.count, count.write]\n"
    assert text != GOOD
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, text)
    error, line = caught.value, str(caught.value)
    assert line.startswith(f"{tmp_path}/robot.yaml:{error.line}:{error.column}: ")
    assert text.splitlines()[error.line - 1][error.column - 1 :].startswith(culprit)
    assert message in line
    assert "\n" not in line
    assert isinstance(caught.value, MauveError)


def test_all_problems_are_told_in_the_order_of_the_file(tmp_path: Path, plugin_prefix: Path) -> None:
    text = (
        GOOD.replace("step: 2", "step: 99")
        .replace("[sink.set", "[sink.seet")
        .replace("count.write", "count.rite")
    )
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, text)
    assert [problem.line for problem in caught.value.problems] == [6, 17, 18]
    assert (caught.value.line, caught.value.code, caught.value.component) == (6, "out_of_range", "source")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", ":1:1: not an architecture file: expected the keys mauve, executor, components"),
        (b"- 1\n", ":1:1: not an architecture file"),
        (b"mauve: 1\nx: \xe9\n", ":2:4: not text in UTF-8; save it as UTF-8"),
        (b"x: \xc3\xa9\xff\n", ":1:5: not text in UTF-8"),  # the column counts characters
        ("mauve: 1\n".encode("utf-16"), ":1:1: not text in UTF-8"),
        (b"mauve: 1\n\0", ":2:1: not YAML: the character U+0000 is not allowed"),
        (b"mauve: 1\n---\nmauve: 1\n", ":2:1: not YAML: expected a single document"),
        (b"a: &a [*a]\n", "the file has no 'mauve'; write `mauve: 1` at its top"),
        (
            b"mauve: 1\ncomponents:\n\tx: {}\n",
            ":3:1: not YAML: found character '\\t' that cannot start any token; indent",
        ),
        (
            b"a: &a [1,1,1,1,1,1,1,1,1]\n"
            + b"".join(b"%c: &%c [%s]\n" % (c, c, b",".join([b"*%c" % (c - 1)] * 9)) for c in b"bcdefgh"),
            "nested",
        ),
        (b"a: " + b"[" * 5000, "nested too deeply"),
        (b"mauve: 1\n#" + b"x" * 2_000_000, "at most 1000000 bytes"),
    ],
)
def test_what_is_no_architecture_file(text: bytes, message: str, tmp_path: Path) -> None:
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, text)
    assert message in str(caught.value)


def test_a_folder_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").mkdir()
    with pytest.raises(ArchitectureFileError, match=r"robot.yaml:1:1: cannot read the file: Is a directory"):
        load_architecture(tmp_path / "robot.yaml")


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ArchitectureFileError, match=r"robot.yaml:1:1: cannot read the file: No such file"):
        load_architecture(tmp_path / "robot.yaml")


def test_good_file_is_built_as_written(tmp_path: Path, plugin_prefix: Path) -> None:
    source, sink = _load(tmp_path, GOOD).components()
    assert (source.name, source.core, source.alternatives) == (
        "source",
        "executor_tests/Counter",
        ["executor_tests/Backwards"],
    )
    assert (source.period_ns, source.offset_ns) == (10_000_000, 2_500_000)
    assert (source.reconfigurable, sink.reconfigurable) == (True, False)
    values = {item.name: item.value for item in source.properties}
    assert values["step"] == 2.0
    assert values["list_file"] == str(tmp_path / "lists" / "a.txt")  # relative to the file
    assert values["label"] == "robot_1 of robot_2,robot_3"
    ports = {port.name: (port.resource, port.service) for port in sink.ports}
    assert ports == {"set": ("count", "read"), "count": ("", "")}


def test_frames_have_the_name_of_the_robot(tmp_path: Path, plugin_prefix: Path) -> None:
    text = GOOD.replace("priority: 40", "priority: 40, frames: {count: {child_frame: $(name)/base}}").replace(
        "count: {kind: shared_data", "count: {kind: shared_data, frame: $(namespace)/odom"
    )
    architecture = _load(tmp_path, text)
    ports = {port.name: port for port in architecture.components()[0].ports}
    assert (ports["count"].frame, ports["count"].child_frame) == ("", "robot_1/base")
    count = next(each for each in architecture.resources() if each.name == "count")
    assert (count.frame, count.child_frame) == ("robot_1/odom", "")
    path = tmp_path / "of_the_root.yaml"
    path.write_text(GOOD.replace("/robot_1", "/").replace("capacity: 4", "capacity: 4, frame: $(name)"))
    with pytest.raises(
        ArchitectureFileError, match=r"bad frame.*\$\(name\), which is empty in namespace '/'"
    ):
        build(load_architecture(path), REGISTRY)


def test_latest_values_and_events_are_built_as_written(tmp_path: Path, plugin_prefix: Path) -> None:
    text = GOOD.replace("count: {kind: shared_data", "count: {kind: latest_value, max_readers: 1").replace(
        "  queue: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 4}",
        "  bumped: {kind: event, topic: {name: bumped, direction: publish}}\n"
        "  asked: {kind: event, topic: {name: asked, direction: subscribe}}\n"
        "  heard: {kind: latest_value, type: std_msgs/msg/Float64,\n"
        "          topic: {name: heard, direction: subscribe}}",
    )
    resources = {resource.name: resource for resource in _load(tmp_path, text).resources()}
    assert {name: resource.kind for name, resource in resources.items()} == {
        "count": "latest_value",
        "bumped": "event",
        "asked": "event",
        "heard": "latest_value",
    }
    services = {(service.name, service.kind, service.type) for service in resources["bumped"].services}
    assert services == {("raise", "event", ""), ("read", "read", "std_msgs/msg/UInt64")}


def test_installed_alternatives_are_all_that_is_installed(tmp_path: Path, plugin_prefix: Path) -> None:
    index = plugin_prefix / "share/ament_index/resource_index/mauve_rt_plugins/executor_tests"
    text = index.read_text(encoding="utf-8")
    index.write_text(
        "".join(line for line in text.splitlines(keepends=True) if "Missing" not in line), encoding="utf-8"
    )
    try:
        source, _ = _load(tmp_path, GOOD.replace("[executor_tests/Backwards]", "installed")).components()
    finally:
        index.write_text(text, encoding="utf-8")
    assert source.alternatives == ["*"], "to the kernel; the executor looks what is installed at each request"


def test_alternatives_may_be_fsms_and_shells_and_a_fallback_is_declared(
    tmp_path: Path, plugin_prefix: Path
) -> None:
    names = ("CalmFsm", "TwinShell", "Twin", "TwinFsm")
    listed = ", ".join(f"executor_tests/{name}" for name in names)
    text = GOOD.replace("[executor_tests/Backwards]", f"[{listed}], fallback: executor_tests/Backwards")
    source, _ = _load(tmp_path, text.replace("priority: 40", "trace_records: 64, priority: 40")).components()
    assert source.alternatives == ["executor_tests/Twin"], "what the kernel takes as cores"
    assert (source.fallback, source.fell_back) == ("executor_tests/Backwards", False)


def test_overrides_of_the_command_line(tmp_path: Path, plugin_prefix: Path) -> None:
    given = {("source", "step"): 3, ("source", "label"): "$(namespace) with $(peers)"}
    overrides = Overrides(namespace="/robot_7", peers=["robot_8"], properties=given)
    source, _ = _load(tmp_path, GOOD, overrides=overrides).components()
    values = {item.name: item.value for item in source.properties}
    assert (values["step"], values["label"]) == (3.0, "/robot_7 with robot_8")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {("source", "step"): 33},
            "bad property 'step' of component 'source' (parameter source.step): expected at least 0",
        ),
        (
            {("sauce", "step"): 3},
            "parameter 'sauce.step' sets a property of an unknown component; did you mean source?",
        ),
        (
            {("source", "stap"): 3},
            "unknown property 'stap' of component 'source' (parameter source.stap); did you mean step?",
        ),
    ],
)
def test_bad_overrides(
    given: dict[tuple[str, str], int], message: str, tmp_path: Path, plugin_prefix: Path
) -> None:
    with pytest.raises(ArchitectureFileError) as caught:
        _load(tmp_path, GOOD, overrides=Overrides(properties=given))
    assert message in str(caught.value)
