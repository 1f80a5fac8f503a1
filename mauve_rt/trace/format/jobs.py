"""Records as jobs: what each component executed from the end of one wait to the next wait."""

from collections.abc import Iterator, Sequence

import numpy as np

from mauve_rt.analysis.excess import Interval, TracedJob
from mauve_rt.trace.format.records import RECORD, Kind


def traced_jobs(records: bytes, components: Sequence[str], names: Sequence[str]) -> Iterator[TracedJob]:
    """The jobs of these records; of one that lasts on, the part that they have.

    Args:
        records: in the layout of mauve_msgs/msg/TraceRecord.
        components: by the numbers in records.
        names: of states, waits and resources, by the numbers in records.

    """
    rows = np.frombuffer(records, RECORD)
    for number in np.unique(rows["component"]):
        own = rows[rows["component"] == number]
        job: TracedJob | None = None
        free_ns = begun_ns = 0
        for row in own.tolist():
            _, time_ns, a, b, _, name, kind, _ = row
            if kind == Kind.RELEASE:
                job = TracedJob(components[number], names[name], a, max(a, free_ns), b, b)
            elif job is None:
                continue
            elif kind == Kind.STATE_BEGIN:
                begun_ns = time_ns
            elif kind == Kind.STATE_END:
                job.executions.append((names[name], Interval(begun_ns, time_ns)))
            elif kind == Kind.CONTENDED:
                job.lock_waits.append((names[name], Interval(time_ns - b, time_ns)))
            elif kind in (Kind.WAIT, Kind.STOP, Kind.FAULT):
                job.end_ns = free_ns = time_ns
                yield job
                job = None
        if job is not None:
            job.end_ns = int(rows["time_ns"].max())
            yield job
