"""A finished copy of a bag that is being written.

Other readers read the end of a file and then its messages. While a recorder writes, the end moves between the
two. A copy stands still. All that was flushed before the copy began is in it.
"""

import shutil
from pathlib import Path

from mauve_rt.trace.bag.files import bag_files, is_sqlite
from mauve_rt.trace.bag.mcap_repair import examine
from mauve_rt.trace.bag.repair import BagState, examine_bag, repair_bag
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.unfinished import beside, discard

_TRIES = 5  # to copy a file between two writes; a copy across a write is repaired


def snapshot_bag(bag: Path, out: Path, *, progress: Progress = silent) -> BagState:
    """Copy a bag into the folder `out`, which must not exist yet; returns what the copy holds.

    Raises:
        TraceError: it is no MCAP bag, or `out` exists or cannot be written.

    """
    if is_sqlite(bag):
        msg = f"bag {bag}: its storage is sqlite3; expected MCAP. Copy the folder when nothing writes it"
        raise TraceError(msg)
    if out.exists():
        msg = f"bag folder {out}: exists already; remove it or choose another name"
        raise TraceError(msg)
    files = bag_files(bag)
    unfinished = beside(out)
    try:
        unfinished.mkdir(parents=True)
        for number, file in enumerate(files):
            _copy(file, unfinished / file.name)
            progress((number + 1) / len(files) / 2, "copying")
        repair_bag(examine_bag(unfinished, progress=part(progress, 0.5, 1.0)))
        state = examine_bag(unfinished)
        unfinished.rename(out)
    except OSError as error:
        msg = (
            f"bag folder {out}: cannot be written ({error.strerror}); free some space or choose another place"
        )
        raise TraceError(msg) from error
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
    return state


def _copy(file: Path, to: Path) -> None:
    for _ in range(_TRIES):
        try:
            shutil.copyfile(file, to)
        except FileNotFoundError:
            if to.parent.exists() and file.parent.exists():  # deleted for the size of the bag
                discard(to)
                return
            raise
        if examine(to).is_finished:
            return
