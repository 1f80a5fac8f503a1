"""Which files a bag consists of."""

from pathlib import Path

from mauve_rt.trace.errors import TraceError

MCAP, SQLITE = ".mcap", ".db3"
SUFFIXES = (MCAP, SQLITE)
"""Of the files of a bag; where a folder has both, the first counts."""


def bag_files(path: Path) -> list[Path]:
    """Return the files of a bag in their order: MCAP files, or sqlite3's.

    Raises:
        TraceError: there is none; says what is there instead.

    """
    if path.is_file() and path.suffix in SUFFIXES:
        return [path]
    for suffix in SUFFIXES if path.is_dir() else ():
        if found := list(path.glob(f"*{suffix}")):
            return sorted(found, key=lambda file: (len(file.name), file.name))
    msg = f"bag {path}: expected a rosbag2 folder with MCAP files; {_instead(path)}"
    raise TraceError(msg)


def is_bag_folder(path: Path) -> bool:
    """Whether a folder holds files of a bag."""
    return path.is_dir() and any(file.suffix in SUFFIXES for file in path.iterdir())


def is_sqlite(path: Path) -> bool:
    """Whether a bag's storage is sqlite3.

    Raises:
        TraceError: it is no bag.

    """
    return bag_files(path)[0].suffix == SQLITE


def _instead(path: Path) -> str:
    if path.is_dir():
        if any(path.glob("*.zstd")):
            return "its files are compressed whole: `ros2 bag convert` makes an MCAP bag of it"
        return "no .mcap file in it"
    if not path.exists():
        return "not there"
    return "not a folder"
