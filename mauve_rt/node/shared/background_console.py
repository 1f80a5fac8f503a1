"""Log lines on the console, written by a thread of their own: a terminal that is not read blocks nothing."""

from collections.abc import Sequence
from typing import Any

import rclpy

from mauve_rt._bridge import flush_console, start_console

_NO_CONSOLE, _CONSOLE = "--disable-stdout-logs", "--enable-stdout-logs"
_LAST_LINES_NS = 300_000_000  # that a reader may take for what is not written yet


def init_logging_apart(arguments: Sequence[str], **options: Any) -> None:
    """As rclpy.init(args=arguments, **options); the console as they say, in the background."""
    asked = [word for word in arguments if word in (_NO_CONSOLE, _CONSOLE)]
    rclpy.init(args=[*arguments, "--ros-args", _NO_CONSOLE], **options)
    if asked[-1:] != [_NO_CONSOLE]:
        start_console()


def last_lines() -> bool:
    """Wait until all lines are on the console, for a moment; False: the console is not read."""
    return flush_console(_LAST_LINES_NS)
