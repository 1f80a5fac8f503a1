"""Types of arguments that several verbs have."""

import argparse
import re
from collections.abc import Callable

from mauve_rt.cli.completion import complete_executors, complete_values, completed_by


def absolute_name(name: str) -> str:
    """A node's name with its leading '/'."""
    absolute = "/" + name.strip("/")
    if not re.fullmatch(r"(/[A-Za-z_]\w*)+", absolute, re.ASCII):
        raise argparse.ArgumentTypeError(f"expected a node's name such as /robot_1/executor, found {name}")
    return absolute


def positive_rate(most_hz: float) -> Callable[[str], float]:
    """A number of times a second: above 0, and at most `most_hz`."""

    def rate(text: str) -> float:
        try:
            hertz = float(text)
        except ValueError:
            hertz = 0.0
        if not 0 < hertz <= most_hz:
            raise argparse.ArgumentTypeError(f"expected Hz above 0 and at most {most_hz:g}, found {text!r}")
        return hertz

    return rate


def add_executor(parser: argparse.ArgumentParser) -> None:
    """The executor that a verb is about."""
    name = parser.add_argument(
        "executor", type=absolute_name, help="the executor's node, e.g. /robot_1/executor"
    )
    completed_by(name, complete_executors)


def add_executor_and_json(parser: argparse.ArgumentParser) -> None:
    """As add_executor(), of a verb that prints a reply."""
    add_executor(parser)
    parser.add_argument("--json", action="store_true", help="print the reply as JSON")


def take_negative_numbers(parser: argparse.ArgumentParser) -> None:
    """Take `-1e-3` and `-.inf` for numbers, as argparse takes `-1`: Python 3.11 takes them for options."""
    parser._negative_number_matcher = re.compile(  # noqa: SLF001 - argparse offers no other way
        r"-(\d[\d_]*\.?\d*|\.\d+)([eE][-+]?\d+)?$|-\.(inf|Inf|INF)$"
    )


def add_value(parser: argparse.ArgumentParser, what: str, *, nargs: str | None = None) -> None:
    """The resource or port whose value a verb is about."""
    default = "" if nargs == "?" else None
    completed_by(parser.add_argument("value", help=what, nargs=nargs, default=default), complete_values)
