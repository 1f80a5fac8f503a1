"""Typed errors. Every one is a `MauveError`: code, place, what was expected and found, what to do."""

import errno
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

try:
    from mauve_rt._kernel import MauveError
except ImportError:  # reading a bag needs no native library; other modules fail at their own import

    class MauveError(Exception):  # type: ignore[no-redef]
        """Any error of the project."""


__all__ = [
    "ArchitectureFileError",
    "MauveError",
    "ParameterError",
    "PluginError",
    "Problem",
    "error_code",
    "exception_text",
    "one_line",
    "valid_text",
]


class PluginError(MauveError):
    """A plug-in that is not installed, cannot be loaded or is declared wrongly. `code` is "plugin"."""

    def __init__(self, text: str, *, element: str = "", remedy: str = "") -> None:
        super().__init__(f"{text}; {remedy}" if remedy else text)
        _describe(self, code="plugin", element=element, remedy=remedy)


class ParameterError(MauveError):
    """A parameter or argument of the command line that cannot be used. `code` is "invalid_argument"."""

    def __init__(self, text: str, *, element: str = "") -> None:
        super().__init__(text)
        _describe(self, code="invalid_argument", element=element)


class PortTypeError(MauveError):
    """A port whose type a core in Python cannot serve. `code` is "type_mismatch"."""

    def __init__(self, port: str, type_name: str, *, core: str) -> None:
        what = f"core {core} is written in Python, which has no class for the port's type"
        element, expected = f"port {port}", "an installed ROS message"
        remedy = "write the core in C++, or give the port such a type"
        super().__init__(f"{element}: {what}: expected {expected}, found {type_name}; {remedy}")
        self.statement, self.component = what, ""
        facts = {"element": element, "expected": expected, "found": type_name, "remedy": remedy}
        _describe(self, code="type_mismatch", **facts)


class TopicError(MauveError):
    """A topic that a resource cannot be bound to, because of another message type on it."""

    def __init__(self, topic: str, resource: str, *, expected: str, found: str) -> None:
        what = f"resource '{resource}': topic {topic} carries another type already"
        remedy = "bind the resource to another topic, or give it that type"
        super().__init__(f"{what}: expected {expected}, found {found}; {remedy}")
        _describe(self, code="type_mismatch", element=topic, expected=expected, found=found, remedy=remedy)


@dataclass(frozen=True, kw_only=True)
class Problem:
    """One thing wrong in an architecture file. Lines and columns count from 1."""

    line: int
    column: int
    what: str
    expected: str = ""
    found: str = ""
    remedy: str = ""
    component: str = ""
    element: str = ""
    code: str = "invalid_argument"

    def text(self) -> str:
        """One line without the place: `what: expected ..., found ...; remedy`."""
        facts = [f"expected {self.expected}"] if self.expected else []
        if self.found:
            facts.append(f"found {self.found}")
        text = self.what + (": " + ", ".join(facts) if facts else "")
        return one_line(f"{text}; {self.remedy}" if self.remedy else text)


class ArchitectureFileError(MauveError):
    """An architecture file that cannot be used.

    `str()` is one line about the first problem, `FILE:LINE:COLUMN: what (component.element): expected ...,
    found ...; remedy`; `problems` has all that were found, in the order of the file.
    """

    file: Path
    line: int
    column: int
    problems: tuple[Problem, ...]

    def __init__(self, file: Path, problems: Sequence[Problem]) -> None:
        self.problems = tuple(sorted(problems, key=lambda problem: (problem.line, problem.column)))
        first = self.problems[0]
        super().__init__(self.render(file, first))
        self.file, self.line, self.column = file, first.line, first.column
        _describe(
            self,
            code=first.code,
            component=first.component,
            element=first.element,
            expected=first.expected,
            found=first.found,
            remedy=first.remedy,
        )

    @staticmethod
    def render(file: Path, problem: Problem) -> str:
        """The line that tells of one problem."""
        return f"{file}:{problem.line}:{problem.column}: {problem.text()}"

    def lines(self) -> list[str]:
        """One line for every problem."""
        return [self.render(self.file, problem) for problem in self.problems]


def error_code(error: BaseException) -> str:
    """The code of an error: of a `MauveError` its own, of anything else "internal"."""
    return str(getattr(error, "code", "internal")) if isinstance(error, MauveError) else "internal"


def exception_text(error: BaseException) -> str:
    """`ValueError: what it says` in one line of valid Unicode, whatever was raised."""
    try:
        text = str(error)
    except BaseException as second:  # noqa: BLE001 - of an exception that somebody else wrote
        text = f"its text cannot be had ({type(second).__name__})"
    return one_line(f"{type(error).__name__}: {text}")


def internal_error_text(error: BaseException) -> str:
    """What a requester is told of an unforeseen exception; what the system lacks is no internal error."""
    if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
        return (
            f"no file descriptor is left ({one_line(str(error))}): raise the limit of the process "
            "(ulimit -n, LimitNOFILE= of systemd)"
        )
    return f"internal error: {exception_text(error)}"


def one_line(text: str) -> str:
    """The text, in valid Unicode, with every run of white space made one blank."""
    return valid_text(" ".join(text.split()))


def valid_text(text: str) -> str:
    """The text with lone surrogates, which neither ROS messages nor bags can have, written out."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _describe(
    error: MauveError,
    *,
    code: str,
    component: str = "",
    element: str = "",
    expected: str = "",
    found: str = "",
    remedy: str = "",
) -> None:
    error.code = code
    error.component = component
    error.element = element
    error.expected = expected
    error.found = found
    error.remedy = remedy
