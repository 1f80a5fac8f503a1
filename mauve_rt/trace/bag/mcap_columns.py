"""Messages of an MCAP file as numpy columns: an object of each would take ten times as long.

The executor does not load this module: it records without numpy.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.bag.mcap_library import Message

Integers = npt.NDArray[np.int64]

_HEAD = np.dtype(
    [
        ("opcode", "<u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time_ns", "<u8"),
        ("published_ns", "<u8"),
    ]
)
"""The begin of the record of a message."""
_FIXED_BYTES = 22  # of these, what `length` counts, too
_FEW = 2  # a file may have its messages outside of chunks, one by one
_AT_0 = np.zeros(1, np.int64)


@dataclass(frozen=True)
class MessageColumns:
    """Records of messages in one buffer, in the order of the file."""

    data: bytes
    at: Integers
    """Where each record begins."""
    heads: npt.NDArray[Any]
    """The begin of each record: opcode, length, channel, sequence, log_time_ns, published_ns."""

    @classmethod
    def of_places(cls, data: bytes, places: list[int]) -> "MessageColumns":
        """Read the heads at these places; each is whole."""
        at = np.array(places, np.int64)
        return cls(data, at, rows_at(data, at, _HEAD.itemsize).reshape(-1).view(_HEAD))

    @classmethod
    def of_record(cls, record: bytes) -> "MessageColumns":
        """Return the one message whose record this is."""
        return cls(record, _AT_0, np.frombuffer(record, _HEAD, 1))

    def __len__(self) -> int:
        """How many there are."""
        return len(self.at)

    @property
    def begins(self) -> Integers:
        """Where the payload of each message begins."""
        return self.at + _HEAD.itemsize

    @property
    def sizes(self) -> Integers:
        """Bytes of the payload of each message."""
        return (self.heads["length"] - np.uint64(_FIXED_BYTES)).astype(np.int64)

    @cached_property
    def firsts(self) -> Mapping[int, int]:
        """The first message of each channel, in their order."""
        if len(self) < _FEW:
            return {int(self.heads["channel"][0]): 0} if len(self) else {}
        channels, firsts = np.unique(self.heads["channel"], return_index=True)
        order = np.argsort(firsts)
        return dict(zip(channels[order].tolist(), firsts[order].tolist(), strict=True))

    def counts(self) -> Mapping[int, int]:
        """Return how many messages each channel has, in the order in which they first come."""
        if len(self) < _FEW:
            return dict.fromkeys(self.firsts, 1)
        counts = np.bincount(self.heads["channel"])
        return {channel: int(counts[channel]) for channel in self.firsts}

    def of_channel(self, channel: int) -> Integers:
        """Return which messages are of this channel."""
        return np.flatnonzero(self.heads["channel"] == channel)

    def messages(self, channels: Collection[int] | None = None) -> Iterator[Message]:
        """Yield the messages of these channels, or all, as objects."""
        chosen = slice(None) if channels is None else np.isin(self.heads["channel"], list(channels))
        heads = self.heads[chosen]
        fields = (heads[name].tolist() for name in ("channel", "sequence", "log_time_ns", "published_ns"))
        places = (self.begins[chosen].tolist(), self.sizes[chosen].tolist())
        for channel, sequence, log_time, published, begin, size in zip(*fields, *places, strict=True):
            yield Message(channel, log_time, self.data[begin : begin + size], published, sequence)


def rows_at(data: bytes, begins: Integers, size: int) -> npt.NDArray[np.uint8]:
    """Return the `size` bytes from each place on, as an array of a row each."""
    if not len(begins) or not size:
        return np.empty((len(begins), size), np.uint8)
    windows = np.lib.stride_tricks.sliding_window_view(np.frombuffer(data, np.uint8), size)
    return np.asarray(windows[begins], np.uint8)


NO_MESSAGES = MessageColumns.of_places(b"", [])
