"""Files made beside and renamed into place: whoever looks sees all of one, or nothing."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mauve_rt.trace.errors import TraceError


@contextmanager
def new_file(path: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield where to write; at the end that becomes the file, after an exception nothing of it stays.

    Raises:
        TraceError: something is there already (a file, with `force`, is replaced), or the system refuses.

    """
    with _unfinished(path, force=force, taken=path.is_dir()) as place:
        yield place
        place.replace(path)


@contextmanager
def new_folder(path: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder to write into; at the end it becomes the one asked for.

    With `force` its files go into a folder that is there already, in place of those of the same names.

    Raises:
        TraceError: as new_file.

    """
    with _unfinished(path, force=force, taken=path.exists() and not path.is_dir()) as place:
        place.mkdir()
        yield place
        if path.exists():
            for file in place.iterdir():
                file.replace(path / file.name)
        else:
            place.rename(path)


@contextmanager
def _unfinished(path: Path, *, force: bool, taken: bool) -> Iterator[Path]:
    if path.exists() and (taken or not force):
        remedy = "choose another name" if taken else "remove it, replace it by --force or choose another name"
        what = "a folder" if path.is_dir() else "a file"
        raise TraceError(f"{path}: {what} of this name exists already; {remedy} (--out)")
    place = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield place
    except OSError as error:
        raise TraceError(
            f"{path}: cannot be written ({error.strerror}); choose another place (--out)"
        ) from error
    finally:
        if place.is_dir():
            shutil.rmtree(place, ignore_errors=True)
        else:
            place.unlink(missing_ok=True)
