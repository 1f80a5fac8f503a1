"""Several bags of one run as one trace."""

from collections.abc import Sequence
from pathlib import Path

import mauve_rt.trace
from mauve_rt.trace.bag.files import SUFFIXES
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.trace.reading.trace import Trace, merge_traces


def open_bags(paths: Sequence[Path], *, progress: Progress = silent) -> Trace:
    """Read bags; components of several are named <bag>/<component>.

    Raises:
        TraceError: one cannot be read, one is named twice, or they are of different machines or boots.

    """
    names = bag_names(paths)
    traces = {}
    for index, (name, path) in enumerate(zip(names, paths, strict=True)):
        of_one = part(progress, index / len(paths), (index + 1) / len(paths))
        traces[name] = mauve_rt.trace.open(path, progress=of_one)
    return traces[names[0]] if len(traces) == 1 else merge_traces(traces)


def bag_names(paths: Sequence[Path]) -> list[str]:
    """Return a name for each bag: its folder's or file's, with what of the path tells them apart.

    Raises:
        TraceError: a bag is named twice.

    """
    resolved = [path.resolve() for path in paths]
    if len(set(resolved)) < len(resolved):
        twice = next(path for path in resolved if resolved.count(path) > 1)
        msg = f"bag {twice}: named twice; each bag of a run is wanted once"
        raise TraceError(msg)
    parts = [path.with_suffix("").parts if path.suffix in SUFFIXES else path.parts for path in resolved]
    longest = max(map(len, parts))
    candidates = (["_".join(one[-count:]) for one in parts] for count in range(1, longest + 1))
    return next(names for names in candidates if len(set(names)) == len(names))
