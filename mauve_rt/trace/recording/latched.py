"""The last messages of latched topics, for the begin of a file or of a snapshot."""

from collections import deque
from collections.abc import Iterator

from mauve_rt.trace.bag.recorded import SentMessage

_KEPT_MESSAGES, _KEPT_BYTES = 16, 8 * 1024 * 1024  # of each topic


class LatchedMessages:
    """The last 16 different messages of each latched topic, 8 MiB at most: the senders are not known."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._kept: dict[str, deque[SentMessage]] = {}

    def keep(self, message: SentMessage) -> None:
        """Keep a message, if its topic is latched."""
        if message.qos is None or not message.qos.transient_local:
            return
        kept = self._kept.setdefault(message.topic, deque(maxlen=_KEPT_MESSAGES))
        for same in [one for one in kept if one.data == message.data]:
            kept.remove(same)
        kept.append(message)
        while len(kept) > 1 and sum(len(one.data) for one in kept) > _KEPT_BYTES:
            kept.popleft()

    def __iter__(self) -> Iterator[SentMessage]:
        """Yield the messages, topic by topic."""
        for kept in self._kept.values():
            yield from kept
