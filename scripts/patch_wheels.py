#!/usr/bin/env python3
"""Rewrite the build machine's paths in the CMake files of the ROS 2 wheels.

The wheels name the folders of the machine that built them: the interpreter's headers, numpy's headers and a
system library. Run once after `pip install`, with the environment's own python; a second run changes nothing.

    .venv/bin/python scripts/patch_wheels.py

setup.py, which may not change the environment it builds in, patches a copy: `private_prefix`.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
import sysconfig
from pathlib import Path

CMAKE_FOLDERS = (Path("share"), Path("lib", "cmake"))


def patched(text: str, *, prefix: str, include: str) -> str:
    """Return `text` with every path of the build machine replaced by this machine's."""
    text = re.sub(r"/opt/python/cp\w+-cp\w+/include/python[\d.]+t?", lambda _: include, text)
    text = re.sub(r"/opt/python/cp\w+-cp\w+", lambda _: prefix, text)
    return text.replace("/usr/lib64/libtinyxml2.so;", "")


def patch(prefix: Path) -> int:
    """Patch the CMake files of a prefix; returns how many files changed."""
    include = sysconfig.get_paths()["include"]
    changed = 0
    for folder in CMAKE_FOLDERS:
        for path in (prefix / folder).rglob("*.cmake"):
            before = path.read_text(encoding="utf-8")
            after = patched(before, prefix=str(prefix), include=include)
            if after != before:
                # A new file in its place: the old one may be linked to the installer's cache.
                new = path.with_name(f"{path.name}.new")
                new.write_text(after, encoding="utf-8")
                new.replace(path)
                changed += 1
    return changed


def private_prefix(wheels: Path, prefix: Path) -> None:
    """Make `prefix` a patched prefix of the wheels in `wheels`: CMake files are copied, all else linked.

    There lib64 is another name of lib, as in an environment. Where pip builds it is a folder of its own.
    """
    (prefix / "lib").mkdir(parents=True)
    (prefix / "lib64").symlink_to("lib")
    folders = [wheels, wheels / "lib"]
    if (wheels / "lib64").is_dir() and not (wheels / "lib64").is_symlink():
        folders.append(wheels / "lib64")
    for entry in (entry for folder in folders for entry in folder.iterdir()):
        relative = entry.relative_to(wheels)
        if relative in CMAKE_FOLDERS:
            shutil.copytree(entry, prefix / relative)
        elif entry.name not in ("lib", "lib64"):
            (prefix / relative).symlink_to(entry)
    patch(prefix)


def main() -> int:
    """Patch the environment of the running interpreter and say how many files changed."""
    argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    ).parse_args()
    prefix = Path(sys.prefix)
    if not (prefix / "pyvenv.cfg").is_file():
        sys.stderr.write(f"patch_wheels: {prefix} is no virtual environment; use its own python\n")
        return 2
    sys.stdout.write(f"patch_wheels: {patch(prefix)} files changed\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
