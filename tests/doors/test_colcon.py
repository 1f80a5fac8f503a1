"""The `colcon build` door: a workspace with a clone of this repository and a package of somebody else's."""

import shutil
import subprocess
from pathlib import Path

import pytest
from doors import ALL_JOBS, CHEAP_BUILD, ROOT, copy_sources, installed_executor, run, shell_without

from mauve_rt import _kernel

INSTALLED = Path(_kernel.__file__).resolve().parents[4]
pytestmark = pytest.mark.timeout(1800)  # it compiles


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built by one `colcon build`."""
    workspace = tmp_path_factory.mktemp("workspace")
    copy_sources(workspace / "src" / "mauve_rt")
    shutil.copytree(ROOT / "tests" / "downstream", workspace / "src" / "mauve_downstream")
    command = ["colcon", "build", "--cmake-args", "-G", "Ninja", *CHEAP_BUILD]
    run(*command, cwd=workspace, environment=shell_without(INSTALLED) | ALL_JOBS)
    return workspace


@pytest.fixture(scope="module")
def sourced(workspace: Path) -> dict[str, str]:
    """The environment of a shell that has sourced the workspace."""
    script = "source install/setup.bash && env -0"
    printed = run("bash", "-c", script, cwd=workspace, environment=shell_without(INSTALLED))
    return dict(entry.split("=", 1) for entry in printed.split("\0") if entry)


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
        assert "runs mauve_downstream/Doubler, before mauve_rt/Float64Relay" in replaced
        assert executor.component()["core"] == "mauve_downstream/Doubler"
        executor.wait_for_releases()
        libraries = executor.libraries()
        assert install / "mauve_downstream" / "lib" / "libmauve_downstream.so" in libraries
        assert all(library.is_relative_to(install) for library in libraries)
        assert executor.interrupt() == 0, executor.output


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ("missing.txt", "there is no file"),
        ("plugins.txt LIBRARIES cores", "'cores' is no target"),
        (
            "plugins.txt LIBRARIES archive",
            "expected a shared library, found that 'archive' is of type STATIC",
        ),
        ("plugins.txt LIBRARIES others", "names the library 'others'"),
        ("plugins.txt cores", "found 'cores' besides"),
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
add_library(others SHARED IMPORTED)
mauve_rt_register_plugins({call})
""",
        encoding="utf-8",
    )
    done = subprocess.run(
        ["cmake", "-S", tmp_path, "-B", tmp_path / "build"], capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    said = " ".join(done.stderr.split())
    assert "mauve_rt_register_plugins of downstream: " in said
    assert message in said
