"""How a bag reports the messages and records that it lacks: entries in the custom data of metadata.yaml."""

import json
from collections.abc import Mapping
from typing import NamedTuple

DROPPED_MESSAGES = "mauve_dropped_messages"
"""Key in the custom data of metadata.yaml: messages given to record() that did not get into the bag."""
LEDGER = "mauve_topics"
"""Key in the custom data of metadata.yaml: a JSON object of each topic's Entry. What is in the bag of it is
`received - lost + repeated - deleted` messages."""
INTERRUPTIONS = "mauve_interruptions"
"""Key in the custom data of metadata.yaml: a JSON list of each Interruption."""
SNAPSHOT = "mauve_snapshot"
"""Key in the custom data of metadata.yaml: a JSON object, the Snapshot that the bag is."""


class Entry(NamedTuple):
    """One topic in the ledger of a bag."""

    received: int = 0
    """Messages that came and were to be recorded."""
    lost: int = 0
    """Of these, not in the bag."""
    repeated: int = 0
    """Messages of a latched topic that later files begin with, as well."""
    lost_before: int = 0
    """Of a topic of other nodes: messages that were sent and did not come, as far as that is known."""
    numbered: bool | None = None
    """Of a topic of other nodes: whether its messages are numbered, so that gaps are known. Else null."""
    deleted: int = 0
    """Of the messages in the bag, those that were in files that the limit of the bag's size deleted."""

    @property
    def recorded(self) -> int:
        """What the bag has of it."""
        return self.received - self.lost + self.repeated - self.deleted

    def since(self, before: "Entry") -> "Entry":
        """Return what came after `before`, an earlier entry of the same recording."""
        return self._replace(
            received=self.received - before.received,
            lost=self.lost - before.lost,
            lost_before=self.lost_before - before.lost_before,
        )

    def plus(self, other: "Entry") -> "Entry":
        """Return both together: of a topic that is recorded twice, in one bag or in several."""
        known = {self.numbered, other.numbered} - {None}
        return Entry(
            self.received + other.received,
            self.lost + other.lost,
            self.repeated + other.repeated,
            self.lost_before + other.lost_before,
            all(known) if known else None,
            self.deleted + other.deleted,
        )


def ledger_of(custom_data: Mapping[str, str]) -> dict[str, Entry]:
    """Return what the custom data of a bag tells of each topic; nothing in a bag of an earlier version."""
    try:
        told = json.loads(custom_data.get(LEDGER, "{}"))
        return {topic: Entry(**fields) for topic, fields in told.items()}
    except (ValueError, TypeError, AttributeError):  # somebody else wrote it
        return {}


class Interruption(NamedTuple):
    """A time in which nothing got into the bag."""

    reason: str
    from_ns: int
    """CLOCK_REALTIME."""
    until_ns: int = 0
    """0: the bag ends with it."""
    records: int = 0
    """Trace records that are not in the bag; messages are in the ledger."""


class Snapshot(NamedTuple):
    """The last seconds of a recording into memory, written as a bag on request. Times: CLOCK_REALTIME."""

    asked_s: float
    """So many of the last seconds a recording keeps."""
    from_ns: int
    until_ns: int
    max_bytes: int
    """The limit of the memory."""
    is_short: bool
    """The memory was full: it held fewer seconds."""
    is_complete: bool = False
    """All of it is in the bag."""

    @property
    def text(self) -> str:
        """One sentence."""
        held = f"snapshot of {(self.until_ns - self.from_ns) / 1e9:.1f} s"
        if not self.is_short:
            return held
        return f"{held}: the memory (snapshot_bytes, {self.max_bytes:,}) holds no more of {self.asked_s:g} s"


def snapshot_of(custom_data: Mapping[str, str]) -> Snapshot | None:
    """Return the snapshot that a bag is; None: it is none."""
    try:
        snapshot = Snapshot(**json.loads(custom_data[SNAPSHOT]))
        is_ours = bool(snapshot.text)  # values of other types give no text
    except (KeyError, ValueError, TypeError):  # none, or somebody else wrote it
        return None
    return snapshot if is_ours else None
