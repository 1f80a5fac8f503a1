"""What a shell has that has sourced `install/setup.bash`, or only a workspace that was built on it."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from mauve_rt import _kernel

INSTALLED = Path(_kernel.__file__).resolve().parents[4]
BARE = {name: os.environ[name] for name in ("HOME", "TERM", "LANG") if name in os.environ} | {
    "PATH": "/usr/local/bin:/usr/bin:/bin"
}
COMPLETE = """\
COMP_LINE="mauve pl" COMP_POINT=8 COMP_TYPE=9 COMP_WORDS=(mauve pl) COMP_CWORD=1
_python_argcomplete mauve pl mauve
echo "completed ${COMPREPLY[*]}"
"""
PACKAGE = {
    "package.xml": """\
<package format="3">
  <name>on_top</name>
  <version>0.1.0</version>
  <description>Has nothing</description>
  <maintainer email="you@example.invalid">You</maintainer>
  <license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <export><build_type>ament_cmake</build_type></export>
</package>
""",
    "CMakeLists.txt": """\
cmake_minimum_required(VERSION 3.22)
project(on_top LANGUAGES NONE)
find_package(ament_cmake REQUIRED)
ament_package()
""",
}
SHELLS = [shell for shell in ("bash", "zsh") if shutil.which(shell)]


def _say(script: str, shell: str = "bash") -> str:
    """What a script prints in a shell that has sourced nothing; a word about anything else fails."""
    done = subprocess.run([shell, "-c", script], env=BARE, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    return done.stdout


def test_bash_completes_the_verbs_of_mauve() -> None:
    said = _say(f"source {INSTALLED}/setup.bash\ncomplete -p mauve\n{COMPLETE}")
    assert "_python_argcomplete" in said
    assert said.splitlines()[-1].split() == ["completed", "plugins"]


@pytest.mark.parametrize("shell", SHELLS)
def test_each_shell_finds_mauve(shell: str) -> None:
    for script in (f"setup.{shell}", f"local_setup.{shell}"):
        assert _say(f". {INSTALLED}/{script}; command -v mauve", shell).startswith(f"{INSTALLED}/bin/mauve")
    assert _say(f". {INSTALLED}/local_setup.sh; command -v mauve", "sh").startswith(f"{INSTALLED}/bin/mauve")


@pytest.mark.skipif(shutil.which("colcon") is None, reason="colcon is not installed")
def test_a_workspace_that_was_built_on_it_brings_it_along(tmp_path: Path) -> None:
    package = tmp_path / "src" / "on_top"
    package.mkdir(parents=True)
    for name, text in PACKAGE.items():
        (package / name).write_text(text, encoding="utf-8")
    build = ["colcon", "--log-base", "log", "build"]
    done = subprocess.run(build, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    said = _say(
        f"source {tmp_path}/install/setup.bash; command -v mauve; mauve --version; ament=$AMENT_PREFIX_PATH\n"
        'echo "$ament"'
    )
    assert said.startswith(f"{INSTALLED}/bin/mauve\n0.")
    assert said.splitlines()[-1].startswith(f"{tmp_path}/install/on_top:{INSTALLED}:")
