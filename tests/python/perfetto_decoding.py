"""A Perfetto trace read back by Perfetto's own classes, interned words and defaults resolved."""

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from perfetto.protos.perfetto.trace import perfetto_trace_pb2 as protos

BEGIN, END, INSTANT, COUNTER = (
    protos.TrackEvent.TYPE_SLICE_BEGIN,
    protos.TrackEvent.TYPE_SLICE_END,
    protos.TrackEvent.TYPE_INSTANT,
    protos.TrackEvent.TYPE_COUNTER,
)


@dataclass
class Event:
    """A slice (end_ns is set) or an instant."""

    name: str
    category: str
    begin_ns: int
    figures: dict[str, Any]
    flows: list[int]
    ends: list[int]
    depth: int
    end_ns: int | None = None
    counts: list[int] = field(default_factory=list)


class Decoded:
    """Tracks by their uuids, events by track, flows by number, clocks. Asserts what every good trace has."""

    def __init__(self, path: Path) -> None:
        self.tracks: dict[int, Any] = {}
        self.clocks: list[dict[int, int]] = []
        self.primary_clocks: set[int] = set()
        self.events: dict[int, list[Event]] = defaultdict(list)
        self.flows: dict[int, list[tuple[int, bool, Event]]] = defaultdict(list)
        self.counted: dict[int, list[tuple[int, float]]] = defaultdict(list)
        self._words: dict[int, dict[tuple[str, int], str]] = defaultdict(dict)
        self._defaults: dict[int, Any] = {}
        self._open: dict[int, list[Event]] = defaultdict(list)
        trace = protos.Trace()
        trace.ParseFromString(path.read_bytes())
        for packet in trace.packet:
            assert packet.trusted_packet_sequence_id > 0
            self._read_state(packet)
        events = [packet for packet in trace.packet if packet.HasField("track_event")]
        for packet in sorted(events, key=lambda one: one.timestamp):  # stable, as Perfetto does
            self._read_event(packet)
        assert not any(self._open.values()), "slices without an end"
        for flow in self.flows.values():
            assert [last for _, last, _ in flow] == [False] * (len(flow) - 1) + [True]
            assert len(flow) >= 2

    def _read_state(self, packet: Any) -> None:
        sequence = packet.trusted_packet_sequence_id
        if packet.HasField("clock_snapshot"):
            self.clocks.append({clock.clock_id: clock.timestamp for clock in packet.clock_snapshot.clocks})
            self.primary_clocks.add(packet.clock_snapshot.primary_trace_clock)
        if packet.HasField("track_descriptor"):
            descriptor = packet.track_descriptor
            assert descriptor.uuid not in self.tracks
            assert descriptor.parent_uuid == 0 or descriptor.parent_uuid in self.tracks
            self.tracks[descriptor.uuid] = descriptor
        if packet.sequence_flags & protos.TracePacket.SEQ_INCREMENTAL_STATE_CLEARED:
            self._defaults[sequence] = packet.trace_packet_defaults
        for table in ("event_names", "event_categories", "debug_annotation_names"):
            for word in getattr(packet.interned_data, table):
                assert (table, word.iid) not in self._words[sequence]
                self._words[sequence][table, word.iid] = word.name
        if packet.HasField("track_event"):
            assert packet.sequence_flags & protos.TracePacket.SEQ_NEEDS_INCREMENTAL_STATE
            assert self._defaults[sequence].timestamp_clock_id == protos.BUILTIN_CLOCK_MONOTONIC

    def _read_event(self, packet: Any) -> None:
        event, words = packet.track_event, self._words[packet.trusted_packet_sequence_id]
        defaults = self._defaults[packet.trusted_packet_sequence_id].track_event_defaults
        assert defaults.track_uuid in self.tracks
        assert len(event.extra_counter_values) <= len(defaults.extra_counter_track_uuids)
        if event.type == COUNTER:
            assert self.tracks[defaults.track_uuid].HasField("counter")
            self.counted[defaults.track_uuid].append((packet.timestamp, event.double_counter_value))
            return
        stack = self._open[defaults.track_uuid]
        if event.type == END:
            ended = stack.pop()  # one that was not begun fails here
            ended.end_ns = packet.timestamp
            ended.counts += event.extra_counter_values
            return
        (category,) = event.category_iids
        made = Event(
            words["event_names", event.name_iid],
            words["event_categories", category],
            packet.timestamp,
            {
                words["debug_annotation_names", one.name_iid]: getattr(one, one.WhichOneof("value"))
                for one in event.debug_annotations
            },
            list(event.flow_ids),
            list(event.terminating_flow_ids),
            len(stack),
            counts=list(event.extra_counter_values),
        )
        self.events[defaults.track_uuid].append(made)
        for flow in made.flows:
            self.flows[flow].append((defaults.track_uuid, False, made))
        for flow in made.ends:
            self.flows[flow].append((defaults.track_uuid, True, made))
        if event.type == BEGIN:
            stack.append(made)
        else:
            assert event.type == INSTANT

    def uuid(self, name: str, *, parent: str = "") -> int:
        """Of the track of that name."""
        found = [
            uuid
            for uuid, track in self.tracks.items()
            if track.name == name
            and (not parent or self.tracks[track.parent_uuid].process.process_name == parent)
        ]
        assert len(found) == 1, f"{len(found)} tracks {name}"
        return found[0]

    def of(self, name: str, *, parent: str = "") -> list[Event]:
        """Events of the track of that name, by their begin."""
        return self.events[self.uuid(name, parent=parent)]
