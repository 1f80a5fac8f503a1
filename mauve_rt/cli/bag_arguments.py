"""Bags as they are named on a command line: also by the folder that holds those of a run, one per robot."""

from collections.abc import Iterable
from pathlib import Path

from mauve_rt.trace.bag.files import is_bag_folder
from mauve_rt.trace.errors import TraceError


def bags_in(path: Path) -> list[Path]:
    """Return the bags right below a folder that is none itself, by name; where there are none, the path."""
    if not path.is_dir() or is_bag_folder(path):
        return [path]
    return sorted(filter(is_bag_folder, path.iterdir())) or [path]


def all_bags(paths: Iterable[Path]) -> list[Path]:
    """Return every bag that is meant, for a verb that takes several."""
    return [bag for path in paths for bag in bags_in(path)]


def one_bag(path: Path) -> Path:
    """Return the bag that is meant, for a verb that takes one.

    Raises:
        TraceError: the folder holds several.

    """
    bags = bags_in(path)
    if len(bags) > 1:
        found = ", ".join(map(str, bags))
        raise TraceError(f"bag {path}: expected one bag, found a folder of {len(bags)}; name one of {found}")
    return bags[0]


def is_bag(path: Path) -> bool:
    """Tell whether a bag is meant rather than another file."""
    return path.is_dir() or path.suffix in (".mcap", ".db3")
