"""A package whose shells, fsms and registration are generated from its model, in C++ and in Python."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from arm_model import arm
from compiled_plugins import INSTALLED

from mauve_rt._kernel import PluginRegistry
from mauve_rt.cli.main import main
from mauve_rt.model.plugins import PluginIndex, PluginLoader, parse_index
from mauve_rt.model.registered_model import registered_model
from mauve_rt.modelling.loading import ModelLoader, load_model
from mauve_rt.modelling.schema import ModelFile
from mauve_rt.yaml.writer import write_yaml

GUIDANCE = Path(__file__).parents[1] / "python/modelling/guidance.yaml"
pytestmark = pytest.mark.timeout(300)  # it compiles
CMAKE = """\
cmake_minimum_required(VERSION 3.22)
project(my_robot LANGUAGES C CXX)
find_package(ament_cmake REQUIRED)
find_package(mauve_rt REQUIRED)
"""
IN_CPP = """\
add_library(my_robot SHARED src/planned_guidance.cpp src/straight_guidance.cpp)
mauve_rt_generate_model(my_robot)
mauve_rt_register_plugins(LIBRARIES my_robot)
ament_package()
"""
IN_PYTHON = """\
mauve_rt_generate_model(PYTHON)
ament_package()
"""
XML = """\
<package format="3"><name>my_robot</name><version>0.1.0</version><description>Guidance</description>
<maintainer email="you@example.invalid">You</maintainer><license>Apache-2.0</license>
<buildtool_depend>ament_cmake</buildtool_depend>
<buildtool_depend>rosidl_default_generators</buildtool_depend>
<depend>mauve_rt</depend><exec_depend>rosidl_default_runtime</exec_depend>
<member_of_group>rosidl_interface_packages</member_of_group></package>
"""


ARM = arm("{at: my_robot/Point2D, home: geometry_msgs/msg/Point}")
ROBOT = """\
mauve: 1
components:
  follower: {shell: my_robot/GuidanceShell, core: my_arm/Eager, fsm: my_arm/FollowerFsm}
resources:
  point: {kind: shared_data, type: geometry_msgs/msg/Point}
  target: {kind: shared_data, type: geometry_msgs/msg/Point}
connections:
  - [follower.position, point.read]
  - [follower.goal, point.read]
  - [follower.target, target.write]
"""
ARM_IN_CPP = """\
add_library(my_arm SHARED src/quick_arm.cpp src/eager.cpp)
mauve_rt_generate_model(my_arm)
mauve_rt_register_plugins(LIBRARIES my_arm)
ament_package()
"""


class Package:
    """A package in a folder, as `mauve generate` begins it."""

    def __init__(
        self,
        folder: Path,
        cmake: str,
        *options: str,
        name: str = "my_robot",
        model: str = "",
        used: Path | None = None,
    ) -> None:
        self.source, self.build, self.prefix = (
            folder / name / part for part in ("source", "build", "install")
        )
        self.source.mkdir(parents=True)
        self.used = used
        self.model = self.source / "model.yaml"
        self.model.write_text(model or GUIDANCE.read_text(encoding="utf-8"), encoding="utf-8")
        (self.source / "CMakeLists.txt").write_text(
            (CMAKE + cmake).replace("my_robot", name), encoding="utf-8"
        )
        (self.source / "package.xml").write_text(XML.replace("my_robot", name), encoding="utf-8")
        others = [str(used / "share/my_robot/model.yaml")] if used is not None else []
        assert main(["generate", str(self.model), *others, *options]) == 0

    def configured(self) -> tuple[int, str]:
        """Status and output of CMake, as with the wheels."""
        searched = [str(INSTALLED), *os.environ["AMENT_PREFIX_PATH"].split(os.pathsep)]
        searched += [str(self.used)] if self.used is not None else []
        options = [f"-DCMAKE_PREFIX_PATH={';'.join(searched)}", f"-DCMAKE_INSTALL_PREFIX={self.prefix}"]
        options.append(f"-DPython3_EXECUTABLE={sys.executable}")
        return run("cmake", "-G", "Ninja", "-S", self.source, "-B", self.build, *options)

    def installed(self) -> None:
        """Configured, built and installed."""
        status, told = self.configured()
        assert status == 0, told
        status, told = self.built("install")
        assert status == 0, told

    def built(self, *targets: str) -> tuple[int, str]:
        """Status and output of a build."""
        return run("cmake", "--build", self.build, *(word for each in targets for word in ("--target", each)))

    def rename(self, before: str, after: str) -> None:
        """In the model."""
        text = self.model.read_text(encoding="utf-8")
        assert before in text
        self.model.write_text(text.replace(before, after), encoding="utf-8")


def run(*words: str | Path) -> tuple[int, str]:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def read_back(package: str, *prefixes: Path) -> ModelFile:
    plugins = []
    for prefix in prefixes:
        for index in prefix.glob("share/ament_index/resource_index/mauve_rt_plugins/*"):
            found, complaints = parse_index(index.read_text(encoding="utf-8"), prefix=prefix, origin="index")
            assert complaints == []
            plugins += found
    model = registered_model(package, PluginLoader(PluginRegistry(), PluginIndex(plugins)))
    assert model.guesses == []
    text = write_yaml(model.content)
    return ModelLoader(prefixes=prefixes).load("model.yaml", text=text).content


def test_a_model_is_built_in_cpp_and_read_back(tmp_path: Path) -> None:
    """Messages, structs, shells, fsms: the registered parts are the model again."""
    package = Package(tmp_path, IN_CPP)
    package.installed()
    assert (package.prefix / "share/my_robot/msg/Path.msg").is_file()
    assert (
        read_back("my_robot", package.prefix)
        == load_model(package.prefix / "share/my_robot/model.yaml").content
    )

    package.rename("follow_path", "follow")
    status, told = package.built("my_robot")
    assert status != 0
    assert "follow_path" in told
    assert "marked 'override', but does not override" in told.replace("‘", "'").replace("’", "'")  # noqa: RUF001


def test_a_package_derives_from_parts_of_another_one(tmp_path: Path) -> None:
    """It has the other's shell, its type, and an fsm that calls the other's core."""
    robot = Package(tmp_path, IN_CPP)
    robot.installed()
    arm = Package(tmp_path, ARM_IN_CPP, name="my_arm", model=ARM, used=robot.prefix)
    arm.installed()
    assert (arm.prefix / "include/my_arm/model/follower_core.hpp").is_file()
    content = read_back("my_arm", arm.prefix, robot.prefix)
    written = load_model_of(ARM.replace("my_robot/Point2D", "my_robot/msg/Point2D"), robot.prefix)
    assert content == written

    other = Package(
        tmp_path,
        IN_PYTHON,
        "--python",
        name="my_other",
        model=ARM.replace("my_arm", "my_other"),
        used=robot.prefix,
    )
    status, told = other.configured()
    assert status != 0
    assert "model.yaml:15:12: package 'my_robot' has no code in Python of its model" in " ".join(told.split())


def load_model_of(text: str, prefix: Path) -> ModelFile:
    return ModelLoader(prefixes=[prefix]).load("model.yaml", text=text).content


REACH = "types:\n  Reach: {at: my_robot/Point2D, home: geometry_msgs/msg/Point}\n"


def in_python(text: str) -> str:
    """A model whose types are installed messages: those of a package in Python need a build in C."""
    text = text.replace(
        'types:\n  Point2D: {x: float64, y: float64}\n  Path: {points: "Point2D[<=64]"}\n', ""
    )
    text = text.replace(REACH, "").replace("Reach", "geometry_msgs/msg/Point")
    text = text.replace("my_robot/Point2D", "Point2D").replace("Point2D", "geometry_msgs/msg/Point")
    return text.replace("current_goal: geometry_msgs/msg/Point, path: Path, ", "")


def test_a_package_in_python_derives_from_parts_of_another_one(tmp_path: Path) -> None:
    robot = Package(tmp_path, IN_PYTHON, "--python", model=in_python(GUIDANCE.read_text(encoding="utf-8")))
    robot.installed()
    arm = Package(tmp_path, IN_PYTHON, "--python", name="my_arm", model=in_python(ARM), used=robot.prefix)
    arm.installed()
    robot_file = tmp_path / "robot.yaml"
    robot_file.write_text(ROBOT, encoding="utf-8")
    prefixes = [str(INSTALLED), str(robot.prefix), str(arm.prefix), os.environ["AMENT_PREFIX_PATH"]]
    folders = [str(path) for each in (robot, arm) for path in each.prefix.glob("lib/python3*/site-packages")]
    environment = {
        **os.environ,
        "AMENT_PREFIX_PATH": os.pathsep.join(prefixes),
        "PYTHONPATH": os.pathsep.join([*folders, os.environ.get("PYTHONPATH", "")]),
    }
    checked = subprocess.run(
        [sys.executable, "-m", "mauve_rt.cli", "check", str(robot_file)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        timeout=120,
    )
    assert checked.returncode == 0, checked.stderr


def test_a_method_that_the_model_renames_ends_the_build(tmp_path: Path) -> None:
    package = Package(tmp_path, IN_PYTHON, "--python", model=in_python(GUIDANCE.read_text(encoding="utf-8")))
    package.installed()
    modules: Sequence[Path] = [*package.prefix.glob("lib/python3*/site-packages/my_robot_parts/*.py")]
    assert {path.name for path in modules} == {
        "__init__.py",
        "model.py",
        "planned_guidance.py",
        "straight_guidance.py",
    }

    package.rename("follow_path", "follow")
    status, told = package.built()
    assert status != 0
    assert "PlannedGuidance has a method follow_path that the model does not name" in told
