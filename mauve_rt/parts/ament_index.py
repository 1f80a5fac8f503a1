"""Where installed packages say what they have: the ament index, read without ROS.

Prefixes are those of AMENT_PREFIX_PATH, then the interpreter's own (wheels set no path). The first one
counts.
"""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

_INDEX = Path("share", "ament_index", "resource_index")


def prefixes() -> list[Path]:
    """Every prefix once, in the order of search."""
    listed = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    return list(dict.fromkeys(Path(prefix) for prefix in listed if prefix))


def resources(kind: str) -> Iterator[tuple[str, Path, Path]]:
    """(package, prefix, index file) of every package with a resource of that kind; an overlaid one once."""
    seen: set[str] = set()
    for prefix in prefixes():
        folder = prefix / _INDEX / kind
        for file in sorted(folder.iterdir()) if folder.is_dir() else ():
            if file.name not in seen and not file.name.startswith(".") and file.is_file():
                seen.add(file.name)
                yield file.name, prefix, file


def contents(kind: str, package: str) -> Iterator[tuple[Path, str]]:
    """(prefix, text) of a package's resource of that kind, in every prefix that has it."""
    for prefix in prefixes():
        try:
            yield prefix, (prefix / _INDEX / kind / package).read_text("utf-8", errors="replace")
        except OSError:  # there is none, or the name is too long for one
            continue


def share_folder(package: str) -> Path | None:
    """The package's `share` folder; None when it is not installed."""
    for prefix in prefixes():
        if (prefix / _INDEX / "packages" / package).is_file():
            return prefix / "share" / package
    return None
