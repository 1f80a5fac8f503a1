"""Types of arguments that several verbs have."""

import argparse
import re
from collections.abc import Callable


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
