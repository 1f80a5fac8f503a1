"""A package whose shells, fsms and registration are generated from its model, in C++ and in Python."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from compiled_plugins import INSTALLED

from mauve_rt._kernel import PluginRegistry
from mauve_rt.cli.main import main
from mauve_rt.model.plugins import PluginIndex, PluginLoader, parse_index
from mauve_rt.model.registered_model import registered_model
from mauve_rt.modelling.loading import load_model
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


class Package:
    """A package in a folder, as `mauve generate` begins it."""

    def __init__(self, folder: Path, cmake: str, *options: str) -> None:
        self.source, self.build, self.prefix = (folder / name for name in ("source", "build", "install"))
        self.source.mkdir()
        self.model = self.source / "model.yaml"
        self.model.write_text(GUIDANCE.read_text(encoding="utf-8"), encoding="utf-8")
        (self.source / "CMakeLists.txt").write_text(CMAKE + cmake, encoding="utf-8")
        (self.source / "package.xml").write_text(XML, encoding="utf-8")
        assert main(["generate", str(self.model), *options]) == 0

    def configure(self) -> None:
        """By CMake, as with the wheels."""
        searched = ";".join([str(INSTALLED), *os.environ["AMENT_PREFIX_PATH"].split(os.pathsep)])
        options = [f"-DCMAKE_PREFIX_PATH={searched}", f"-DCMAKE_INSTALL_PREFIX={self.prefix}"]
        options.append(f"-DPython3_EXECUTABLE={sys.executable}")
        status, told = run("cmake", "-G", "Ninja", "-S", self.source, "-B", self.build, *options)
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


def read_back(prefix: Path) -> object:
    index = prefix / "share/ament_index/resource_index/mauve_rt_plugins/my_robot"
    plugins, complaints = parse_index(index.read_text(encoding="utf-8"), prefix=prefix, origin="index")
    assert complaints == []
    found = registered_model("my_robot", PluginLoader(PluginRegistry(), PluginIndex(plugins)))
    assert found.guesses == []
    return load_model("model.yaml", text=write_yaml(found.content)).content


def test_a_model_is_built_in_cpp_and_read_back(tmp_path: Path) -> None:
    """Messages, structs, shells, fsms: the registered parts are the model again."""
    package = Package(tmp_path, IN_CPP)
    package.configure()
    status, told = package.built("install")
    assert status == 0, told
    assert (package.prefix / "share/my_robot/msg/Path.msg").is_file()
    assert read_back(package.prefix) == load_model(package.prefix / "share/my_robot/model.yaml").content

    package.rename("follow_path", "follow")
    status, told = package.built("my_robot")
    assert status != 0
    assert "follow_path" in told
    assert "marked 'override', but does not override" in told.replace("‘", "'").replace("’", "'")  # noqa: RUF001


def test_a_method_that_the_model_renames_ends_the_build(tmp_path: Path) -> None:
    package = Package(tmp_path, IN_PYTHON, "--python")
    package.rename('types:\n  Point2D: {x: float64, y: float64}\n  Path: {points: "Point2D[<=64]"}\n', "")
    package.rename("Point2D", "geometry_msgs/msg/Point")
    package.rename("current_goal: geometry_msgs/msg/Point, path: Path, ", "")
    package.configure()
    status, told = package.built("install")
    assert status == 0, told
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
