"""Bags of any number of records, made quickly: periodic components with one state."""

from pathlib import Path

import numpy as np

from mauve_rt.trace.bag.recorded import SentMessage, Split
from mauve_rt.trace.format.records import RECORD, Kind, Records
from mauve_rt.trace.recording.sources import Drained
from mauve_rt.trace.recording.trace_bag import TraceBag

COMPONENTS = ("control", "guidance", "mapping", "planner", "watch")
_NAMES = ["", "Work", "Rest"]
_PERIOD_NS = 1_000_000
_CYCLE = (Kind.RELEASE, Kind.STATE_BEGIN, Kind.STATE_END, Kind.WAIT)
_FLUSH_NS = 100_000_000
_TYPE, _DEFINITION, _HEAD = "bench_msgs/msg/Pose", "float64 x\nfloat64 y\n", bytes([0, 1, 0, 0])
_REALTIME_NS = 1_700_000_000_000_000_000


class _Words:
    """The words of the records."""

    def trace_components(self) -> list[str]:
        return list(COMPONENTS)

    def trace_names(self) -> list[str]:
        return _NAMES


def make_bag(path: Path, records: int, *, topics: int = 0) -> Path:
    """Write a bag of about so many records: 1 kHz, some tens of us of latency, 200 us of work.

    Each of the topics has a message of two numbers at each instant.
    """
    random = np.random.default_rng(1)
    cycles = records // (len(COMPONENTS) * len(_CYCLE))
    per_flush = _FLUSH_NS // _PERIOD_NS
    bag = TraceBag(_Words(), path, node_name="/executor", on_error=_raise, split=Split())
    written = 0
    for first in range(0, cycles, per_flush):
        instants = _PERIOD_NS * (1 + np.arange(first, min(first + per_flush, cycles), dtype=np.int64))
        parts = [_cycles(component, written, instants, random) for component in range(len(COMPONENTS))]
        written += len(parts[0])
        now_ns = int(instants[-1]) + _PERIOD_NS
        counts = [written] * len(COMPONENTS)
        data = b"".join(part.tobytes() for part in parts)
        none = [0] * len(COMPONENTS)
        messages = [
            SentMessage(f"/pose_{topic}", _TYPE, _HEAD + two.tobytes(), int(instant_ns), None, _DEFINITION)
            for topic in range(topics)
            for instant_ns, two in zip(instants, random.normal(size=(len(instants), 2)), strict=True)
        ]
        bag.write(Drained(data, counts, none, now_ns, now_ns + _REALTIME_NS), messages, whole=True)
        bag.flush()
    bag.close()
    return path


def _cycles(component: int, sequence: int, instants: np.ndarray, random: np.random.Generator) -> Records:
    rows = np.zeros((len(instants), len(_CYCLE)), RECORD)
    actual = instants + random.gamma(2.0, 10_000, len(instants)).astype(np.int64)
    done = actual + random.gamma(20.0, 10_000, len(instants)).astype(np.int64)
    rows["kind"] = _CYCLE
    rows["component"] = component
    rows["time_ns"] = np.stack([actual, actual, done, done], axis=1)
    rows["name"] = (2, 1, 1, 2)
    rows["a"][:, 0], rows["b"][:, 0], rows["a"][:, 3] = instants, actual, instants + _PERIOD_NS
    flat = rows.reshape(-1)
    flat["sequence"] = np.arange(sequence, sequence + len(flat))
    return flat


def _raise(text: str) -> None:
    raise RuntimeError(text)
