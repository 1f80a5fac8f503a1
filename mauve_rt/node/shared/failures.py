"""Unexpected exceptions of a program, reported as one line with a remedy. Knows no ROS.

A user sees no traceback. A developer sets MAUVE_TRACEBACK=1, and the traceback follows the line.
"""

import errno
import os
import resource
import sys
import traceback
from pathlib import Path
from types import TracebackType

TRACEBACK = "MAUVE_TRACEBACK"
_TOO_MANY_FILES = (errno.EMFILE, errno.ENFILE)
_FULL = (errno.ENOSPC, errno.EDQUOT)
_NOT_ALLOWED = (errno.EACCES, errno.EPERM, errno.EROFS)


def report_failure(program: str, error: BaseException) -> None:
    """Print one line about an exception on stderr, and its traceback where MAUVE_TRACEBACK is set."""
    stream = sys.stderr
    if stream is None:
        return
    stream.write(f"{program}: {failure_text(error)}\n")
    if os.environ.get(TRACEBACK):
        traceback.print_exception(error, file=stream)
    stream.flush()


def report_uncaught(program: str) -> None:
    """Have the interpreter report each exception that ends the program or a thread as report_failure does."""

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, trace)
        else:
            report_failure(program, error)

    sys.excepthook = hook


def failure_text(error: BaseException) -> str:
    """What was wrong and what to do, in one line."""
    from mauve_rt.errors import MauveError, exception_text, one_line  # noqa: PLC0415 - loads the kernel

    if isinstance(error, MauveError):
        return one_line(str(error))
    if isinstance(error, MemoryError):
        return "there is not enough memory for it. Free memory, or raise the limit (ulimit -v)."
    if isinstance(error, OSError) and error.errno is not None:
        return one_line(_of_system(error))
    return one_line(f"unexpected error: {exception_text(error)}{_place(error)}. {_report()}")


def _of_system(error: OSError) -> str:
    what = f"{error.filename}: {error.strerror}" if error.filename is not None else str(error.strerror)
    if error.errno in _TOO_MANY_FILES:
        return f"{what}. {more_open_files()}"
    if error.errno in _FULL:
        return f"{what}. Free space there, or choose another folder."
    if error.errno in _NOT_ALLOWED and error.filename is not None:
        return f"{what}. Give this account the right, or choose another path."
    return f"unexpected error: {what}{_place(error)}. {_report()}"


def more_open_files() -> str:
    """How to let a process open more files."""
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    allow = "Allow more: ulimit -n 1024; in a systemd service LimitNOFILE=1024."
    return f"This process may open {soft} files. {allow}"


def _place(error: BaseException) -> str:
    frames = traceback.extract_tb(error.__traceback__)
    return f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""


def _report() -> str:
    given = "the traceback below" if os.environ.get(TRACEBACK) else f"the output with {TRACEBACK}=1"
    return f"Please report this with {given}."
