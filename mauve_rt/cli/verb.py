"""What a verb of `mauve` is, and how one is run."""

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from mauve_rt.cli.pipe import PIPE_CLOSED, piped
from mauve_rt.cli.plain_output import plain_output
from mauve_rt.errors import MauveError, one_line
from mauve_rt.node.shared.failures import report_failure
from mauve_rt.trace.errors import TraceError

OK, REFUSED, BAD_USAGE, NOT_PROVED, FORECAST, REFUTED, INTERRUPTED = 0, 1, 2, 3, 4, 5, 130
EXIT_STATUSES: Mapping[int, str] = {
    OK: "done",
    REFUSED: "the executor refused the request; or a check found an error; or `analyze`: not schedulable",
    BAD_USAGE: "bad usage, a file that cannot be read, or no such executor",
    NOT_PROVED: "`analyze` proves neither that the architecture is schedulable nor that it is not",
    FORECAST: "`analyze`: each deadline is met if no time is above the measured one: no proof",
    REFUTED: "`analyze`: a recording shows more than the bounds allow",
    INTERRUPTED: "interrupted from the keyboard",
    PIPE_CLOSED: "the reader of the output closed the pipe",
}


@dataclass(frozen=True)
class Verb:
    """One verb of the command, or of a verb that has some of its own."""

    name: str
    help: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    main: Callable[[argparse.Namespace], int]


def run(verb: Verb, args: argparse.Namespace) -> int:
    """Run a verb, under `mauve` or `ros2 mauve`; returns the exit status, errors are told on stderr."""
    with plain_output():
        return piped(lambda: _run(verb, args))


def _run(verb: Verb, args: argparse.Namespace) -> int:
    try:
        return verb.main(args)
    except (MauveError, TraceError) as error:
        print(f"mauve: {one_line(str(error))}", file=sys.stderr)
        return BAD_USAGE
    except KeyboardInterrupt:
        return INTERRUPTED
    except (BrokenPipeError, ImportError):
        raise  # the reader of the output is gone; the environment is not loaded: the caller reports it
    except Exception as error:  # noqa: BLE001 - no traceback reaches the user of a verb
        report_failure("mauve", error)
        return BAD_USAGE
