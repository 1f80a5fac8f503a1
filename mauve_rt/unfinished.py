"""Names for files that get their own name once they are finished, and the removal of those that are not."""

import contextlib
import os
from pathlib import Path


def beside(path: Path) -> Path:
    """A name in the folder of `path` that no other call gives, in whatever process or container."""
    return path.with_name(f".{path.name}.{os.getpid()}_{os.urandom(8).hex()}")


def discard(path: Path) -> None:
    """Delete a file that is not needed, if there is one and the system allows it.

    For use after another error, which is the one to report: a read-only file system refuses to delete even a
    file that does not exist.
    """
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
