"""What is recorded and how, as plain values: for who only names it, without what writes bags."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

_FOREVER = "{sec: 9223372036, nsec: 854775807}"  # RMW_DURATION_INFINITE


@dataclass(frozen=True, kw_only=True)
class TopicQos:
    """What `ros2 bag play` needs to offer a topic as it was offered."""

    depth: int = 10
    reliable: bool = True
    transient_local: bool = False

    def as_yaml(self) -> str:
        """A list of one profile on one line, in the form of rosbag2 metadata version 9."""
        reliability = "reliable" if self.reliable else "best_effort"
        durability = "transient_local" if self.transient_local else "volatile"
        return (
            f"[{{history: keep_last, depth: {self.depth}, reliability: {reliability}, "
            f"durability: {durability}, deadline: {_FOREVER}, lifespan: {_FOREVER}, liveliness: automatic, "
            f"liveliness_lease_duration: {_FOREVER}, avoid_ros_namespace_conventions: false}}]"
        )


class SentMessage(NamedTuple):
    """A serialized message: CDR with its header, ns of the clock that the trace is on."""

    topic: str
    type_name: str
    data: bytes
    monotonic_ns: int
    qos: TopicQos | None
    definition: str = ""
    """Of a type that no installed package has: the .msg text, as a bag stores it."""


class ReceivedTopic(NamedTuple):
    """A topic of other nodes that is recorded."""

    name: str
    type_name: str
    qos: TopicQos


class ReceivedBatch(Protocol):
    """Messages of such topics as records of an MCAP file (`mauve_rt._bridge.MessageBatch`)."""

    @property
    def sizes(self) -> Sequence[int]:
        """Messages of each topic."""

    @property
    def counts(self) -> Sequence[tuple[int, int, int]]:
        """(received, lost before, lost here for want of room) of each topic, so far."""

    def messages(self, topic: int) -> Sequence[tuple[int, bytes]]:
        """(ns of the clock that the trace is on, CDR) of each message of a topic; before pack()."""

    def pack(
        self,
        channels: Sequence[int],
        *,
        log_ahead_ns: int,
        publish_ahead_ns: int,
        earliest_log_ns: int,
        offset: int,
    ) -> "tuple[memoryview, Sequence[PackedChannel]]":
        """Complete the records for a place in a chunk; once. Channel 0 leaves a topic out."""


PackedChannel = tuple[int, int, int, bytes]
"""Channel, first and last log time, entries of its message index."""


COMPRESSIONS = ("none", "zstd")
"""Of the chunks of a bag's files."""
FILES_OF_A_BAG = 4
"""A bag of limited size has so many files at least, so that a deletion leaves most of it."""


@dataclass(frozen=True, kw_only=True)
class Split:
    """When a bag goes on in a new file, whichever comes first, and the size of all; 0: no limit."""

    after_s: float = 60.0
    after_bytes: int = 0
    max_bytes: int = 0
    """Of all files: beyond it the oldest one is deleted."""

    @property
    def file_bytes(self) -> int:
        """Size at which a file ends; of a bag of limited size there is one; 0: any."""
        return self.after_bytes or self.max_bytes // FILES_OF_A_BAG

    def misfit(self) -> str:
        """Say what is wrong with the limits; empty where nothing is."""
        if 0 < self.max_bytes < 2 * self.after_bytes:
            expected = f"expected at least twice the size of a file, {2 * self.after_bytes:,} bytes"
            return f"{expected}, found {self.max_bytes:,}; choose a larger limit or smaller files"
        return ""


MIN_WINDOW_BYTES = 100_000
SNAPSHOT_BYTES = 268_435_456  # 256 MiB
"""Default of the memory for snapshots."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """The last seconds that a recording keeps in memory, for snapshots, instead of writing a bag."""

    seconds: float
    max_bytes: int = SNAPSHOT_BYTES
    """Of the memory: beyond it the oldest records and messages are dropped sooner."""
