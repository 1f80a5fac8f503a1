"""Messages of a bag: decoded one by one in the order of their log times, or as bytes, topic by topic."""

import heapq
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.bag.mcap_library import Channel, Schema
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.message_decoding import Decoder
from mauve_rt.trace.reading.facts import OWN_TYPES, Message
from mauve_rt.trace.reading.stored_messages import IsWanted, PackedData, StoredMessages

_DISORDER_NS = 2_000_000_000  # messages of a bag are in order of log time but for the queues they waited in
_LATEST = np.iinfo(np.int64).max


class MessageTypes:
    """What reads the messages of a bag, by the definitions in it."""

    def __init__(self) -> None:
        """Know no definition yet."""
        self._decoders: dict[tuple[str, bytes], Decoder] = {}

    def decoder(self, channel: Channel, schema: Schema | None) -> Decoder:
        """Return what reads the messages of a channel.

        Raises:
            TraceError: the definition is not what it should be.

        """
        if schema is None or schema.encoding != "ros2msg" or channel.message_encoding != "cdr":
            msg = f"topic {channel.topic}: expected CDR with a ros2msg definition"
            raise TraceError(msg)
        key = (schema.name, schema.data)
        if key not in self._decoders:
            try:
                self._decoders[key] = Decoder(schema.name, schema.data.decode())
            except ValueError as error:
                raise _unreadable(channel.topic, schema.name, error) from error
        return self._decoders[key]

    def decoded(self, channel: Channel, schema: Schema | None, data: bytes) -> Any:
        """Return a message as an object.

        Raises:
            TraceError: the definition or the message is not what it should be.

        """
        decoder = self.decoder(channel, schema)
        try:
            return decoder.decode(data)
        except ValueError as error:
            raise _unreadable(channel.topic, "" if schema is None else schema.name, error) from error


class Payloads(NamedTuple):
    """Some messages of one topic, in the order of the file."""

    topic: str
    type_name: str
    """As the bag calls it."""
    decoder: Decoder
    log_time_ns: npt.NDArray[np.int64]
    """CLOCK_REALTIME"""
    monotonic_ns: npt.NDArray[np.int64]
    data: PackedData

    def decoded(self, index: int) -> Any:
        """Return one of them as an object.

        Raises:
            TraceError: it is no message of the type.

        """
        try:
            return self.decoder.decode(self.data.one(index))
        except ValueError as error:
            raise _unreadable(self.topic, self.type_name, error) from error


PayloadSource = Callable[[tuple[str, ...]], Iterator[Payloads]]
"""Yields the messages of topics, or of types."""


def messages(
    files: Sequence[StoredMessages], topics: tuple[str, ...], pairs: npt.NDArray[np.int64]
) -> Iterator[Message]:
    """Yield decoded messages by log time.

    Raises:
        TraceError: a file, or a message, cannot be read.

    """
    types = MessageTypes()
    waiting: list[tuple[int, int, Message]] = []
    count = 0
    for file in files:
        for channel, schema, log_time_ns, published_ns, data in file.messages(_wanted(topics)):
            said = types.decoded(channel, schema, data)
            one = Message(channel.topic, log_time_ns, monotonic_ns(published_ns, pairs), said)
            heapq.heappush(waiting, (log_time_ns, count, one))
            count += 1
            while waiting[0][0] < log_time_ns - _DISORDER_NS:
                yield heapq.heappop(waiting)[-1]
    while waiting:
        yield heapq.heappop(waiting)[-1]


def payloads(
    files: Sequence[StoredMessages], topics: tuple[str, ...], pairs: npt.NDArray[np.int64]
) -> Iterator[Payloads]:
    """Yield the messages of these topics as bytes, some megabytes of a file at a time.

    Raises:
        TraceError: a file, or the definition of a topic, cannot be read.

    """
    types = MessageTypes()
    for file in files:
        for channel, schema, logged, published, data in file.blocks(_wanted(topics)):
            decoder = types.decoder(channel, schema)
            if max(logged.max(), published.max()) > _LATEST:
                msg = f"topic {channel.topic}: a message has a time that no clock shows"
                raise TraceError(msg)
            log_time_ns, published_ns = logged.astype(np.int64), published.astype(np.int64)
            monotonic = published_ns - _ahead_ns(published_ns, pairs)
            type_name = "" if schema is None else schema.name
            yield Payloads(channel.topic, type_name, decoder, log_time_ns, monotonic, data)


def monotonic_ns(published_ns: int, pairs: npt.NDArray[np.int64]) -> int:
    """Undo the recorder's mapping: it used the pair of the drain that followed the message."""
    return published_ns - int(_ahead_ns(published_ns, pairs))


def _wanted(topics: tuple[str, ...]) -> IsWanted:
    """All but the trace's own topics where none is named."""
    if not topics:
        return lambda _, type_name: type_name not in OWN_TYPES
    return lambda topic, type_name: topic in topics or type_name in topics


def _ahead_ns(published_ns: Any, pairs: npt.NDArray[np.int64]) -> Any:
    """How far CLOCK_REALTIME was ahead of CLOCK_MONOTONIC at a time of publishing, or at each of several."""
    if not len(pairs):
        return 0
    index = np.minimum(np.searchsorted(pairs[:, 1], published_ns), len(pairs) - 1)
    return pairs[index, 1] - pairs[index, 0]


def _unreadable(topic: str, type_name: str, error: ValueError) -> TraceError:
    return TraceError(f"topic {topic}: a message cannot be read as {type_name} ({error})")
