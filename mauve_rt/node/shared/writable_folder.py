"""Whether files can be written in a folder: asked before a start depends on it."""

import os
from pathlib import Path

_PROBE_BYTES = 4096  # a page: a full tmpfs creates empty files still


def unwritable(folder: Path) -> str:
    """Why no file can be written in a folder, as the system says it; "" where one can.

    Where the folder does not exist, the nearest one above it decides. Nothing is left behind.
    """
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    try:
        with open(_nameless_file(folder), "wb", buffering=0) as file:
            if file.write(bytes(_PROBE_BYTES)) != _PROBE_BYTES:
                return "No space left on device"
    except OSError as error:
        return error.strerror or str(error)
    return ""


def _nameless_file(folder: Path) -> int:
    """The descriptor of a new file. The module tempfile would take 0.9 MB, with all that it imports."""
    path = folder / f".mauve_rt_{os.getpid()}_{os.urandom(8).hex()}"
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    path.unlink()
    return descriptor
