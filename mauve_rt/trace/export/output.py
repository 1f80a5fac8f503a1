"""Files made beside and renamed into place: whoever looks sees all of one, or nothing."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mauve_rt.trace.errors import TraceError
from mauve_rt.unfinished import beside, discard


@contextmanager
def new_file(path: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield where to write; at the end that becomes the file, after an exception nothing of it stays.

    Raises:
        TraceError: something is there already (a file, with `force`, is replaced), or the system refuses.

    """
    with _unfinished(path, force=force, folder=False) as place:
        yield place
        place.replace(path)


@contextmanager
def new_folder(path: Path, *, force: bool = False) -> Iterator[Path]:
    """Yield an empty folder to write into; at the end it becomes the one asked for.

    With `force` its files go into a folder that is there already, in place of those of the same names.

    Raises:
        TraceError: as new_file.

    """
    with _unfinished(path, force=force, folder=True) as place:
        place.mkdir()
        yield place
        if path.exists():
            for file in place.iterdir():
                file.replace(path / file.name)
        else:
            place.rename(path)


@contextmanager
def _unfinished(path: Path, *, force: bool, folder: bool) -> Iterator[Path]:
    try:
        whole = path.resolve()  # "." has no name
        if path.exists():
            _check_replaceable(path, force=force, folder=folder)
        place = beside(whole)
        try:
            yield place
        finally:
            if place.is_dir():
                shutil.rmtree(place, ignore_errors=True)
            else:
                discard(place)
    except OSError as error:
        raise TraceError(
            f"{path}: cannot be written ({error.strerror}); choose another place (--out)"
        ) from error


def _check_replaceable(path: Path, *, force: bool, folder: bool) -> None:
    fits = path.is_dir() == folder and bool(path.resolve().name)
    if fits and force:
        return
    what = "a folder" if path.is_dir() else "a file"
    remedy = "remove it, replace it by --force or choose another name" if fits else "choose another name"
    raise TraceError(f"{path}: {what} of this name exists already; {remedy} (--out)")
