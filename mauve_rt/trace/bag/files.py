"""Which files a bag consists of: what metadata.yaml names, and what its recorder begins or deletes."""

import re
from collections.abc import Sequence
from pathlib import Path

from mauve_rt.trace.errors import TraceError

MCAP, SQLITE = ".mcap", ".db3"
SUFFIXES = (MCAP, SQLITE)
"""Of the files of a bag; where a folder has both, the first counts."""
_NUMBERED = re.compile(r"(.*)_(\d+)")


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag in their order: MCAP files, or sqlite3's.

    Other files may lie in the folder, such as the copy that `mcap compress` writes. Where metadata.yaml names
    none of those that are there, all are of the bag.

    Raises:
        TraceError: there is none; says what is there instead.

    """
    return own_and_other_files(path)[0]


def own_and_other_files(path: Path) -> tuple[list[Path], list[Path]]:
    """As bag_files(); and the files in its folder that look like files of a bag, and are none of this one."""
    found = _found(path)
    if path.is_dir() and (own := _own(path, found)):
        kept = {*own}
        return own, [file for file in found if file not in kept]
    return found, []


def _found(path: Path) -> list[Path]:
    """The file itself, or all files in the folder of the first kind that is there."""
    if path.is_file() and path.suffix in SUFFIXES:
        return [path]
    for suffix in SUFFIXES if path.is_dir() else ():
        if found := list(path.glob(f"*{suffix}")):
            return sorted(found, key=lambda file: (len(file.name), file.name))
    msg = f"bag {path}: expected a rosbag2 folder with MCAP files; {_instead(path)}"
    raise TraceError(msg)


def _own(path: Path, found: Sequence[Path]) -> list[Path]:
    """Files that are named, the next one, not named yet, and older ones, named no longer."""
    # Here: each verb of `mauve` imports this module, and few read a bag.
    from mauve_rt.trace.bag.read_metadata import file_names, read_metadata  # noqa: PLC0415

    try:
        names = {*file_names(read_metadata(path))}
    except TraceError:
        return []
    numbers: dict[str, list[int]] = {}
    for name in names:
        if match := _NUMBERED.fullmatch(Path(name).stem):
            numbers.setdefault(match[1], []).append(int(match[2]))

    def is_own(file: Path) -> bool:
        if file.name in names:
            return True
        match = _NUMBERED.fullmatch(file.stem)
        if match is None or match[1] not in numbers:
            return False
        named = numbers[match[1]]
        return int(match[2]) == max(named) + 1 or int(match[2]) < min(named)

    return [file for file in found if is_own(file)]


def is_bag_folder(path: Path) -> bool:
    """Whether a folder holds files of a bag."""
    return path.is_dir() and any(file.suffix in SUFFIXES for file in path.iterdir())


def is_sqlite(path: Path) -> bool:
    """Whether a bag's storage is sqlite3.

    Raises:
        TraceError: it is no bag.

    """
    return _found(path)[0].suffix == SQLITE


def _instead(path: Path) -> str:
    if path.is_dir():
        if any(path.glob("*.zstd")):
            return "its files are compressed whole: `ros2 bag convert` makes an MCAP bag of it"
        return "no .mcap file in it"
    if not path.exists():
        return "not there"
    return "not a folder"
