"""The `colcon build` door: a workspace with a clone of this repository and packages of somebody else's."""

import json
import os
import random
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from doors import (
    ALL_JOBS,
    DOMAINS,
    LEAN_BUILD,
    NINJA,
    ROOT,
    build,
    copy_sources,
    installed_executor,
    run,
    shell_without,
)
from new_robot import NewRobot

from mauve_rt import _kernel

INSTALLED = Path(_kernel.__file__).resolve().parents[4]
pytestmark = pytest.mark.timeout(1800)  # it compiles
SHELL = shell_without(INSTALLED) | ALL_JOBS | NINJA
PACKAGES = {"a_listener", "mauve_downstream", "mauve_rt"}
# A package that uses the messages, with a name before mauve_rt's.
LISTENER = {
    "package.xml": """\
<?xml version="1.0"?>
<package format="3">
  <name>a_listener</name>
  <version>0.1.0</version>
  <description>Reads an executor's state</description>
  <maintainer email="you@example.invalid">You</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <depend>mauve_rt</depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
""",
    "CMakeLists.txt": """\
cmake_minimum_required(VERSION 3.22)
project(a_listener LANGUAGES CXX)
find_package(ament_cmake REQUIRED)
find_package(mauve_msgs REQUIRED)
add_library(a_listener STATIC listener.cpp)
target_link_libraries(a_listener PUBLIC mauve_msgs::mauve_msgs__rosidl_generator_cpp)
ament_package()
""",
    "listener.cpp": """\
#include <mauve_msgs/msg/component_info.hpp>
bool is_relay(const mauve_msgs::msg::ComponentInfo& component) { return component.name == "relay"; }
""",
}


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built by one `colcon build`."""
    workspace = tmp_path_factory.mktemp("workspace")
    copy_sources(workspace / "src" / "mauve_rt")
    shutil.copytree(ROOT / "tests" / "downstream", workspace / "src" / "mauve_downstream")
    (workspace / "src" / "a_listener").mkdir()
    for name, text in LISTENER.items():
        (workspace / "src" / "a_listener" / name).write_text(text, encoding="utf-8")
    options = {"names": {"mauve_rt": {"cmake-args": LEAN_BUILD}}}
    (workspace / "colcon.meta").write_text(json.dumps(options), encoding="utf-8")
    build("colcon", "build", "--symlink-install", cwd=workspace, environment=SHELL)
    return workspace


@pytest.fixture(scope="module")
def sourced(workspace: Path) -> dict[str, str]:
    """The environment of a shell that has sourced the workspace."""
    script = "source install/setup.bash && env -0"
    printed = run("bash", "-c", script, cwd=workspace, environment=shell_without(INSTALLED))
    return dict(entry.split("=", 1) for entry in printed.split("\0") if entry)


def test_build_gives_no_warning(workspace: Path) -> None:
    # Both streams: what compilers say comes by stderr from make, by stdout from ninja.
    logs = list(workspace.glob("log/build_*/*/stdout_stderr.log"))
    assert {log.parent.name for log in logs} == PACKAGES
    lines = [line for log in logs for line in log.read_text("utf-8").splitlines()]
    assert [line for line in lines if "warning" in line.lower()] == []


def test_who_depends_on_mauve_rt_has_the_messages(workspace: Path) -> None:
    """To colcon the clone is one package, on which all depend that use any part of it."""

    def colcon(*words: str) -> str:
        return run("colcon", *words, cwd=workspace, environment=SHELL)

    order = colcon("list", "--names-only", "--topological-order").split()
    assert order == ["mauve_rt", "a_listener", "mauve_downstream"]
    up_to = colcon("list", "--names-only", "--topological-order", "--packages-up-to", "a_listener").split()
    assert up_to == ["mauve_rt", "a_listener"]
    edges = set(re.findall(r'"(\w+)" -> "(\w+)"', colcon("graph", "--dot")))
    assert edges == {("a_listener", "mauve_rt"), ("mauve_downstream", "mauve_rt")}
    built = colcon("build", "--packages-select", "a_listener")
    assert re.findall(r"Finished <<< (\w+)", built) == ["a_listener"]


def test_symlink_install_shows_an_edit_without_a_build(workspace: Path, sourced: dict[str, str]) -> None:
    clone, prefix = workspace / "src" / "mauve_rt", workspace / "install" / "mauve_rt"
    [package] = prefix.glob("lib/python3*/site-packages/mauve_rt")
    launch = "launch/executor.launch.py"
    assert (prefix / "share" / "mauve_rt" / launch).readlink() == clone / "mauve_rt" / launch
    compiled = list(package.glob("*.so"))
    assert compiled
    assert not any(module.is_symlink() for module in compiled)
    module = clone / "mauve_rt" / "errors.py"
    text = module.read_text("utf-8")
    edited = text + "EDITED = True\n"
    try:
        module.write_text(edited, encoding="utf-8")
        words = "import mauve_rt.errors as errors; print(errors.EDITED, errors.__file__)"
        said = run("python3", "-c", words, environment=sourced, cwd=workspace)
        assert said == f"True {package / 'errors.py'}\n"
        run("cmake", "--install", workspace / "build" / "mauve_rt", environment=SHELL)
        assert module.read_text("utf-8") == edited  # the next build does not write through the link
        assert (package / "errors.py").readlink() == module
    finally:
        module.write_text(text, encoding="utf-8")


def test_everything_is_where_ros_puts_it(workspace: Path) -> None:
    prefix = workspace / "install" / "mauve_rt"
    index = prefix / "share" / "ament_index" / "resource_index"
    for package in ("mauve_rt", "mauve_msgs"):
        assert (index / "packages" / package).is_file()
        assert (prefix / "share" / package / "package.xml").is_file()
        assert (prefix / "share" / package / "cmake" / f"{package}Config.cmake").is_file()
    assert "msg/ArchitectureState.msg" in (index / "rosidl_interfaces" / "mauve_msgs").read_text("utf-8")
    programs = [
        program for program in (prefix / "lib" / "mauve_rt").iterdir() if program.stat().st_mode & 0o111
    ]
    assert {program.name for program in programs} >= {"executor", "supervisor"}
    headers = ROOT / "mauve_rt" / "kernel" / "include"
    wanted = {path.relative_to(headers) for path in headers.rglob("*.hpp")}
    assert wanted <= {path.relative_to(prefix / "include") for path in (prefix / "include").rglob("*.hpp")}
    launch_files = {path.name for path in (ROOT / "mauve_rt" / "launch").glob("*.launch.py")}
    assert launch_files == {path.name for path in (prefix / "share/mauve_rt/launch").glob("*.launch.py")}


def test_downstream_core_replaces_a_running_one(
    workspace: Path, sourced: dict[str, str], tmp_path: Path
) -> None:
    install = workspace / "install"
    mauve = Path(shutil.which("mauve", path=sourced["PATH"]) or "")
    assert mauve == install / "mauve_rt" / "bin" / "mauve"
    architecture = tmp_path / "relay.yaml"
    shutil.copy(install / "mauve_downstream/share/mauve_downstream/architecture/relay.yaml", architecture)
    program = install / "mauve_rt" / "lib" / "mauve_rt" / "executor"
    with installed_executor([program], architecture, mauve=mauve, environment=sourced) as executor:
        assert executor.component()["core"] == "mauve_rt/Float64Relay"
        replaced = executor.mauve("replace-core", "/executor", "relay", "mauve_downstream/Doubler")
        assert "runs mauve_downstream/Doubler, in place of mauve_rt/Float64Relay" in replaced
        assert executor.component()["core"] == "mauve_downstream/Doubler"
        executor.wait_for_releases()
        libraries = executor.libraries()
        plugin = install / "mauve_downstream" / "lib" / "libmauve_downstream.so"
        assert plugin.resolve() in libraries  # ament_cmake links it to where it was built
        assert all(library.is_relative_to(install) for library in libraries - {plugin.resolve()})
        assert executor.interrupt() == 0, executor.output


def test_a_new_package_runs_to_its_first_swap_in_a_workspace(
    workspace: Path, sourced: dict[str, str], record_property: Callable[[str, object], None]
) -> None:
    mauve = shutil.which("mauve", path=sourced["PATH"]) or ""
    domain = {"ROS_DOMAIN_ID": str(random.choice(DOMAINS))}  # noqa: S311
    environment = sourced | ALL_JOBS | NINJA | domain
    robot = NewRobot(workspace / "src", "my_robot", environment=environment, mauve=mauve)
    said = robot.build()
    assert "mauve: colcon build --symlink-install --packages-select my_robot" in said
    assert (workspace / "install/my_robot/share/my_robot/architecture/robot.yaml").is_file()
    with robot.running():
        record_property("seconds_to_the_swap", robot.swap())
    assert "100% tests passed" in robot.build("--test")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("missing.txt", "there is no file"),
        ("plugins.txt LIBRARIES cores", "'cores' is no target"),
        (
            "plugins.txt LIBRARIES archive",
            "expected a shared library, found that 'archive' is of type STATIC",
        ),
        ("plugins.txt cores", "found 'plugins.txt;cores'"),
        ("", "expected [<index file>] [PACKAGE <name>] [LIBRARIES <target>...], found ''"),
    ],
)
def test_wrong_call_says_what_is_wrong(call: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "plugins.txt").write_text("core; a/Core; a/Shell; mauve_cores\n", encoding="utf-8")
    (tmp_path / "CMakeLists.txt").write_text(
        f"""\
cmake_minimum_required(VERSION 3.22)
project(downstream LANGUAGES NONE)
include("{ROOT}/cmake/mauve_rt_register_plugins.cmake")
add_library(archive STATIC IMPORTED)
mauve_rt_register_plugins({call})
""",
        encoding="utf-8",
    )
    done = subprocess.run(
        ["cmake", "-S", tmp_path, "-B", tmp_path / "build"],
        env=os.environ | NINJA,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    said = " ".join(done.stderr.split())
    assert "mauve_rt_register_plugins of downstream: " in said
    assert message in said
