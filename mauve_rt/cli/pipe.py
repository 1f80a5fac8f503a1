"""Output into a pipe whose reader went away, as of `mauve list | head -1`: the end of the work, no error."""

import os
import select
import sys
from collections.abc import Callable
from typing import TextIO

PIPE_CLOSED = 141
"""As a shell tells of a program that SIGPIPE ended: 128 + 13."""


def piped(work: Callable[[], int]) -> int:
    """Do what writes to stdout and stderr; returns its status, or PIPE_CLOSED when nobody reads any more.

    Not left to SIGPIPE: that would end a verb in the middle of a file or of a request.
    """
    try:
        try:
            return work()
        finally:  # argparse leaves by SystemExit
            for stream in _streams():
                stream.flush()
    except BrokenPipeError:
        broken = [stream for stream in _streams() if _nobody_reads(stream)]
        if not broken:
            raise  # another pipe
        for stream in broken:
            _send_nowhere(stream)
        return PIPE_CLOSED


def _streams() -> list[TextIO]:
    """None of them where it was closed from the start."""
    return [stream for stream in (sys.stdout, sys.stderr) if stream is not None]


def _nobody_reads(stream: TextIO) -> bool:
    poll = select.poll()
    poll.register(stream.fileno(), 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))


def _send_nowhere(stream: TextIO) -> None:
    """What is still in the buffer too: the interpreter writes it at its exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
