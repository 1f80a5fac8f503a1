"""The installed programs in a shell that has not loaded the workspace; what is installed is compiled."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mauve_rt import _kernel

SITE = Path(_kernel.__file__).resolve().parents[1]
PREFIX = SITE.parents[2]
DOWNSTREAM = Path(__file__).parents[2] / "downstream"
PROGRAMS = ["bin/mauve", "lib/mauve_rt/executor", "lib/mauve_rt/supervisor", "lib/mauve_examples/radio"]


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("found", ["nothing", "our packages"])
def test_a_workspace_that_is_not_loaded_is_told_in_a_line(found: str, program: str, tmp_path: Path) -> None:
    # An interpreter without ROS, as a shell finds it where no virtual environment is active.
    (tmp_path / "python3").symlink_to(Path(sys.executable).resolve())
    environment = {"PATH": f"{tmp_path}:/usr/bin:/bin", "HOME": os.environ.get("HOME", "/")}
    if found == "our packages":
        environment["PYTHONPATH"] = str(SITE)
    words = ["nodes"] if program == "bin/mauve" else ["--ros-args", "-p", "autostart:=false"]
    done = subprocess.run(
        [PREFIX / program, *words], env=environment, capture_output=True, text=True, check=False, timeout=40
    )
    assert done.returncode == 1
    [line] = done.stderr.splitlines()
    assert line.startswith(f"{Path(program).name}: cannot load what it needs (")
    assert line.endswith("setup.bash")


@pytest.mark.parametrize("package", ["mauve_rt", "mauve_examples", "mauve_msgs"])
def test_what_is_installed_is_compiled(package: str) -> None:
    sources = list((SITE / package).rglob("*.py"))
    compiled = [Path(importlib.util.cache_from_source(str(source))) for source in sources]
    assert sources
    assert [path for path in compiled if not path.exists()] == []


def test_who_links_the_kernel_is_compiled_with_stack_protection(tmp_path: Path) -> None:
    words = [
        "-S",
        DOWNSTREAM,
        "-B",
        tmp_path,
        "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON",
        f"-DCMAKE_PREFIX_PATH={PREFIX}",
    ]
    done = subprocess.run(["cmake", *words], capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    commands = [
        command
        for command in json.loads((tmp_path / "compile_commands.json").read_text("utf-8"))
        if Path(command["file"]).is_relative_to(DOWNSTREAM)  # not what rosidl generates
    ]
    assert commands
    assert all("-fstack-clash-protection" in command["command"].split() for command in commands)
