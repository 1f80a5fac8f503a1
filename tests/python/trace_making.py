"""Traces in memory from records written by hand."""

import numpy as np

from mauve_rt.trace.records import RECORD
from mauve_rt.trace.synthetic import SyntheticSource
from mauve_rt.trace.trace import Loss, Message, Trace


def trace_of(source: SyntheticSource, messages: tuple[Message, ...] = ()) -> Trace:
    """What the source has been given since the last time."""
    drain = source.drain_trace()
    everything = np.frombuffer(drain.records, RECORD)
    records, losses = {}, {}
    for index, name in enumerate(source.components):
        rows = records[name] = everything[everything["component"] == index]
        losses[name] = Loss(drain.written[index], len(rows), drain.dropped[index], drain.dropped[index])
    pairs = np.array([(drain.monotonic_ns, drain.realtime_ns)], np.int64)
    return Trace(records, tuple(source.trace_names()), losses, pairs, lambda _: iter(messages))
