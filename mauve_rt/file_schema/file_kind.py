"""The kinds of files of ours."""

from enum import Enum


class FileKind(Enum):
    """The files that MAUVE RT reads."""

    ARCHITECTURE = "architecture"
    RULES = "rules"
    STEPS = "steps"
    MODEL = "model"
