"""The begin of a bag that the limit of its size deleted, as the custom data of the bag reports it."""

import json
from collections.abc import Mapping
from typing import NamedTuple

from mauve_rt.counts import counted

DELETED = "mauve_deleted"
"""Key in the custom data of metadata.yaml: a JSON object, what the limit of the bag's size deleted."""


class Deleted(NamedTuple):
    """The begin of a recording, which the limit of the bag's size deleted. Times: log times."""

    max_bytes: int
    """The limit."""
    files: int = 0
    records: int = 0
    messages: int = 0
    """Of the topics in the ledger."""
    from_ns: int = 0
    until_ns: int = 0
    last_file: str = ""
    """Name of the newest deleted file."""

    @property
    def text(self) -> str:
        """One sentence."""
        span = _span_text((self.until_ns - self.from_ns) / 1e9)
        what = f"{counted(self.records, 'record')} and {counted(self.messages, 'message')}"
        files = counted(self.files, "file")
        return f"the first {span} were deleted by max_size_bytes ({self.max_bytes:,}): {files} with {what}"

    def is_of(self, file: str) -> bool:
        """Whether a file of that name was deleted: it is there only if a kill came before the deletion."""
        return bool(self.last_file) and (len(file), file) <= (len(self.last_file), self.last_file)


def deleted_of(custom_data: Mapping[str, str]) -> Deleted | None:
    """Return what the custom data of a bag says was deleted; None: nothing."""
    try:
        deleted = Deleted(**json.loads(custom_data[DELETED]))
        is_ours = bool(deleted.text)  # values of other types give no text
    except (KeyError, ValueError, TypeError):  # nothing, or somebody else wrote it
        return None
    return deleted if is_ours else None


def _span_text(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{seconds:.1f} s"
