"""`mauve dev NODE --build COMMAND`: build, test and reload code at each save, while the executor runs."""

import argparse
import sys
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from mauve_rt.cli.arguments import add_executor
from mauve_rt.cli.completion import complete_components, completed_by
from mauve_rt.cli.verb import BAD_USAGE, OK, REFUSED

if TYPE_CHECKING:
    from mauve_rt.cli.client import Client
    from mauve_rt.cli.dev_cycle import Development
    from mauve_rt.cli.dev_executor import DevExecutor
    from mauve_rt.cli.dev_sources import Sources

_PROBATION_S = 10.0
_REFRESH_S = 0.25
_FIRST_S = 5.0  # for a first answer, with --once


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve dev`."""
    add_executor(parser)
    parser.add_argument(
        "--build", required=True, metavar="COMMAND", help="command of the shell that builds the code"
    )
    parser.add_argument(
        "--test",
        default="",
        metavar="COMMAND",
        help="command that tests the build; a failure prevents the reload",
    )
    parser.add_argument(
        "--watch",
        nargs="+",
        action="extend",
        default=[],
        type=Path,
        metavar="PATH",
        help="folders or files whose sources are watched (default: the current folder)",
    )
    targets = parser.add_argument(
        "--target",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="packages or components whose code is loaded anew (default: all that was rebuilt)",
    )
    completed_by(targets, complete_components)
    parser.add_argument(
        "--probation",
        type=_seconds,
        default=_PROBATION_S,
        metavar="S",
        help=f"seconds in which a violation puts the old code back (default {_PROBATION_S:g}; 0: none)",
    )
    parser.add_argument(
        "--revert-on",
        nargs="+",
        action="extend",
        default=[],
        metavar="VIOLATION",
        help="violations that put the old code back: fault, overrun, over_declared, nan, or "
        "{output: COMPONENT.PORT.FIELD, minimum: X, maximum: Y}, where COMPONENT. may be left out "
        "(default: fault and nan)",
    )
    parser.add_argument(
        "--once", action="store_true", help="build, test and reload the present sources, and end"
    )
    parser.add_argument(
        "--plain", action="store_true", help="print one line for each event, as without a terminal"
    )


def main(args: argparse.Namespace) -> int:
    """Until q or Ctrl-C. With --once: 0 when the new code passed, or when no code has changed."""
    from mauve_rt.cli.client import connected  # noqa: PLC0415 - ROS takes its time to load
    from mauve_rt.cli.dev_cycle import Development, Plan  # noqa: PLC0415
    from mauve_rt.cli.dev_executor import DevExecutor, Trial  # noqa: PLC0415
    from mauve_rt.cli.dev_sources import Sources  # noqa: PLC0415

    has_screen = not (args.plain or args.once) and sys.stdin.isatty() and sys.stdout.isatty()
    sources = Sources(args.watch or [Path()])
    with connected(first=True) as client:
        trial = Trial(args.target, args.probation, args.revert_on)
        executor = DevExecutor(client, args.executor, trial)
        plan = Plan(args.build, args.test, args.probation)
        development = Development(plan, executor, tell=_ignore if has_screen else _print_event)
        status = OK
        try:
            if args.once:
                status = _run_once(client, executor, development)
            elif has_screen:
                _show(client, executor, development, sources)
            else:
                _print_event(f"watching {sources.count} files")
                _follow(client, executor, development, sources, _continue)
            if executor.refusal:
                print(f"dev: {executor.name} would refuse the reload: {executor.refusal}", file=sys.stderr)
                return BAD_USAGE
        except KeyboardInterrupt:
            pass
        finally:
            development.end()
    return status


def _run_once(client: "Client", executor: "DevExecutor", development: "Development") -> int:
    from mauve_rt.cli.client import NoExecutorError  # noqa: PLC0415

    begun_s = time.monotonic()
    while not executor.is_there or executor.refusal is None:
        if time.monotonic() >= begun_s + _FIRST_S:
            raise NoExecutorError(f"no answer from {executor.name}; see mauve nodes")
        client.spin()
        executor.look()
    if executor.refusal:
        return BAD_USAGE
    development.again()
    while development.is_busy:
        client.spin()
        development.look()
    return OK if development.cycles[-1].is_good else REFUSED


def _follow(
    client: "Client",
    executor: "DevExecutor",
    development: "Development",
    sources: "Sources",
    goes_on: Callable[[], bool],
) -> None:
    while goes_on() and not executor.refusal:
        client.spin()
        if (save := sources.look()) is not None:
            development.save(save)
        development.look()


def _show(client: "Client", executor: "DevExecutor", development: "Development", sources: "Sources") -> None:
    """Until a key ends it."""
    from rich.live import Live  # noqa: PLC0415 - takes its time to load

    from mauve_rt.cli.dev_view import dev_view  # noqa: PLC0415
    from mauve_rt.cli.keys import keys_at_once, pressed_keys  # noqa: PLC0415
    from mauve_rt.cli.views import console  # noqa: PLC0415

    with keys_at_once(), Live(console=console(), screen=True, auto_refresh=False) as live:
        shown_s = 0.0

        def goes_on() -> bool:
            nonlocal shown_s
            keys = [*pressed_keys()]
            if any(not press(key, development) for key in keys):
                return False
            if keys or time.monotonic() >= shown_s + _REFRESH_S:
                view = dev_view(executor.name, is_there=executor.is_there, development=development)
                live.update(view, refresh=True)
                shown_s = time.monotonic()
            return True

        _follow(client, executor, development, sources, goes_on)


def press(key: str, development: "Development") -> bool:
    """Do what a key stands for; False: leave."""
    if key == "b":
        development.back()
    elif key == "r":
        development.again()
    return key != "q"


def _continue() -> bool:
    return True


def _ignore(_line: str) -> None:
    """The screen shows the cycles."""


def _print_event(line: str) -> None:
    print(f"{datetime.now().astimezone():%H:%M:%S.%f} {line}", flush=True)


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = -1.0
    if not 0 <= seconds <= 3600:  # noqa: PLR2004 - an hour
        raise argparse.ArgumentTypeError(f"expected seconds from 0 to 3600, found {text!r}")
    return seconds
