"""Traces of components that never ran, as their reader gives them."""

import shutil
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mauve_rt.trace.bag.recorded import Split
from mauve_rt.trace.format.kinds import kinds_told
from mauve_rt.trace.format.records import RECORD, Kind, Records
from mauve_rt.trace.reading.facts import Loss, Message
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource
from mauve_rt.trace.recording.trace_bag import TraceBag

ROOT = next(folder for folder in Path(__file__).parents if (folder / "mauve_msgs").is_dir())
TABLE = (ROOT / "mauve_msgs" / "msg" / "TraceRecord.msg").read_text(encoding="utf-8")
MS = 1_000_000
EPOCH_NS = 20 * MS
PERIOD_NS = 10 * MS


def installed_messages(prefix: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let mauve_msgs and the messages of mauve_test_msgs be installed, and no others."""
    shutil.copytree(ROOT / "mauve_msgs" / "msg", prefix / "share" / "mauve_msgs" / "msg")
    folder = prefix / "share" / "mauve_test_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Text.msg").write_text("string data\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(prefix))


def trace_of(source: SyntheticSource, messages: tuple[Message, ...] = ()) -> Trace:
    """What the source has been given since the last time, without a bag in between."""
    drain = source.drain_trace()
    everything = np.frombuffer(drain.records, RECORD)
    records, losses = {}, {}
    for index, name in enumerate(source.components):
        rows = records[name] = everything[everything["component"] == index]
        losses[name] = Loss(drain.written[index], len(rows), drain.dropped[index], drain.dropped[index])
    pairs = np.array([(drain.monotonic_ns, drain.realtime_ns)], np.int64)
    names = tuple(source.trace_names())
    return Trace(records, names, losses, pairs, lambda _: iter(messages), kinds=kinds_told(TABLE))


def record(source: SyntheticSource, folder: Path) -> Path:
    """A finished bag of what the source has been given."""
    recorder = Recorder(source, folder, node_name="/executor")
    recorder.start()
    recorder.stop()
    return folder


class FlushedByHand:
    """A bag that is flushed when the test says so: what lies between two flushes is no matter of load."""

    def __init__(
        self, source: SyntheticSource, folder: Path, *, node_name: str, split: Split | None = None
    ) -> None:
        self._source = source
        self._bag = TraceBag(source, folder, node_name=node_name, on_error=_refuse, split=split)

    def flush(self) -> None:
        """Bring what the source was given into the bag."""
        self._bag.write(self._source.drain_trace(), [], whole=True)
        self._bag.flush()

    def close(self) -> None:
        """Flush a last time."""
        self._bag.write(self._source.drain_trace(), [], whole=True)
        self._bag.close()


def _refuse(text: str) -> None:
    raise AssertionError(text)


def record_small_bag(folder: Path) -> Path:
    """A bag of one component that ran a little."""
    source = SyntheticSource(["a"])
    deploy(source, "a")
    run(source, "a", 20)
    return record(source, folder)


def deploy(source: SyntheticSource, component: str, *, period_ns: int = PERIOD_NS) -> None:
    """Write what a component's trace begins with."""
    source.add(component, Kind.DEPLOYMENT, 0, a=EPOCH_NS, c=period_ns)
    source.add(component, Kind.START, EPOCH_NS - MS, a=EPOCH_NS)


def run(source: SyntheticSource, component: str, cycles: int, *, begin_ns: int = EPOCH_NS) -> int:
    """Let a deployed component run for some periods; returns the pending instant."""
    instant = begin_ns
    for cycle in range(cycles):
        instant = source.cycle(
            component,
            instant,
            states={"sense": 200_000 + cycle % 7, "act": 300_000 + cycle % 11},
            wait_ns=PERIOD_NS,
            wakeup_ns=10_000 + cycle % 13,
        )
    return instant


def overrun(source: SyntheticSource, component: str, instant_ns: int, *, late_ns: int = MS) -> int:
    """Write a cycle whose state `act` took too long; returns the pending instant, after one skipped."""
    late = instant_ns + PERIOD_NS + late_ns
    source.add(component, Kind.RELEASE, instant_ns, name="wait", a=instant_ns, b=instant_ns)
    source.add(component, Kind.STATE_BEGIN, instant_ns, name="act")
    source.add(component, Kind.STATE_END, late, name="act")
    source.add(component, Kind.OVERRUN, late, name="wait", a=instant_ns + PERIOD_NS, b=late, c=1)
    source.add(component, Kind.WAIT, late, name="wait", a=instant_ns + 2 * PERIOD_NS)
    return instant_ns + 2 * PERIOD_NS


def swap(source: SyntheticSource, component: str, pending_ns: int, *, blackout_ns: int = 20_000) -> None:
    """Replace a core half a period before the pending instant."""
    parked = pending_ns - PERIOD_NS // 2
    source.add(component, Kind.PARKED, parked, name="wait", a=pending_ns)
    for phase, took_ns, instant_ns in ((1, 4_000, 0), (2, 1_000, pending_ns - PERIOD_NS + 1)):
        armed = parked + blackout_ns
        what = "replace_core pkg/New"
        source.add(component, Kind.RECONFIGURATION, armed, name=what, a=phase, b=took_ns, c=instant_ns)
    source.add(component, Kind.ARMED, parked + blackout_ns, name="wait", a=pending_ns, b=1)


def periodic_trace(components: Sequence[str] = ("c",), cycles: int = 50) -> Trace:
    """Components that were never late."""
    source = SyntheticSource(list(components))
    for component in components:
        deploy(source, component)
        run(source, component, cycles)
    return trace_of(source)


def long_trace(
    components: Sequence[str],
    cycles: int,
    *,
    late: Iterable[int] = (),
    seed: int = 0,
    load: float = 0.0,
    slower: Mapping[str, float] | None = None,
) -> Trace:
    """Many cycles of six records, made by numpy: noisy times; the cycles in `late` overran.

    `load` is the standard deviation of the logarithm of a load that changes within some ten cycles; states of
    the components in `slower` take so many times as long.
    """
    names = ("", "wait", "sense", "act")
    kinds = (Kind.RELEASE, Kind.STATE_BEGIN, Kind.STATE_END, Kind.STATE_BEGIN, Kind.STATE_END, Kind.WAIT)
    words = (1, 2, 2, 3, 3, 1)
    records: dict[str, Records] = {}
    for index, component in enumerate(components):
        noise = np.random.default_rng((seed, index) if seed else index)
        nominal = EPOCH_NS + np.arange(cycles, dtype=np.int64) * PERIOD_NS
        wakeup = noise.gamma(2, 8_000, cycles).astype(np.int64)
        sense, act = (noise.gamma(6, mean, cycles).astype(np.int64) for mean in (40_000, 90_000))
        if load:
            changing = np.convolve(noise.normal(size=cycles + 9), np.full(10, 10**-0.5), "valid")
            wakeup, sense, act = (
                (one * np.exp(load * changing)).astype(np.int64) for one in (wakeup, sense, act)
            )
        factor = (slower or {}).get(component, 1)
        sense, act = ((one * factor).astype(np.int64) for one in (sense, act))
        rows = np.zeros((cycles, len(kinds)), RECORD)
        rows["kind"], rows["name"], rows["component"] = kinds, words, index
        ends = np.cumsum([nominal + wakeup, sense * 0, sense, act * 0, act, act * 0], axis=0).T
        rows["time_ns"] = ends
        rows["a"][:, 0], rows["b"][:, 0] = nominal, nominal + wakeup
        rows["a"][:, -1] = nominal + PERIOD_NS
        for cycle in late:
            rows[cycle, -1]["kind"] = Kind.OVERRUN
            rows[cycle, -1]["time_ns"] = nominal[cycle] + PERIOD_NS + MS // 10
            rows[cycle, -1]["b"] = nominal[cycle] + PERIOD_NS + MS // 10
        first = np.zeros(2, RECORD)
        first["kind"], first["component"] = (Kind.DEPLOYMENT, Kind.START), index
        first["a"], first["c"] = EPOCH_NS, (PERIOD_NS, 0)
        records[component] = np.concatenate([first, rows.ravel()])
        records[component]["sequence"] = np.arange(len(records[component]))
    losses = {name: Loss(len(rows), len(rows), 0, 0) for name, rows in records.items()}
    return Trace(records, names, losses, np.empty((0, 2), np.int64))


@dataclass
class Pose:
    """A message as a bag yields it."""

    x: float
    y: float


def with_values(trace: Trace, topics: Mapping[str, Sequence[tuple[int, Any]]]) -> Trace:
    """The trace, with messages of topics: (time in ns of CLOCK_MONOTONIC, message), by time."""
    every = [Message(topic, at_ns, at_ns, msg) for topic, found in topics.items() for at_ns, msg in found]
    every.sort(key=lambda message: message.log_time_ns)
    return replace(
        trace,
        topics={topic: ("pkg/msg/Any", len(found)) for topic, found in topics.items()},
        message_source=lambda wanted: (one for one in every if not wanted or one.topic in wanted),
    )
