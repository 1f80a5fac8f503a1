"""What a bag tells besides records: grids, losses, files, messages of other topics."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

OWN_TYPES = tuple(f"mauve_msgs/msg/{name}" for name in ("TraceBatch", "TraceNames", "TraceArchitecture"))
"""What a trace consists of; all else in its bag are other topics' messages."""


class Deployment(NamedTuple):
    """The grid of a component's instants from time_ns on: epoch_ns + offset_ns + k * period_ns."""

    time_ns: int
    epoch_ns: int
    offset_ns: int
    period_ns: int
    """g; 0 for a sporadic component, which has no grid."""

    def phase_ns(self, instant_ns: int) -> int:
        """Instant minus the nearest instant of the grid: in [-g/2, g/2), 0 without a grid."""
        if self.period_ns <= 0:
            return 0
        half = self.period_ns // 2
        return (instant_ns - self.epoch_ns - self.offset_ns + half) % self.period_ns - half


class Loss(NamedTuple):
    """What is known about records that are not in the bag."""

    written: int
    """Records the component offered since the bag began, by the last batch."""
    received: int
    dropped: int
    """Of the written ones, lost because the ring was full, by the last batch."""
    gaps: int
    """Sequence numbers missing before the last one received."""

    @property
    def lost(self) -> int:
        """Records known to be lost."""
        return max(self.dropped, self.gaps)

    def plus(self, other: "Loss") -> "Loss":
        """Return both together, field by field."""
        return Loss(*(mine + others for mine, others in zip(self, other, strict=True)))


class BagFile(NamedTuple):
    """A file that a trace was read from."""

    path: Path
    library: str
    """What wrote it, by its own words."""
    whole_bytes: int
    """How much of it could be read."""
    damage: str
    """Why not all; empty when it could."""


class TracedDecision(NamedTuple):
    """What a rule of the executor decided. Times in ns of CLOCK_MONOTONIC."""

    time_ns: int
    rule: str
    decision: str
    """In the words of TraceRecord.msg, e.g. `condition true`, `do`, `undone`, `no do`."""
    cause_ns: int
    """Its condition is as it is since then."""
    why: str
    """Why nothing was done or it failed; empty where there is nothing to tell."""


class ClockStep(NamedTuple):
    """CLOCK_REALTIME was set, or went on while the machine was suspended."""

    realtime_ns: int
    """When it was noticed, by the clock before."""
    step_ns: int
    """Negative: it was set back."""

    @property
    def text(self) -> str:
        """One sentence."""
        at = datetime.fromtimestamp(self.realtime_ns / 1e9, UTC).isoformat(timespec="seconds")
        if self.step_ns > 0:
            how = f"was set forward by {self.step_ns / 1e9:.1f} s (or the machine was suspended)"
        else:
            how = f"was set back by {-self.step_ns / 1e9:.1f} s"
        return f"the clock {how} at {at} of the time before: publish times and stamps jump there"


class Message(NamedTuple):
    """A message of another topic than the trace itself."""

    topic: str
    log_time_ns: int
    """CLOCK_REALTIME"""
    monotonic_ns: int
    """The same instant on the records' clock, by the clock pair of its flush."""
    msg: Any


MessageSource = Callable[[tuple[str, ...]], Iterator[Message]]
