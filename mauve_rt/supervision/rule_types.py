"""The message types that a rules file names, held against what is installed."""

from typing import Any

from mauve_rt.parts.message_types import message_class
from mauve_rt.supervision.rules import RulesFile


def heard_type(file: RulesFile, index: int) -> Any:
    """The message class that the rule of that index listens to.

    Raises:
        ArchitectureFileError: it is not installed.
    """
    name = file.rules.rules[index].when.silence.type
    found = message_class(name)
    if found is None:
        raise file.error(
            ("rules", index, "when", "silence", "type"),
            f"message type {name} is not installed",
            remedy="source the workspace that has it, or correct the name",
        )
    return found
