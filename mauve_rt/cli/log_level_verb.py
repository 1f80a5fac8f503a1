"""`mauve log-level NODE COMPONENT|RESOURCE [LEVEL]`: from which level on log lines are kept."""

import argparse
import sys

from mauve_rt.cli.arguments import add_executor
from mauve_rt.cli.completion import complete_components, completed_by
from mauve_rt.cli.verb import OK, REFUSED

CHOICES = ("debug", "info", "warn", "error", "fatal")  # a command starts without the kernel, which has them


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve log-level`."""
    add_executor(parser)
    completed_by(parser.add_argument("part", help="name of the component or resource"), complete_components)
    parser.add_argument("level", nargs="?", choices=CHOICES, help="the new level; without it the present one")


def main(args: argparse.Namespace) -> int:
    """Set a level, or print it."""
    from rcl_interfaces.msg import LoggerLevel  # noqa: PLC0415 - ROS takes its time to load
    from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels  # noqa: PLC0415

    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.interfaces.log_messages import LEVELS, SEVERITIES, logger_name  # noqa: PLC0415

    logger = logger_name(args.executor, args.part)
    with connected(first=True) as client:
        if args.level is not None:
            wanted = LoggerLevel(name=logger, level=SEVERITIES[args.level])
            request = SetLoggerLevels.Request(levels=[wanted])
            result = client.call(SetLoggerLevels, f"{args.executor}/set_logger_levels", request).results[0]
            if not result.successful:
                print(f"refused: {result.reason}", file=sys.stderr)
                return REFUSED
        reply = client.call(
            GetLoggerLevels, f"{args.executor}/get_logger_levels", GetLoggerLevels.Request(names=[logger])
        )
    print(f"{args.part}: {LEVELS.get(reply.levels[0].level, 'not set')}")
    return OK
