"""The file that starts each program: what it says where nothing can be loaded."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
USER = 54321  # in no list of accounts
PYTHON = "/usr/bin/python3"


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """`executor` as it is installed, of a module that is nowhere; anybody may read it."""
    text = (ROOT / "cmake" / "program.py.in").read_text(encoding="utf-8")
    path = tmp_path / "lib" / "mauve_rt" / "executor"
    path.parent.mkdir(parents=True)
    path.write_text(text.replace("@MAUVE_PROGRAM_MODULE@", "mauve_rt.nowhere"), encoding="utf-8")
    (tmp_path / "setup.bash").touch()
    for folder in (tmp_path, *tmp_path.parents[:2]):
        folder.chmod(0o755)
    return path


def _said(program: Path, modules: Path) -> str:
    """By an account without rights, where this one has all."""
    as_other = (
        ["setpriv", f"--reuid={USER}", f"--regid={USER}", "--clear-groups"] if os.geteuid() == 0 else []
    )
    environment = {"PYTHONPATH": str(modules), "PATH": os.environ["PATH"]}
    command = [*as_other, PYTHON, str(program)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, cwd="/")
    assert (done.returncode, done.stdout) == (1, "")
    return done.stderr


def test_without_a_sourced_workspace_it_names_the_file_to_source(program: Path, tmp_path: Path) -> None:
    said = _said(program, tmp_path / "nothing")
    assert said.startswith(
        "executor: cannot load what it needs (No module named 'mauve_rt'); load the workspace"
    )
    assert said.endswith(f"source {tmp_path / 'setup.bash'}\n")


@pytest.mark.skipif(
    not Path(PYTHON).exists() or (os.geteuid() == 0 and shutil.which("setpriv") is None),
    reason="needs the system's python3, and as root setpriv",
)
@pytest.mark.parametrize("closed", ["modules", "modules/mauve_rt"])
def test_without_the_right_to_read_it_names_the_folder(program: Path, tmp_path: Path, closed: str) -> None:
    (tmp_path / "modules" / "mauve_rt").mkdir(parents=True)
    (tmp_path / closed).chmod(0)
    try:
        said = _said(program, tmp_path / "modules")
    finally:
        (tmp_path / closed).chmod(0o755)
    assert f"this account may not read {tmp_path / closed}: give it the right to" in said
