"""What a component did, as slices and instants of its track. Waits are not drawn."""

from collections.abc import Callable, Iterable

import numpy as np

from mauve_rt.trace.export.packets import Track
from mauve_rt.trace.export.swaps import Swap
from mauve_rt.trace.format.records import Kind
from mauve_rt.trace.reading.pairs import gaps
from mauve_rt.trace.reading.trace import Trace

_AT_ONCE = 1 << 15  # records that are Python's objects at a time
_ENDS_ALL = (Kind.START, Kind.STOP, Kind.FAULT)


class ComponentTrack:
    """Turns the records of one component, in their order, into events.

    Slices nest, and every one ends: one whose end is lost ends with the last record before the loss.
    """

    def __init__(self, trace: Trace, component: str, track: Track, swaps: Iterable[Swap]) -> None:
        self._trace = trace
        self._rows = trace.of(component)
        self._track = track
        self._swaps = {swap.parked: swap for swap in swaps}
        self._flows = {
            swap.resumed: (swap.flow,) for swap in self._swaps.values() if swap.resumed is not None
        }
        self._open: list[tuple[int, int]] = []  # slices begun and not ended: the record's kind and name
        self._now_ns = 0  # of the latest event: none goes back behind it

    def draw(self, progress: Callable[[int], None]) -> None:
        """Write all events; `progress` is told how many records are done."""
        draw: dict[int, Callable[[int, int, int, int, int, int], None]] = {
            Kind.RELEASE: self._release,
            Kind.STATE_BEGIN: self._begin_state,
            Kind.STATE_END: lambda _, time_ns, name, *__: self._end(Kind.STATE_BEGIN, name, time_ns),
            Kind.PARKED: self._park,
            Kind.ARMED: lambda _, time_ns, name, *__: self._end(Kind.PARKED, name, time_ns),
            Kind.SERVICE_BEGIN: self._begin_service,
            Kind.SERVICE_END: lambda _, time_ns, name, *__: self._end(Kind.SERVICE_BEGIN, name, time_ns),
            Kind.CONTENDED: self._wait_for_lock,
        }
        missing = gaps(self._rows)
        (drawn,) = np.nonzero((self._rows["kind"] != Kind.WAIT) | missing)
        for begin in range(0, len(drawn), _AT_ONCE):
            some = drawn[begin : begin + _AT_ONCE]
            rows = self._rows[some]
            columns = [rows[name].tolist() for name in ("kind", "time_ns", "name", "a", "b", "c")]
            for index, lost, kind, *fields in zip(
                some.tolist(), missing[some].tolist(), *columns, strict=True
            ):
                if lost:
                    self._tell_loss(index)
                if kind in draw:
                    draw[kind](index, *fields)
                elif kind != Kind.WAIT and kind in self._trace.kinds:
                    self._happen(kind, *fields)
            progress(int(some[-1]))
        self._end_all(int(self._rows["time_ns"][-1]) if len(self._rows) else 0)

    def _release(
        self, index: int, time_ns: int, _name: int, nominal_ns: int, actual_ns: int, _c: int
    ) -> None:
        """A slice `late` from the nominal to the actual instant; an instant where they are the same."""
        ends = self._flows.get(index, ())
        if actual_ns <= nominal_ns:
            count = actual_ns - nominal_ns
            self._track.instant(self._at(time_ns), "release", "release", count=count, ends=ends)
            return
        begin_ns = self._at(nominal_ns)  # that may be before the end of what made it late
        figures = {} if begin_ns == nominal_ns else {"nominal_ns": nominal_ns}
        self._track.begin(begin_ns, "late", "release", figures, ends=ends)
        self._track.end_counting(self._at(time_ns), actual_ns - nominal_ns)

    def _begin_state(self, index: int, time_ns: int, name: int, *_: int) -> None:
        self._begin(Kind.STATE_BEGIN, name, time_ns, "state", ends=self._flows.get(index, ()))

    def _begin_service(self, _index: int, time_ns: int, name: int, *_: int) -> None:
        self._begin(Kind.SERVICE_BEGIN, name, time_ns, "service")

    def _begin(
        self, kind: Kind, name: int, time_ns: int, category: str, *, ends: tuple[int, ...] = ()
    ) -> None:
        self._track.begin(self._at(time_ns), self._trace.name(name), category, ends=ends)
        self._open.append((kind, name))

    def _park(self, index: int, time_ns: int, name: int, pending_ns: int, *_: int) -> None:
        swap = self._swaps.get(index)
        what = f"reconfiguration {swap.what}".rstrip() if swap else "reconfiguration"
        figures = swap.figures if swap else {"pending_ns": pending_ns}
        flows = (swap.flow,) if swap and swap.flow else ()
        onwards = swap is not None and swap.resumed is not None
        through, ends = (flows, ()) if onwards else ((), flows)
        self._track.begin(self._at(time_ns), what, "reconfiguration", figures, flows=through, ends=ends)
        self._open.append((Kind.PARKED, name))

    def _wait_for_lock(self, _i: int, time_ns: int, name: int, holder: int, waited_ns: int, _c: int) -> None:
        what = f"waits for {self._trace.name(name)}"
        self._track.begin(self._at(time_ns - waited_ns), what, "contention", {"holder_tid": holder})
        self._track.end(self._at(time_ns))

    def _happen(self, kind: int, time_ns: int, name: int, *figures: int) -> None:
        """An instant, its fields named as in the bag's table."""
        if kind in _ENDS_ALL:
            self._end_all(time_ns)
        if kind == Kind.RECONFIGURATION and self._open and self._open[-1][0] == Kind.PARKED:
            return  # the slice has its figures
        word = self._trace.name(name)
        of_kind = self._trace.kinds[kind]
        what = of_kind.name
        told: dict[str, int | str] = {
            meaning: figures["abc".index(field)] for field, meaning in of_kind.figures.items()
        }
        if kind == Kind.MARK:
            what = word
        elif word:
            told["of"] = word
        if kind == Kind.OVERRUN:
            told["late_ns"] = figures[1] - figures[0]
        self._track.instant(self._at(time_ns), what, "mark" if kind == Kind.MARK else "event", told)

    def _end(self, begun: Kind, name: int, time_ns: int) -> None:
        """End a slice, and whatever is still open in it; an end whose begin is lost is none."""
        if (begun, name) not in self._open:
            return
        at_ns = self._at(time_ns)
        while self._open:
            self._track.end(at_ns)
            if self._open.pop() == (begun, name):
                return

    def _end_all(self, time_ns: int) -> None:
        at_ns = self._at(time_ns)
        for _ in self._open:
            self._track.end(at_ns)
        self._open.clear()

    def _tell_loss(self, index: int) -> None:
        before, after = self._rows[index - 1], self._rows[index]
        self._end_all(int(before["time_ns"]))
        lost = int(after["sequence"]) - int(before["sequence"]) - 1
        if lost > 0:  # less: a component's next life begins at 0
            self._track.instant(self._at(int(after["time_ns"])), "records lost", "event", {"lost": lost})

    def _at(self, time_ns: int) -> int:
        self._now_ns = max(self._now_ns, time_ns)
        return self._now_ns
