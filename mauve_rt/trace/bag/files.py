"""Which files a bag consists of."""

from pathlib import Path

from mauve_rt.trace.errors import TraceError


def bag_files(path: Path) -> list[Path]:
    """Return the MCAP files of a bag in their order.

    Raises:
        TraceError: there is none; says what is there instead.

    """
    if path.is_file() and path.suffix == ".mcap":
        return [path]
    found = sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name)) if path.is_dir() else []
    if not found:
        msg = f"bag {path}: expected a rosbag2 folder with MCAP files; {_instead(path)}"
        raise TraceError(msg)
    return found


def _instead(path: Path) -> str:
    if path.is_dir():
        if any(path.glob("*.db3")):
            return "its storage is sqlite3: `ros2 bag convert` makes an MCAP bag of it"
        return "no .mcap file in it"
    if not path.exists():
        return "not there"
    return "not a folder"
