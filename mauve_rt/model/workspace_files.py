"""Which files of the running code a user may rebuild, and which belong to the system or to this Python."""

import site
import sys
import sysconfig
from functools import cache
from pathlib import Path

_SYSTEM = ("/lib", "/lib32", "/lib64", "/usr", "/opt/ros")
_LOCAL = Path("/usr/local")  # users install their own builds there


def may_be_rebuilt(file: Path) -> bool:
    """Whether the file may be built again while this process runs.

    Such a file stands in a workspace, wherever that is. Files of the system, of an installed ROS and of this
    Python (its prefix also holds ROS wheels with their libraries) are changed by an upgrade only.
    """
    found = file.resolve()
    return not any(found.is_relative_to(folder) for folder in _fixed_folders()) and not (
        not found.is_relative_to(_LOCAL) and any(found.is_relative_to(folder) for folder in _SYSTEM)
    )


@cache
def _fixed_folders() -> frozenset[Path]:
    """The folders of this Python. A prefix such as /usr or /usr/local holds more than Python."""
    of_python = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")}
    of_python |= {*site.getsitepackages(), site.getusersitepackages()}
    shared = {_LOCAL, *map(Path, _SYSTEM)}
    prefixes = {Path(prefix).resolve() for prefix in (sys.prefix, sys.base_prefix)} - shared
    return frozenset({Path(folder).resolve() for folder in of_python if folder} | prefixes)
