"""`mauve new`, `mauve build` and `mauve run` up to where a tool or an executor begins: nothing is built here.

tests/ros/test_new_packages.py builds and runs what `mauve new` writes.
"""

import ast
import json
import os
import shutil
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from mauve_rt.cli import build_verb, run_verb
from mauve_rt.cli.main import main
from mauve_rt.errors import ParameterError
from mauve_rt.file_schema.yaml_file import YamlFile
from mauve_rt.model.file_kinds import file_kind
from mauve_rt.scaffold import rendering
from mauve_rt.scaffold.names import check_package, part_names
from mauve_rt.scaffold.package import find_package
from mauve_rt.scaffold.schemas import file_schema


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder in which the commands are typed."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def files(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", ["my_robot", "rover2", "a1_b2"])
def test_a_package_name_of_ros_is_taken(name: str) -> None:
    check_package(name)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("MyRobot", "Choose a name such as my_robot."),
        ("my-robot", "Choose a name such as my_robot."),
        ("my__robot", "single underscores"),
        ("robot_", "single underscores"),
        ("2wheels", "after a first letter"),
        ("r", "expected lower-case letters"),
        ("../robot", "expected lower-case letters"),
        ("test", "a meaning of its own"),
        ("namespace", "keyword of C++"),
        ("class", "keyword of C++ and Python"),
        ("lambda", "keyword of Python"),
    ],
)
def test_a_bad_package_name_is_refused(
    name: str, said: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "package", name]) == 2
    assert said in capsys.readouterr().err
    assert not list(here.iterdir())


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("LiftArm", ("LiftArm", "lift_arm")),
        ("lift_arm", ("LiftArm", "lift_arm")),
        ("lift", ("Lift", "lift")),
        ("IMUDriver2", ("IMUDriver2", "imu_driver2")),
    ],
)
def test_a_part_has_the_name_of_a_class_and_of_a_file(name: str, names: tuple[str, str]) -> None:
    assert part_names(name) == names


@pytest.mark.parametrize("name", ["lift-arm", "2arms", "_arm", "a__b", "", "class", "None", "Union", "été"])
def test_a_part_that_is_no_identifier_is_refused(name: str) -> None:
    with pytest.raises(ParameterError, match="Choose"):
        part_names(name)


@pytest.mark.parametrize("language", [[], ["--python"]])
def test_each_new_yaml_file_names_its_schema(language: list[str], here: Path) -> None:
    main(["new", "package", "robot_1", *language])
    main(["new", "rules", "repair", "--in", "robot_1"])
    written = sorted(here.glob("robot_1/architecture/*.yaml"))
    assert [path.name for path in written] == ["repair_rules.yaml", "robot.yaml", "rules.yaml"]
    for path in written:
        named = path.read_text().splitlines()[0].removeprefix("# yaml-language-server: $schema=")
        schema = json.loads((path.parent / named).read_text())
        assert schema == file_schema(file_kind(path))
        Draft202012Validator(schema).validate(YamlFile(path).data)
    assert (here / "robot_1/.mauve/.gitignore").read_text() == "*\n"


def test_a_build_brings_the_schemas_of_a_package_up_to_date(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["new", "package", "robot_1"])
    schemas = here / "robot_1/.mauve"
    before = files(schemas)
    (schemas / "schema/rules.schema.json").write_text("{}")
    (schemas / "schema/model.schema.json").unlink()
    kept = (schemas / "schema/steps.schema.json").stat().st_mtime_ns
    monkeypatch.setattr(build_verb, "_cmake", lambda *_, **__: iter([["false"]]))  # the schemas come first
    assert main(["build", "robot_1"]) == 1
    assert files(schemas) == before
    assert (schemas / "schema/steps.schema.json").stat().st_mtime_ns == kept
    shutil.rmtree(schemas)
    schemas.write_text("a file where the folder is to be")
    assert main(["build", "robot_1"]) == 1
    assert "mauve: no schemas for editors: " in capsys.readouterr().err


def test_a_package_is_never_overwritten(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "package", "robot_1"]) == 0
    before = files(here)
    assert main(["new", "package", "robot_1", "--python"]) == 2
    assert "robot_1: exists already, and nothing was written" in capsys.readouterr().err
    assert files(here) == before


def test_a_part_is_written_as_a_whole_or_not_at_all(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["new", "package", "robot_1"])
    (here / "robot_1/test/test_lift.cpp").write_text("mine")
    before = files(here)
    assert main(["new", "component", "lift", "--in", "robot_1"]) == 2
    assert "robot_1/test/test_lift.cpp: exists already" in capsys.readouterr().err
    assert files(here) == before


def test_a_part_that_cannot_be_written_leaves_nothing(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    main(["new", "package", "robot_1"])
    (here / "robot_1/plugins").write_text("a file where the folder is to be")
    before = files(here)
    with pytest.raises(OSError, match="plugins"):
        rendering.write_parts(here / "robot_1", {Path("a/new.py"): "", Path("plugins/new.txt"): ""})
    assert files(here) == before


def test_new_parts_change_no_file(here: Path) -> None:
    main(["new", "package", "robot_1"])
    before = files(here / "robot_1")
    os.chdir(here / "robot_1" / "src")  # the package is the one around
    for words in (
        ["component", "lift", "--python"],
        ["core", "Slow", "--for", "DriveShell"],
        ["core", "Slower", "--for", "lift", "--python"],
        ["resource", "tally"],
        ["message", "leg"],
        ["rules", "repair"],
    ):
        assert main(["new", *words]) == 0
    after = files(here / "robot_1")
    assert before.items() <= after.items()
    assert {
        "msg/Leg.msg",
        "src/slow.cpp",
        "plugins/slower.txt",
        "architecture/repair_rules.yaml",
    } <= after.keys()


def test_files_in_python_compile(here: Path) -> None:
    main(["new", "package", "robot_1", "--python"])
    python = {name: text for name, text in files(here).items() if name.endswith(".py")}
    assert {"robot_1/launch/robot.launch.py", "robot_1/robot_1_parts/drive.py"} <= python.keys()
    for name, text in python.items():
        ast.parse(text, name)


def test_a_core_needs_to_know_its_shell(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    main(["new", "package", "robot_1"])
    main(["new", "component", "eye", "--in", "robot_1", "--python"])
    assert main(["new", "core", "one", "--in", "robot_1"]) == 0  # C++ has one shell only
    capsys.readouterr()
    assert main(["new", "core", "two", "--in", "robot_1", "--python"]) == 2
    found = "found DriveShell (core Drive), EyeShell (core Eye). Choose one with --for SHELL."
    assert found in capsys.readouterr().err
    assert main(["new", "core", "two", "--in", "robot_1", "--for", "Eye"]) == 2
    assert "expected a shell or core of robot_1 in C++" in capsys.readouterr().err


def test_a_core_derives_from_the_one_that_it_replaces_if_that_can_be(here: Path) -> None:
    main(["new", "package", "robot_1"])
    main(["new", "core", "fast", "--in", "robot_1"])
    header = here / "robot_1/src/drive.hpp"
    header.write_text(header.read_text().replace("class Drive :", "class Drive final :"))
    main(["new", "core", "slow", "--in", "robot_1"])
    assert "class Fast : public Drive {" in (here / "robot_1/src/fast.hpp").read_text()
    assert (
        "class Slow : public mauve::UpdateCore<DriveShell> {" in (here / "robot_1/src/slow.hpp").read_text()
    )


@pytest.fixture
def modelled(here: Path) -> Path:
    """A package with the model of the paper's Guidance."""
    guidance = Path(__file__).parents[1] / "modelling/guidance.yaml"
    folder = here / "my_robot"
    folder.mkdir()
    (folder / "package.xml").write_text("<package><name>my_robot</name></package>")
    (folder / "model.yaml").write_text(guidance.read_text(encoding="utf-8"), encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "base", ["Guidance", "my_robot/PlannedGuidance", "GuidanceShell", "GuidanceCore", ""]
)
def test_a_core_of_a_model_has_its_actions_and_guards(
    base: str, modelled: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--for", base] if base else []
    assert main(["new", "core", "CarefulGuidance", "--in", str(modelled), *words]) == 0
    told = capsys.readouterr()
    assert told.out.splitlines()[0] == str(modelled / "src/careful_guidance.hpp")
    assert "add `CarefulGuidance: {}` to cores.Guidance.implementations" in told.err
    header = (modelled / "src/careful_guidance.hpp").read_text()
    assert "class CarefulGuidance final : public GuidanceCore {" in header
    for method in ("void compute_path() override;", "bool has_new_goal() const override;"):
        assert method in header
    assert main(["check", str(modelled / "model.yaml")]) == 0


def test_a_core_of_a_model_in_python_is_one(modelled: Path) -> None:
    assert main(["new", "core", "Careful", "--python", "--for", "Guidance", "--in", str(modelled)]) == 0
    assert "class Careful(GuidanceCore):" in (modelled / "my_robot_parts/careful.py").read_text()


def test_a_core_that_the_model_lacks_is_refused(modelled: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = files(modelled)
    assert main(["new", "core", "Careful", "--for", "Guidence", "--in", str(modelled)]) == 2
    assert (
        "model.yaml has no such core, shell or algorithm; did you mean Guidance?" in capsys.readouterr().err
    )
    assert files(modelled) == before


def test_without_a_package_the_remedy_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["new", "component", "lift"], ["build"], ["run"]):
        assert main(words) == 2
        assert "Go to a package, or write one with mauve new package NAME." in capsys.readouterr().err


def test_colcon_builds_in_a_workspace_and_cmake_elsewhere(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (here / "ws/src").mkdir(parents=True)
    main(["new", "package", "robot_1"])
    shutil.copytree("robot_1", "ws/src/robot_1")
    monkeypatch.setattr(shutil, "which", lambda program: f"/usr/bin/{program}")
    assert find_package(here / "robot_1").workspace is None
    package = find_package(here / "ws/src/robot_1/src")
    assert package.workspace == here / "ws"
    build, own, test = build_verb._colcon(package, "Debug", test=True)
    assert [*build, *own][:2] == ["colcon", "build"]
    assert own[2:] == ["--packages-select", "robot_1", "--cmake-args", "-DCMAKE_BUILD_TYPE=Debug"]
    assert test[:2] == ["colcon", "test"]
    cache = here / "ws/build/other/CMakeCache.txt"
    cache.parent.mkdir(parents=True)
    cache.write_text("AMENT_CMAKE_SYMLINK_INSTALL:UNINITIALIZED=1\n")
    assert all("--symlink-install" in each for each in [*build_verb._colcon(package, "Release", test=False)])
    monkeypatch.setattr(shutil, "which", lambda _: None)
    assert find_package(here / "ws/src/robot_1").workspace is None


def test_a_tool_that_is_missing_or_fails_ends_the_build(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["new", "package", "robot_1"])
    monkeypatch.setenv("PATH", "")
    assert main(["build", "robot_1"]) == 2
    assert "cmake is not installed; install it (apt install cmake)" in capsys.readouterr().err
    cmake = here / "cmake"
    cmake.write_text("#!/bin/sh\nexit 7\n")
    cmake.chmod(0o755)
    monkeypatch.setenv("PATH", str(here))
    assert main(["build", "robot_1"]) == 7


@pytest.fixture
def executed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[list[str], dict[str, str]]]:
    """What `mauve run` becomes."""
    calls: list[tuple[list[str], dict[str, str]]] = []

    def become(_: str, command: list[str], environment: dict[str, str]) -> None:
        calls.append((command, environment))

    monkeypatch.setattr(run_verb.os, "execvpe", become)
    return calls


def install(package: Path) -> None:
    share = package / "install/share" / package.name
    share.mkdir(parents=True)
    shutil.copy(package / "package.xml", share)


def test_run_becomes_the_executor_of_the_package(
    here: Path, executed: list[tuple[list[str], dict[str, str]]], capsys: pytest.CaptureFixture[str]
) -> None:
    main(["new", "package", "robot_1"])
    os.chdir(here / "robot_1")
    assert main(["run"]) == 2
    assert "Call mauve build." in capsys.readouterr().err
    install(here / "robot_1")
    main(["run", "--rules", "a.yaml", "--bag", "b", "--ros-args", "-p", "drive.speed:=0.5"])
    [(command, environment)] = executed
    given = [f"architecture:={here}/robot_1/architecture/robot.yaml", "rules:=a.yaml", "bag:=b"]
    words = [word for each in given for word in ("-p", each)]
    assert command[1].endswith("lib/mauve_rt/executor")
    assert command[2:] == ["--ros-args", *words, "-p", "drive.speed:=0.5"]
    assert environment["AMENT_PREFIX_PATH"].split(":")[0] == str(here / "robot_1/install")
    assert "mauve replace-core /executor drive robot_1/Halt" in capsys.readouterr().out


def test_run_takes_the_only_architecture_or_the_one_named(
    here: Path, executed: list[tuple[list[str], dict[str, str]]], capsys: pytest.CaptureFixture[str]
) -> None:
    main(["new", "package", "robot_1"])
    install(here / "robot_1")
    folder = here / "robot_1/architecture"
    shutil.copy(folder / "robot.yaml", folder / "bench.yaml")
    os.chdir(here / "robot_1")
    assert main(["run"]) == 2
    assert "expected one architecture file" in (said := capsys.readouterr().err)
    assert "found bench, robot. Call mauve run NAME." in said
    assert main(["run", "none"]) == 2
    main(["run", "bench"])
    os.chdir(here)
    main(["run", "robot_1/architecture/bench.yaml"])
    assert [command[4].endswith("architecture/bench.yaml") for command, _ in executed] == [True, True]
