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
