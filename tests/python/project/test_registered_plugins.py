"""mauve_rt_register_plugins(): the build lists what libraries register."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from compiled_plugins import INSTALLED

pytestmark = pytest.mark.timeout(300)  # it compiles
LISTS = """\
cmake_minimum_required(VERSION 3.22)
project(odd_parts LANGUAGES CXX)
find_package(mauve_rt REQUIRED)
add_library(odd SHARED odd.cpp)
mauve_rt_register_plugins({call})
"""
NO_PLUGIN = "int nothing() { return 0; }\n"


def built(folder: Path, call: str, *, source: str = NO_PLUGIN) -> subprocess.CompletedProcess[str]:
    """Configure, build and install a package with one library."""
    (folder / "CMakeLists.txt").write_text(LISTS.format(call=call), encoding="utf-8")
    (folder / "odd.cpp").write_text(source, encoding="utf-8")
    options = [
        f"-DCMAKE_PREFIX_PATH={INSTALLED}",
        f"-DCMAKE_INSTALL_PREFIX={folder / 'install'}",
        f"-DPython3_EXECUTABLE={sys.executable}",
    ]
    words = ["cmake", "-G", "Ninja", "-S", str(folder), "-B", str(folder / "build"), *options]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return subprocess.run(
        ["cmake", "--build", str(folder / "build"), "--target", "install"],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"LC_ALL": "C"},
    )


def index(folder: Path) -> str:
    path = folder / "install/share/ament_index/resource_index/mauve_rt_plugins/odd_parts"
    return path.read_text(encoding="utf-8")


def test_a_library_that_cannot_be_loaded_ends_the_build(tmp_path: Path) -> None:
    done = built(tmp_path, "LIBRARIES odd")
    assert done.returncode != 0
    said = " ".join((done.stdout + done.stderr).split())
    assert "mauve_rt_register_plugins: " in said
    assert "libodd.so: the library was built against another version of MAUVE RT" in said
    assert not (tmp_path / "install").exists()


def test_a_library_that_the_file_names_is_listed_by_hand(tmp_path: Path) -> None:
    text = "core; odd_parts/Odd; mauve_rt/Float64SinkShell; odd\n"
    (tmp_path / "plugins.txt").write_text(text, encoding="utf-8")
    done = built(tmp_path, "plugins.txt LIBRARIES odd")
    assert done.returncode == 0, done.stdout + done.stderr
    assert index(tmp_path) == text
