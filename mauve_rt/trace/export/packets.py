"""Packets of a Perfetto trace, made by the classes that Perfetto publishes (PyPI `perfetto`).

A trace of Perfetto is a row of packets, so it is written one by one. What an event's packet says beside its
time repeats: it is made once and serialized with one time after the other. Names are interned: told once on a
packet sequence, numbers afterwards. Each track has a packet sequence of its own, whose defaults are the clock
and the track.
"""

from collections.abc import Iterable, Mapping
from types import ModuleType
from typing import IO, Any

from mauve_rt.trace.errors import TraceError

Figure = int | bool | str

CLOCK_REALTIME, CLOCK_MONOTONIC = 1, 3  # perfetto.protos.BuiltinClock
_STATE_CLEARED, _NEEDS_STATE = 1, 2  # TracePacket.SequenceFlags
_BEGIN, _END, _INSTANT, _COUNTER = 1, 2, 3, 4  # TrackEvent.Type
_TEXT_AT_MOST = 2000
_INT64 = 2**63


def load_protos() -> ModuleType:
    """Perfetto's message classes.

    Raises:
        TraceError: they are not installed, or do not fit the protobuf that is.

    """
    try:
        from perfetto.protos.perfetto.trace import perfetto_trace_pb2  # noqa: PLC0415 - half a second, and optional
    except Exception as error:  # what protobuf raises for classes newer than itself is no public class
        remedy = "install both by: pip install --upgrade perfetto protobuf"
        raise TraceError(
            f"Python packages perfetto and protobuf: cannot be used ({error}); {remedy}"
        ) from error
    module: ModuleType = perfetto_trace_pb2
    return module


def unicode(text: str) -> str:
    """The text, or what can be written of it: a bag that is not ours may hold anything."""
    return text[:_TEXT_AT_MOST].encode("utf-8", "replace").decode() or "(no name)"


def int64(value: int) -> int:
    """The number, or the nearest that there is room for: a difference of two may have none."""
    return max(-_INT64, min(value, _INT64 - 1))


class PacketFile:
    """Numbers packet sequences and tracks, and writes packets."""

    def __init__(self, file: IO[bytes]) -> None:
        """Write to a file that the caller opened.

        Raises:
            TraceError: as load_protos().

        """
        self.protos = load_protos()
        self._file = file
        self._last_uuid = 0
        self._last_sequence = 0

    def new_packet(self) -> tuple[Any, Any]:
        """A trace of one packet, and that packet: traces may be written one behind the other."""
        trace = self.protos.Trace()
        return trace, trace.packet.add()

    def write(self, trace: Any) -> None:
        """Append."""
        self._file.write(trace.SerializeToString())

    def new_sequence(self) -> int:
        """Number of a packet sequence."""
        self._last_sequence += 1
        return self._last_sequence

    def add_track(self, name: str = "", *, parent: int = 0, **fields: Any) -> int:
        """Describe a track; returns its uuid. `fields`: of TrackDescriptor, a message as a dictionary."""
        self._last_uuid += 1
        trace, packet = self.new_packet()
        packet.trusted_packet_sequence_id = self.new_sequence()
        descriptor = packet.track_descriptor
        descriptor.uuid = self._last_uuid
        if name:
            descriptor.name = unicode(name)
        if parent:
            descriptor.parent_uuid = parent
        for field, value in fields.items():
            if isinstance(value, dict):
                getattr(descriptor, field).CopyFrom(type(getattr(descriptor, field))(**value))
            elif isinstance(value, str):
                setattr(descriptor, field, unicode(value))
            else:
                setattr(descriptor, field, value)
        self.write(trace)
        return self._last_uuid


class Track:
    """Events of one track, by time: slices that nest, and instants. They carry the values of its counter."""

    def __init__(self, file: PacketFile, uuid: int, *, counter: int = 0) -> None:
        """Begin the packet sequence of a track and the track of its counter."""
        self._file = file
        self._sequence = file.new_sequence()
        self._interned: dict[tuple[str, str], int] = {}
        self._templates: dict[tuple[int, str, str], tuple[Any, Any]] = {}
        trace, packet = self._packet()
        packet.sequence_flags = _STATE_CLEARED
        packet.trace_packet_defaults.timestamp_clock_id = CLOCK_MONOTONIC
        packet.trace_packet_defaults.track_event_defaults.track_uuid = uuid
        if counter:
            packet.trace_packet_defaults.track_event_defaults.extra_counter_track_uuids.append(counter)
        file.write(trace)
        self._counting_end = self._template(_END, "count", "")
        self._counting_end[1].track_event.extra_counter_values.append(0)

    def begin(
        self,
        time_ns: int,
        name: str,
        category: str,
        figures: Mapping[str, Figure] | None = None,
        *,
        flows: Iterable[int] = (),
        ends: Iterable[int] = (),
    ) -> None:
        """A slice begins; `flows` go through it, `ends` end in it."""
        if figures or flows or ends:
            self._full(_BEGIN, time_ns, name, category, figures or {}, flows=flows, ends=ends)
        else:
            self._short(self._template(_BEGIN, name, category), time_ns)

    def end(self, time_ns: int) -> None:
        """The slice begun last ends."""
        self._short(self._template(_END, "", ""), time_ns)

    def end_counting(self, time_ns: int, value: int) -> None:
        """The same, with the counter's value."""
        self._counting_end[1].track_event.extra_counter_values[0] = int64(value)
        self._short(self._counting_end, time_ns)

    def instant(
        self,
        time_ns: int,
        name: str,
        category: str,
        figures: Mapping[str, Figure] | None = None,
        *,
        count: int | None = None,
        ends: Iterable[int] = (),
    ) -> None:
        """Something happened; `count`: the counter's value."""
        if figures or ends or count is not None:
            self._full(_INSTANT, time_ns, name, category, figures or {}, count=count, ends=ends)
        else:
            self._short(self._template(_INSTANT, name, category), time_ns)

    def count(self, time_ns: int, value: float) -> None:
        """Set the value of a track that is a counter itself."""
        template = self._template(_COUNTER, "", "")
        template[1].track_event.double_counter_value = value
        self._short(template, time_ns)

    def _short(self, template: tuple[Any, Any], time_ns: int) -> None:
        trace, packet = template
        packet.timestamp = max(0, int64(time_ns))
        self._file.write(trace)

    def _full(
        self,
        kind: int,
        time_ns: int,
        name: str,
        category: str,
        figures: Mapping[str, Figure],
        *,
        count: int | None = None,
        flows: Iterable[int] = (),
        ends: Iterable[int] = (),
    ) -> None:
        trace = self._file.protos.Trace()
        trace.CopyFrom(self._template(kind, name, category)[0])
        packet = trace.packet[0]
        packet.timestamp = max(0, int64(time_ns))
        event = packet.track_event
        for figure, value in figures.items():
            number = self._number("debug_annotation_names", figure)
            annotate(event.debug_annotations.add(name_iid=number), value)
        if count is not None:
            event.extra_counter_values.append(int64(count))
        event.flow_ids.extend(flows)
        event.terminating_flow_ids.extend(ends)
        self._file.write(trace)

    def _template(self, kind: int, name: str, category: str) -> tuple[Any, Any]:
        known = self._templates.get((kind, name, category))
        if known is None:
            known = self._templates[kind, name, category] = self._packet()
            packet = known[1]
            packet.timestamp = 0
            packet.sequence_flags = _NEEDS_STATE
            packet.track_event.type = kind
            if kind in (_BEGIN, _INSTANT):
                packet.track_event.name_iid = self._number("event_names", name)
                packet.track_event.category_iids.append(self._number("event_categories", category))
        return known

    def _number(self, table: str, word: str) -> int:
        """The number of an interned word, which a packet before its first use tells."""
        number = self._interned.get((table, word))
        if number is None:
            number = self._interned[table, word] = len(self._interned) + 1
            trace, packet = self._packet()
            packet.sequence_flags = _NEEDS_STATE
            getattr(packet.interned_data, table).add(iid=number, name=unicode(word))
            self._file.write(trace)
        return number

    def _packet(self) -> tuple[Any, Any]:
        trace, packet = self._file.new_packet()
        packet.trusted_packet_sequence_id = self._sequence
        return trace, packet


def annotate(annotation: Any, value: Figure) -> None:
    """Give a debug annotation its value."""
    if isinstance(value, bool):
        annotation.bool_value = value
    elif isinstance(value, int):
        annotation.int_value = int64(value)
    else:
        annotation.string_value = unicode(value)
