"""A trace in memory: records per component, what they mean, what is missing."""

import heapq
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.kinds import RecordKind, kinds_known
from mauve_rt.trace.format.records import Kind, Records
from mauve_rt.trace.reading.architecture import ComponentInfo
from mauve_rt.trace.reading.facts import (
    BagFile,
    ClockStep,
    Deployment,
    Loss,
    Message,
    MessageSource,
    TracedDecision,
)
from mauve_rt.trace.reading.shadows import Shadow, last_reports

if TYPE_CHECKING:
    from mauve_rt.trace.bag.deletion import Deleted
    from mauve_rt.trace.reading.frames import Frames
    from mauve_rt.trace.reading.messages import PayloadSource
    from mauve_rt.trace.reading.typed_records import Record
    from mauve_rt.trace.reading.values import TraceValues
    from mauve_rt.trace.recording.ledger import Entry

_CLOCK_STEP_NS = 500_000_000  # a clock that is slewed gains at most 0.5 ms in a second
_SAME_CLOCK_NS = 1_000_000_000  # (realtime - monotonic) of two machines differs by more than this


@dataclass(frozen=True)
class Trace:
    """Records of one executor, or of several merged ones."""

    records: dict[str, Records]
    """Per component, in the order of their sequence numbers. Times in ns of CLOCK_MONOTONIC."""
    names: tuple[str, ...]
    """What `name` of a record refers to."""
    losses: dict[str, Loss]
    clock_pairs: npt.NDArray[np.int64]
    """(n, 2): CLOCK_MONOTONIC and CLOCK_REALTIME at each drain."""
    message_source: MessageSource = field(repr=False, default=lambda _: iter(()))
    architecture: tuple[ComponentInfo, ...] = ()
    """As last told in the bag; empty when it does not tell."""
    threads: Any = None
    """Beside the components, as mauve_msgs/msg/TaskList; None: of several executors, or earlier ones."""
    first_grids: Mapping[str, Deployment] = field(default_factory=dict)
    """Grids of components that were deployed before the recording began."""
    files: tuple[BagFile, ...] = ()
    """What it was read from."""
    topics: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    """Of every topic in the bag, the trace's own too: type and number of messages."""
    ledger: Mapping[str, "Entry"] = field(default_factory=dict)
    """What became of the messages of each topic; empty where the bag does not tell."""
    deleted: tuple["Deleted", ...] = ()
    """What the limit of a bag's size deleted of its begin: one of each bag that lacks its begin."""
    kinds: Mapping[int, RecordKind] = field(default_factory=kinds_known)
    """What the kinds of records are called, as told in the bag: newer ones than this reader's among them."""
    decisions: tuple[TracedDecision, ...] = ()
    """Of the executor's rules, by time; empty when it ran none."""
    shadow_reports: tuple[Shadow, ...] = ()
    """Of each shadow one report a second, and one after its end; in the order of the bag."""
    payload_source: "PayloadSource | None" = field(repr=False, default=None)
    """Messages of these topics as bytes; None of a trace made by hand, which has objects only."""

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components."""
        return tuple(self.records)

    @property
    def lost(self) -> int:
        """Records known to be lost, of all components."""
        return sum(loss.lost for loss in self.losses.values())

    @property
    def clock_steps(self) -> list[ClockStep]:
        """Steps of CLOCK_REALTIME against CLOCK_MONOTONIC, by time; of one executor's trace only."""
        pairs = self.clock_pairs[np.argsort(self.clock_pairs[:, 0], kind="stable")]
        steps_ns = np.diff(pairs[:, 1] - pairs[:, 0])
        return [
            ClockStep(int(pairs[at + 1, 1] - steps_ns[at]), int(steps_ns[at]))
            for at in np.flatnonzero(np.abs(steps_ns) >= _CLOCK_STEP_NS)
        ]

    @property
    def span_ns(self) -> tuple[int, int]:
        """Time of the first and of the last record; zeros when there is none."""
        rows = [records["time_ns"] for records in self.records.values() if len(records)]
        if self.decisions:
            rows.append(np.array([one.time_ns for one in self.decisions], np.int64))
        return (min(int(row.min()) for row in rows), max(int(row.max()) for row in rows)) if rows else (0, 0)

    @property
    def shadows(self) -> tuple[Shadow, ...]:
        """Each shadow by its last report, by component, then by begin; empty when there was none."""
        return last_reports(self.shadow_reports)

    def of(self, component: str, *kinds: int) -> Records:
        """Records of one component, of these kinds (all when none is named).

        Raises:
            TraceError: there is no such component in the trace.

        """
        if component not in self.records:
            known = ", ".join(self.records) or "none"
            msg = f"component '{component}': not in the trace, which has {known}"
            raise TraceError(msg)
        records = self.records[component]
        return records[np.isin(records["kind"], kinds)] if kinds else records

    def name(self, index: int) -> str:
        """Word that a record's `name` stands for; `name <index>` when the bag ends before telling it."""
        return self.names[index] if 0 <= index < len(self.names) else f"name {index}"

    def deployments(self, component: str) -> list[Deployment]:
        """Grids of a component in the order of time; a component deployed again has more than one."""
        rows = self.of(component, Kind.DEPLOYMENT)
        told = [Deployment(int(r["time_ns"]), int(r["a"]), int(r["b"]), int(r["c"])) for r in rows]
        return [self.first_grids[component], *told] if component in self.first_grids else told

    def deployment_at(self, component: str, time_ns: int) -> Deployment | None:
        """Return the grid in force at a time: the last before it, else the first; None when there is none."""
        grids = self.deployments(component)
        earlier = [grid for grid in grids if grid.time_ns <= time_ns]
        return earlier[-1] if earlier else next(iter(grids), None)

    @cached_property
    def frames(self) -> "Frames":
        """The trace as pandas data frames: `trace.frames.releases` and so on."""
        from mauve_rt.trace.reading.frames import Frames  # noqa: PLC0415 - pandas takes its time to load

        return Frames(self)

    @cached_property
    def values(self) -> "TraceValues":
        """Numeric fields of recorded messages over time: `trace.values["pose.x"]` is a pandas Series."""
        from mauve_rt.trace.reading.values import TraceValues  # noqa: PLC0415 - only who asks reads messages

        return TraceValues(self)

    def typed(self, *components: str) -> Iterator["Record"]:
        """Yield the records of these components (all when none is named) by time, as typed values.

        Raises:
            TraceError: there is no such component in the trace.

        """
        from mauve_rt.trace.reading.typed_records import typed_records  # noqa: PLC0415 - which needs this module

        return typed_records(self, *components)

    def messages(self, *topics: str) -> Iterator[Message]:
        """Messages of these topics or types (all but the trace's own when none is named), by log time."""
        return self.message_source(topics)


def merge_traces(traces: Mapping[str, Trace]) -> Trace:
    """Return one trace of several executors; components are named <key>/<component>, rules <key>/<rule>.

    Raises:
        TraceError: they were recorded on machines, or after boots, with different monotonic clocks.

    """
    offsets = {key: _clock_offset_ns(trace) for key, trace in traces.items() if len(trace.clock_pairs)}
    if offsets and max(offsets.values()) - min(offsets.values()) > _SAME_CLOCK_NS:
        found = ", ".join(f"{key}: {offset / 1e9:.3f} s" for key, offset in offsets.items())
        msg = f"traces of different monotonic clocks cannot be merged (realtime - monotonic: {found})"
        raise TraceError(msg)
    names = tuple(dict.fromkeys(name for trace in traces.values() for name in trace.names))
    position = {name: index for index, name in enumerate(names)}
    records: dict[str, Records] = {}
    losses: dict[str, Loss] = {}
    for key, trace in traces.items():
        renumbering = np.array([position[name] for name in trace.names], dtype=np.uint32)
        for component, rows in trace.records.items():
            merged = rows.copy()
            known = rows["name"] < len(renumbering)
            merged["name"][known] = renumbering[rows["name"][known]]
            merged["name"][~known] = len(names)
            records[f"{key}/{component}"] = merged
            losses[f"{key}/{component}"] = trace.losses[component]

    def messages(topics: tuple[str, ...]) -> Iterator[Message]:
        sources = (trace.messages(*topics) for trace in traces.values())
        return heapq.merge(*sources, key=lambda message: message.log_time_ns)

    pairs = np.concatenate([trace.clock_pairs for trace in traces.values()] or [np.empty((0, 2), np.int64)])
    return Trace(
        records,
        names,
        losses,
        pairs[np.argsort(pairs[:, 1], kind="stable")],
        messages,
        architecture=tuple(
            component.prefixed(key) for key, trace in traces.items() for component in trace.architecture
        ),
        first_grids={
            f"{key}/{component}": grid
            for key, trace in traces.items()
            for component, grid in trace.first_grids.items()
        },
        files=tuple(file for trace in traces.values() for file in trace.files),
        topics=_all_topics(traces.values()),
        ledger=_all_entries(traces.values()),
        deleted=tuple(one for trace in traces.values() for one in trace.deleted),
        kinds={number: kind for trace in traces.values() for number, kind in trace.kinds.items()},
        decisions=_all_decisions(traces),
        shadow_reports=tuple(
            replace(one, component=f"{key}/{one.component}")
            for key, trace in traces.items()
            for one in trace.shadow_reports
        ),
        payload_source=_all_payloads(traces.values()),
    )


def _all_payloads(traces: Iterable[Trace]) -> "PayloadSource | None":
    sources = [trace.payload_source for trace in traces]
    known = [source for source in sources if source is not None]
    if len(known) < len(sources):
        return None
    return lambda topics: chain.from_iterable(source(topics) for source in known)


def _all_decisions(traces: Mapping[str, Trace]) -> tuple[TracedDecision, ...]:
    named = [
        one._replace(rule=f"{key}/{one.rule}") for key, trace in traces.items() for one in trace.decisions
    ]
    return tuple(sorted(named, key=lambda one: one.time_ns))


def _all_topics(traces: Iterable[Trace]) -> dict[str, tuple[str, int]]:
    found: dict[str, tuple[str, int]] = {}
    for trace in traces:
        for topic, (type_name, count) in trace.topics.items():
            found[topic] = (type_name, count + found.get(topic, ("", 0))[1])
    return found


def _all_entries(traces: Iterable[Trace]) -> dict[str, "Entry"]:
    found: dict[str, Entry] = {}
    for trace in traces:
        for topic, entry in trace.ledger.items():
            found[topic] = found[topic].plus(entry) if topic in found else entry
    return found


def _clock_offset_ns(trace: Trace) -> int:
    monotonic_ns, realtime_ns = trace.clock_pairs[-1]
    return int(realtime_ns - monotonic_ns)
