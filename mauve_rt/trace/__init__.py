"""Execution traces: recording them as rosbags, reading them back, statistics.

    trace = mauve_rt.trace.open("bag")

Recording (`recorder`, `bag`, `mcap_file`, `cdr`, `definitions`) does without numpy: the executor stays
small. Reading (`reader`, `statistics`, `reconfigurations`) needs it, and no installed message package: a bag
carries the definitions of what it holds.
"""

from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, silent

if TYPE_CHECKING:
    from mauve_rt.trace.reading.trace import Trace

__all__ = ["TraceError", "open"]


def open(path: str | Path, *, progress: Progress = silent) -> "Trace":  # noqa: A001 - as gzip.open
    """Read the trace in a bag: a rosbag2 folder with MCAP files or sqlite3's, or one such file.

    Also of a recorder that runs. What a kill left half-written is left out, and told in `Trace.files`.

    Args:
        path: the bag.
        progress: told how far it is.

    Raises:
        TraceError: not a bag, a bag without a trace or with several executors', one of another version of
        mauve_rt, or one that cannot be read.

    """
    from mauve_rt.trace.reading.reader import open_trace  # noqa: PLC0415 - numpy takes its time to load

    return open_trace(path, progress=progress)
