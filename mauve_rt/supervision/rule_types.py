"""The message types that a rules file names, held against what is installed."""

from typing import Any

from mauve_rt.errors import ArchitectureFileError
from mauve_rt.parts.message_types import message_class
from mauve_rt.supervision.rule_names import leaf_findings
from mauve_rt.supervision.rules import RulesFile, lacks_type
from mauve_rt.supervision.when import When


def heard_type(file: RulesFile, leaf: When) -> Any:
    """The message class of the topic that a condition listens to.

    Raises:
        ArchitectureFileError: it is not told or not installed, or has no such field that is a number.
    """
    found = [file.untyped(leaf)] if lacks_type(leaf) else list(leaf_findings(file, leaf))
    if found:
        raise ArchitectureFileError(file.path, found)
    return message_class(leaf.parameters["type"])
