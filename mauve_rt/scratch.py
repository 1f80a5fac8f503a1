"""Folders for temporary files: which there are, and whether files can be written there.

The module tempfile would take 0.9 MB of an executor's memory, with all that it imports.
"""

import os
from collections.abc import Iterator
from pathlib import Path

_FOLDERS = ("/tmp", "/var/tmp", "/dev/shm")  # noqa: S108 - names below cannot be guessed, or the owner is checked
_PROBE_BYTES = 4096  # a page: a full tmpfs creates empty files still


def scratch_folders() -> Iterator[Path]:
    """The folders for temporary files, in the order in which a program tries them."""
    given = (os.environ.get("TMPDIR"), *_FOLDERS, os.environ.get("XDG_RUNTIME_DIR"))
    yield from dict.fromkeys(Path(folder).absolute() for folder in given if folder)


def code_folder() -> tuple[Path | None, str]:
    """The first folder where this account can write and load libraries, and why none before it was taken.

    HOME is the last one: /tmp, /var/tmp and /dev/shm are mounted with noexec together.
    """
    reasons: list[str] = []
    home = os.environ.get("HOME")
    for folder in (*scratch_folders(), *([Path(home).absolute()] if home else [])):
        reason = _no_folder_for_code(folder)
        if not reason:
            return folder, "; ".join(reasons)
        reasons.append(f"{folder}: {reason}")
    return None, "; ".join(reasons)


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


def _no_folder_for_code(folder: Path) -> str:
    try:
        if os.statvfs(folder).f_flag & os.ST_NOEXEC:
            return "mounted with noexec"
    except OSError as error:
        return error.strerror or str(error)
    return unwritable(folder)


def _nameless_file(folder: Path) -> int:
    """The descriptor of a new file."""
    path = folder / f".mauve_rt_{os.getpid()}_{os.urandom(8).hex()}"
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    path.unlink()
    return descriptor
