"""A trace as CSV files, one for each kind of thing that happened, for spreadsheets and other programs."""

import math
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path

import pandas as pd

from mauve_rt.trace.export.output import new_folder
from mauve_rt.trace.export.topic_files import export_topics
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.trace.reading import frames
from mauve_rt.trace.reading.statistics import ComponentStatistics, Distribution, all_statistics
from mauve_rt.trace.reading.trace import Trace

_FRAMES: dict[str, Callable[[Trace], pd.DataFrame]] = {
    "deployments": frames.deployments,
    "releases": frames.releases,
    "states": frames.states,
    "overruns": frames.overruns,
    "reconfigurations": frames.reconfigurations,
    "services": frames.services,
    "contention": frames.contention,
    "marks": frames.marks,
    "decisions": frames.decisions,
    "shadows": frames.shadows,
    "output_curves": frames.output_curves,
    "records": frames.records,
}
_ROWS_AT_ONCE = 100_000


def export_csv(trace: Trace, folder: Path, *, force: bool = False, progress: Progress = silent) -> list[str]:
    """Write a folder of CSV files, UTF-8, with a header row each that names the units.

    The columns are those of `mauve_rt.trace.reading.frames`; kinds of records that are newer than this reader
    have a file each, named by the bag. components.csv counts, and statistics.csv has the distributions of
    `mauve_rt.trace.reading.statistics`. What is not known is an empty field. Each topic that was recorded has
    a file; returns which of these are left out (`export_topics`).

    Raises:
        TraceError: the folder exists already (unless `force`), or cannot be written.

    """
    with new_folder(folder, force=force) as place:
        all_frames = _FRAMES | _newer_frames(trace)
        works = len(all_frames) + 2
        for done, (name, frame_of) in enumerate(all_frames.items()):
            of_one = part(progress, done / works, (done + 1) / works)
            _write_parts(frame_of(trace), place / f"{name}.csv", of_one)
        problems = export_topics(trace, place, progress=part(progress, 1 - 2 / works, 1 - 1 / works))
        statistics = all_statistics(trace, progress=part(progress, 1 - 1 / works, 1))
        _write(_counts(statistics), place / "components.csv")
        _write(_distributions(statistics), place / "statistics.csv")
        progress(1, "statistics.csv")
    return problems


def _newer_frames(trace: Trace) -> dict[str, Callable[[Trace], pd.DataFrame]]:
    newer = sorted(set(trace.kinds) - set(Kind))
    names = {kind: trace.kinds[kind].name for kind in newer}
    taken = {*_FRAMES, "components", "statistics"}
    files = {kind: f"{name}_records" if name in taken else name for kind, name in names.items()}
    return {files[kind]: partial(frames.of_kind, kind=kind) for kind in newer}


def _write_parts(frame: pd.DataFrame, path: Path, progress: Progress) -> None:
    parts = max(1, math.ceil(len(frame) / _ROWS_AT_ONCE))
    for index in range(parts):
        rows = frame.iloc[index * _ROWS_AT_ONCE : (index + 1) * _ROWS_AT_ONCE]
        _write(rows, path, header=index == 0)
        progress((index + 1) / parts, path.name)


def _write(frame: pd.DataFrame, path: Path, *, header: bool = True) -> None:
    frame.to_csv(
        path,
        mode="w" if header else "a",
        header=header,
        index=False,
        encoding="utf-8",
        errors="backslashreplace",  # a name that is no Unicode text, of a bag that is not ours
    )


def _counts(statistics: dict[str, ComponentStatistics]) -> pd.DataFrame:
    counts = ("releases", "overruns", "skipped", "faults", "lost_records")
    names = ("component", "period_ns", "duration_ns", "load", *counts)
    return pd.DataFrame({name: [getattr(one, name) for one in statistics.values()] for name in names})


def _distributions(statistics: dict[str, ComponentStatistics]) -> pd.DataFrame:
    rows: list[dict[str, object]] = []

    def add(component: str, figure: str, of: str, found: Distribution) -> None:
        rows.append({"component": component, "figure": figure, "of": of, **asdict(found)})

    for component, one in statistics.items():
        for figure in ("wakeup", "response", "phase_error"):
            add(component, figure, "", getattr(one, figure))
        for figure in ("execution", "services", "contention"):
            for of, found in getattr(one, figure).items():
                add(component, figure, of, found)
    columns = ["component", "figure", "of", *Distribution.__dataclass_fields__]
    return pd.DataFrame(rows, columns=columns)
