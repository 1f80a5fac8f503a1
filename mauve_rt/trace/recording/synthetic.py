"""Traces that no executor recorded: of a schedule that an analysis found, of tests and benchmarks."""

import struct
from collections import deque
from dataclasses import dataclass, field

from mauve_rt.trace.format.records import Kind

_RECORD = struct.Struct("<QqqqqIHH")


@dataclass
class SyntheticDrain:
    """As `mauve_rt._kernel.TraceDrain`."""

    records: bytes
    written: list[int]
    dropped: list[int]
    monotonic_ns: int
    realtime_ns: int


@dataclass
class SyntheticSource:
    """A `TraceSource` that yields the records it was given."""

    components: list[str]
    realtime_offset_ns: int = 1_700_000_000_000_000_000
    """CLOCK_REALTIME - CLOCK_MONOTONIC."""
    now_ns: int = 0
    """Time of the next drain; follows the records unless set."""
    _names: list[str] = field(default_factory=list)
    _waiting: deque[bytes] = field(default_factory=deque)
    _written: list[int] = field(default_factory=list)
    _dropped: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._written = [0] * len(self.components)
        self._dropped = [0] * len(self.components)

    def add(
        self, component: str, kind: int, time_ns: int, *, name: str = "", a: int = 0, b: int = 0, c: int = 0
    ) -> None:
        """Write a record."""
        index = self.components.index(component)
        if name not in self._names:
            self._names.append(name)
        self._waiting.append(
            _RECORD.pack(self._written[index], time_ns, a, b, c, self._names.index(name), kind, index)
        )
        self._written[index] += 1
        self.now_ns = max(self.now_ns, time_ns)

    def drop(self, component: str, count: int = 1) -> None:
        """Lose records, as a full ring does."""
        index = self.components.index(component)
        self._written[index] += count
        self._dropped[index] += count

    def cycle(
        self,
        component: str,
        nominal_ns: int,
        *,
        states: dict[str, int],
        wait_ns: int,
        wakeup_ns: int = 0,
        wait: str = "wait",
    ) -> int:
        """Write a cycle: release, states (name: execution time in ns), next wait. Returns the wait's end."""
        now_ns = nominal_ns + wakeup_ns
        self.add(component, Kind.RELEASE, now_ns, name=wait, a=nominal_ns, b=now_ns)
        for state, execution_ns in states.items():
            self.add(component, Kind.STATE_BEGIN, now_ns, name=state)
            now_ns += execution_ns
            self.add(component, Kind.STATE_END, now_ns, name=state)
        self.add(component, Kind.WAIT, now_ns, name=wait, a=nominal_ns + wait_ns)
        return nominal_ns + wait_ns

    def collect_trace(self, period_ns: int) -> None:
        """Do nothing: records wait here for as long as they like."""

    def drain_trace(self) -> SyntheticDrain:
        """Take all records."""
        records = b"".join([self._waiting.popleft() for _ in range(len(self._waiting))])
        realtime_ns = self.now_ns + self.realtime_offset_ns
        return SyntheticDrain(records, list(self._written), list(self._dropped), self.now_ns, realtime_ns)

    def trace_components(self) -> list[str]:
        """Words that `component` of a record refers to."""
        return list(self.components)

    def trace_names(self) -> list[str]:
        """Words that `name` of a record refers to."""
        return list(self._names)
