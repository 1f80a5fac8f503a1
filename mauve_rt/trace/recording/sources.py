"""From where a recorder takes records and messages."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from mauve_rt.trace.bag.recorded import ReceivedBatch, ReceivedTopic, SentMessage


class Drain(Protocol):
    """What one drain of the kernel's rings yields (`mauve_rt._kernel.TraceDrain`)."""

    @property
    def records(self) -> bytes:
        """Records, 48 bytes each."""

    @property
    def written(self) -> list[int]:
        """Per component: records ever offered."""

    @property
    def dropped(self) -> list[int]:
        """Per component: of these, lost because the ring was full."""

    @property
    def monotonic_ns(self) -> int:
        """Time of the drain, CLOCK_MONOTONIC."""

    @property
    def realtime_ns(self) -> int:
        """The same instant, CLOCK_REALTIME."""


class Drained(NamedTuple):
    """A drain as a value."""

    records: bytes
    written: list[int]
    dropped: list[int]
    monotonic_ns: int
    realtime_ns: int


class TraceWords(Protocol):
    """What the numbers in records stand for; all that a bag asks for itself."""

    def trace_components(self) -> list[str]:
        """Words that `component` of a record refers to."""

    def trace_names(self) -> list[str]:
        """Words that `name` of a record refers to."""


class TraceSource(TraceWords, Protocol):
    """The part of `mauve_rt._kernel.Host` that the recorder uses."""

    def collect_trace(self, period_ns: int) -> None:
        """Empty the rings so often, by a thread without the interpreter, for drain_trace(); 0: no longer."""

    def drain_trace(self) -> Drain:
        """Take everything out of the rings, and what was collected."""


class TopicSource(Protocol):
    """Topics of other nodes, received elsewhere."""

    @property
    def topics(self) -> Sequence[ReceivedTopic]:
        """In the order of their numbers; further ones come behind."""

    @property
    def numbered(self) -> bool:
        """Whether gaps in what a writer sent are known."""

    def take(self) -> ReceivedBatch:
        """What came since the last call."""

    def stop(self) -> None:
        """Receive no longer; the last messages stay for take(). May be called again."""


class MessageSource(Protocol):
    """Messages kept elsewhere until the recorder takes them."""

    def keep_messages(self, *, on: bool) -> None:
        """Keep them from now on, or no longer."""

    def take_messages(self) -> Sequence[SentMessage]:
        """What was sent or received since the last call."""

    def dropped_messages(self) -> int:
        """Messages that found no room to wait, ever."""
