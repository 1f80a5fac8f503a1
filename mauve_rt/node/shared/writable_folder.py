"""Whether files can be written in a folder: asked before a start depends on it."""

import os
import tempfile
from pathlib import Path

_PROBE_BYTES = 4096  # a page: a full tmpfs creates empty files still


def unwritable(folder: Path) -> str:
    """Why no file can be written in a folder, as the system says it; "" where one can.

    Where the folder does not exist, the nearest one above it decides. Nothing is left behind.
    """
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    try:
        with tempfile.TemporaryFile(dir=folder, buffering=0) as file:
            if file.write(bytes(_PROBE_BYTES)) != _PROBE_BYTES:
                return "No space left on device"
    except OSError as error:
        return error.strerror or str(error)
    return ""
