"""What of the installed code this process has loaded, and whether it is still what the disk has.

A library is never closed, and a module never imported again under its name: rebuilt code is loaded as another
generation (`generations`). Until then a request for it is refused, and does not get the old code.
"""

import time
import zlib
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

REMEDY = "load it by `mauve reload`, start the executor again, or install the new code under another name"


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
        self._noted_ns: dict[str, int] = {}

    def note(self, target: str, files: Iterable[Path]) -> None:
        """`target` (a library or module) is about to be loaded, or was just now, from these files."""
        self._sources[target] = tuple(files)
        self._noted_ns[target] = time.time_ns()
        for file in self._sources[target]:
            if file not in self._files:
                self._files[file] = _Loaded(Stamp.of(file), _digest(file))

    def renew(self, stamps: "Stamps") -> None:
        """These files were loaded again, as they were at that moment."""
        self._files.update(stamps.files)

    def sources(self) -> list[str]:
        """All libraries and modules that were loaded."""
        return list(self._sources)

    def change_of(self, target: str) -> str:
        """Which file of a loaded library or module is another one by now, in words; empty: none."""
        for file in self.changed_files(target):
            what = "was changed" if file.exists() else "is gone"
            return f"{file} {what} since this process loaded it, which would run the old code"
        return ""

    def changed_files(self, target: str, others: Iterable[Path] = ()) -> list[Path]:
        """Files of a loaded library or module, and `others` that it needs, that are others by now."""
        files = dict.fromkeys((*self._sources.get(target, ()), *others))
        return [file for file in files if self._is_changed(file, self._noted_ns.get(target, 0))]

    def is_changed(self, file: Path) -> bool:
        """Whether a library that the loader opened for another one is another file by now."""
        return self._is_changed(file, min(self._noted_ns.values(), default=0))

    def built_ns(self, target: str) -> int:
        """When the newest file that was loaded for a target was written; ns since 1970, 0: not known."""
        stamps = (self._files[file].stamp for file in self._sources.get(target, ()))
        return max((stamp.modified_ns for stamp in stamps if stamp is not None), default=0)

    def _is_changed(self, file: Path, noted_ns: int) -> bool:
        loaded, stamp = self._files.get(file), Stamp.of(file)
        if loaded is None:  # a library that the loader opened for another one
            return stamp is None or stamp.modified_ns > noted_ns or stamp.inode not in _mapped_inodes(file)
        if stamp == loaded.stamp:
            return False
        if stamp is None or _digest(file) != loaded.digest:
            return True
        loaded.stamp = stamp  # written anew, with the same contents
        return False


class Stamps:
    """Files as they are at this moment."""

    def __init__(self, files: Collection[Path]) -> None:
        self.files = {file: _Loaded(Stamp.of(file), _digest(file)) for file in files}


def _mapped_inodes(file: Path) -> set[int]:
    lines = Path("/proc/self/maps").read_text(errors="surrogateescape").splitlines()
    rows = (line.split(maxsplit=5) for line in lines)
    return {int(row[4]) for row in rows if len(row) > 5 and row[5] == str(file)}  # noqa: PLR2004 - the path


def _digest(file: Path) -> int:
    """Of the contents: enough to tell a rebuilt file from one that was installed again as it was."""
    try:
        return zlib.crc32(file.read_bytes())
    except OSError:
        return 0
