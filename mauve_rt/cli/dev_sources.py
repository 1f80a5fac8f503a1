"""The source files below folders, and their changes, by polling."""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.errors import ParameterError

POLL_S = 0.2
"""Between two scans. A save is complete when two scans in a row find the same files."""
_IDLE_SHARE = 10  # scans of a large tree take at most a tenth of the time of one CPU
_SUFFIXES_OF_C = (".c", ".cc", ".cpp", ".cxx", ".h", ".hh", ".hpp", ".hxx", ".inl", ".ipp", ".tpp")
_SUFFIXES = (*_SUFFIXES_OF_C, ".py", ".txt", ".cmake")
_NAMES = ("package.xml",)
_FOLDERS_OF_BUILDS = ("build", "install", "log", "__pycache__")
_MARKS_OF_BUILDS = ("COLCON_IGNORE", "CMakeCache.txt")
Stamp = tuple[int, int, int]  # modification time, size, inode: editors write in place, or rename a new file


class Save(NamedTuple):
    """Files that were written, added or removed."""

    files: tuple[Path, ...]
    saved_s: float
    """Time of the last of these writes, by time.monotonic()."""


class Sources:
    """Polls the stamps of files.

    inotify reports nothing of network file systems, and misses files in folders that are new. A scan of 1000
    files takes some milliseconds.
    """

    def __init__(self, paths: Sequence[Path], *, clock: Callable[[], float] = time.monotonic) -> None:
        """`paths`: files, or folders whose sources are watched.

        Raises:
            ParameterError: a path does not exist.
        """
        for path in paths:
            if not path.exists():
                raise ParameterError(
                    f"--watch {path}: expected a file or folder, found nothing. Correct the path."
                )
        self._paths = [*paths]
        self._clock = clock
        self._known = self._scan()
        self._seen = self._known
        self._is_settling = False
        self._due_s = clock() + POLL_S
        self._changed_s = clock()

    @property
    def count(self) -> int:
        """Files that are watched."""
        return len(self._known)

    def look(self) -> Save | None:
        """The files that changed, once, when the save is complete. Scans when a scan is due."""
        begun_s = self._clock()
        if begun_s < self._due_s:
            return None
        stamps = self._scan()
        now_s = self._clock()
        self._due_s = begun_s + max(POLL_S, _IDLE_SHARE * (now_s - begun_s))
        if stamps != self._seen:
            self._seen, self._is_settling, self._changed_s = stamps, True, now_s
            return None
        if not self._is_settling:
            return None
        self._is_settling = False
        before, self._known = self._known, stamps
        files = [path for path in {**before, **stamps} if before.get(path) != stamps.get(path)]
        if not files:
            return None  # written, and put back
        return Save(tuple(Path(path) for path in sorted(files)), self._saved_s(files, now_s))

    def forget(self) -> None:
        """Take the present files as known: a build that starts now has them."""
        self._known = self._seen = self._scan()
        self._is_settling = False

    def _saved_s(self, files: Sequence[str], now_s: float) -> float:
        """Time of the last write; of a removed file, the time of the scan that missed the file."""
        written_ns = max((self._known[path][0] for path in files if path in self._known), default=0)
        age_s = (time.time_ns() - written_ns) / 1e9
        return now_s - age_s if 0 <= age_s <= now_s - self._changed_s + 2 * POLL_S else self._changed_s

    def _scan(self) -> dict[str, Stamp]:
        found: dict[str, Stamp] = {}
        for path in self._paths:
            if path.is_dir():
                found.update(_stamps(str(path), set()))
            elif path.exists():
                found[str(path)] = _stamp(path.stat())
        return found


def _stamps(folder: str, scanned: set[tuple[int, int]]) -> Iterator[tuple[str, Stamp]]:
    """Links are followed: a package in src/ may be one. `scanned`: each folder is scanned once."""
    try:
        status = Path(folder).stat()
        if (status.st_dev, status.st_ino) in scanned:
            return
        scanned.add((status.st_dev, status.st_ino))
        with os.scandir(folder) as entries:
            listed = [*entries]
    except OSError:
        return  # removed since
    for entry in listed:
        if entry.name.startswith("."):
            continue
        try:
            if entry.is_dir():
                if entry.name not in _FOLDERS_OF_BUILDS and not _is_of_build(entry.path):
                    yield from _stamps(entry.path, scanned)
            elif entry.name.endswith(_SUFFIXES) or entry.name in _NAMES:
                yield entry.path, _stamp(entry.stat())
        except OSError:
            continue


def _is_of_build(folder: str) -> bool:
    return any(os.path.lexists(f"{folder}/{mark}") for mark in _MARKS_OF_BUILDS)


def _stamp(status: os.stat_result) -> Stamp:
    return status.st_mtime_ns, status.st_size, status.st_ino
