"""What a check reports, and the computer that a check examines."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path


class Status(StrEnum):
    """How bad a finding is. An error keeps an executor from working, a warning makes it work worse."""

    OK = "ok"
    WARNING = "warning"
    ERROR = "error"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One line of the report."""

    status: Status
    found: str
    cost: str = ""
    """The effect on an executor."""
    remedy: str = ""
    """A command, or the page that has it."""
    name: str = ""
    """The check's, which the caller of a check fills in."""


def ok(found: str) -> Finding:
    """Report that nothing is wrong."""
    return Finding(status=Status.OK, found=found)


def warning(found: str, *, cost: str, remedy: str) -> Finding:
    """Report what makes an executor work worse."""
    return Finding(status=Status.WARNING, found=found, cost=cost, remedy=remedy)


def error(found: str, *, cost: str, remedy: str) -> Finding:
    """Report what keeps an executor from working."""
    return Finding(status=Status.ERROR, found=found, cost=cost, remedy=remedy)


@dataclass(frozen=True)
class Computer:
    """The files that checks read: those of this computer, or of a tree that stands for one."""

    root: Path = Path("/")

    def path(self, path: str) -> Path:
        """A file or folder of the computer, by its absolute path."""
        return self.root / path.removeprefix("/")

    def text(self, path: str) -> str:
        """The text of a file without the space at its ends.

        Raises:
            OSError: it cannot be read.
        """
        return self.path(path).read_text("utf-8", errors="replace").strip()

    def text_or(self, path: str, default: str) -> str:
        """As text(), of a file that may be missing."""
        return self.text(path) if self.path(path).exists() else default
