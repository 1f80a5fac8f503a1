"""The paths by which tools find MAUVE RT, and executors the packages of users."""

import os
import sys
from pathlib import Path

from mauve_rt.native_program import native_prefix


def to_build() -> dict[str, str]:
    """This process's environment, in which CMake finds MAUVE RT and the ROS that it uses."""
    return _with({"CMAKE_PREFIX_PATH": [native_prefix(), Path(sys.prefix)]}, first=False)


def to_run(prefix: Path) -> dict[str, str]:
    """This process's environment, in which the package of the prefix is found first."""
    paths = {
        "AMENT_PREFIX_PATH": [prefix],
        "PYTHONPATH": sorted(prefix.glob("lib/python3*/site-packages")),
        "LD_LIBRARY_PATH": [prefix / "lib"],
    }
    return _with(paths, first=True)


def _with(added: dict[str, list[Path]], *, first: bool) -> dict[str, str]:
    """The environment with more folders in lists of paths, each once."""
    result = dict(os.environ)
    for name, paths in added.items():
        there = [part for part in result.get(name, "").split(os.pathsep) if part]
        new = [str(path) for path in paths]
        parts = new + there if first else there + new
        if parts:
            result[name] = os.pathsep.join(dict.fromkeys(parts))
    return result
