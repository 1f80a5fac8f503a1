"""What of the installed code this process has loaded, and whether it is still what the disk has.

A library is never closed and a module never imported again: a rebuilt one runs from the next start of the
process on. Until then whoever asks for it is told so, instead of getting the old code under its name.
"""

import sys
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

REMEDY = "start the executor again, or install the new code under another name"


class Stamp(NamedTuple):
    """By which a file that was written anew is told from the one before: by a look, or by its contents."""

    device: int
    inode: int
    size: int
    modified_ns: int

    @classmethod
    def of(cls, file: Path) -> "Stamp | None":
        """That of a file; None where there is none."""
        try:
            found = file.stat()
        except OSError:
            return None
        return cls(found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)


@dataclass
class _Loaded:
    stamp: Stamp | None
    digest: int


class LoadedCode:
    """Files that were loaded, as they were then. Not thread-safe: for who holds the registry."""

    def __init__(self) -> None:
        self._files: dict[Path, _Loaded] = {}
        self._sources: dict[str, tuple[Path, ...]] = {}

    def note(self, target: str, files: Iterable[Path]) -> None:
        """`target` (a library or module) is about to be loaded, or was just now, from these files."""
        self._sources[target] = tuple(files)
        for file in self._sources[target]:
            if file not in self._files:
                self._files[file] = _Loaded(Stamp.of(file), _digest(file))

    def change_of(self, target: str) -> str:
        """Which file of a loaded library or module is another one by now, in words; empty: none."""
        for file in self._sources.get(target, ()):
            loaded, stamp = self._files[file], Stamp.of(file)
            if stamp == loaded.stamp:
                continue
            if stamp is None or _digest(file) != loaded.digest:
                what = "is gone" if stamp is None else "was changed"
                return f"{file} {what} since this process loaded it, which would run the old code"
            loaded.stamp = stamp  # written anew, with the same contents
        return ""


def module_files(module: str) -> list[Path]:
    """The files of a module that is loaded, and of all that is loaded of its package."""
    package = module.partition(".")[0]
    names = [name for name in sys.modules if name == package or name.startswith(f"{package}.")]
    files = (getattr(sys.modules[name], "__file__", None) for name in names)
    return sorted(Path(file) for file in files if file)


def _digest(file: Path) -> int:
    """Of the contents: enough to tell a rebuilt file from one that was installed again as it was."""
    try:
        return zlib.crc32(file.read_bytes())
    except OSError:
        return 0
