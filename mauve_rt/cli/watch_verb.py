"""`mauve watch NODE...`: a live table of executors in the terminal."""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from mauve_rt.cli.arguments import absolute_name
from mauve_rt.cli.completion import complete_executors, completed_by
from mauve_rt.cli.keys import keys_at_once, pressed_keys
from mauve_rt.cli.verb import BAD_USAGE, OK

if TYPE_CHECKING:
    from mauve_rt.cli.watch_view import Selection
    from mauve_rt.cli.watched import WatchedExecutor

_REFRESH_S = 0.25
_FIRST_S = 5.0  # for a first answer, with --once
_FIGURES_S = 2.5  # /diagnostics comes once a second, and a rate takes two of them
_STEPS = {"up": -1, "k": -1, "down": 1, "j": 1}
_BACKSPACE = ("\x7f", "\b")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Of `mauve watch`."""
    names = parser.add_argument(
        "executors", nargs="+", type=absolute_name, metavar="executor", help="node of an executor"
    )
    completed_by(names, complete_executors)
    parser.add_argument(
        "--value",
        action="append",
        default=[],
        metavar="NAME[:FIELD]",
        help="show a resource or COMPONENT.PORT too, or one field of it; may be repeated",
    )
    parser.add_argument("--once", action="store_true", help="print what is known after 3 s, and end")


def main(args: argparse.Namespace) -> int:
    """Watch until q or Ctrl-C."""
    if not args.once and not (sys.stdin.isatty() and sys.stdout.isatty()):
        print("mauve: watch needs a terminal; add --once for one table without it", file=sys.stderr)
        return BAD_USAGE
    from diagnostic_msgs.msg import DiagnosticArray  # noqa: PLC0415 - ROS takes its time to load

    from mauve_rt.cli.client import connected  # noqa: PLC0415
    from mauve_rt.cli.watched import WatchedExecutor  # noqa: PLC0415

    names = [*dict.fromkeys(args.executors)]
    with connected(first=True) as client:
        executors = [WatchedExecutor(client, name, args.value) for name in names]

        def hear(message: DiagnosticArray) -> None:
            for executor in executors:
                executor.take_diagnostics(message)

        def look() -> None:
            client.spin()
            for executor in executors:
                executor.look()

        client.follow(DiagnosticArray, "/diagnostics", hear)  # once: the topic is that of all executors
        (_print_once if args.once else _show)(executors, look)
    return OK


def _print_once(executors: "Sequence[WatchedExecutor]", look: Callable[[], None]) -> None:
    from mauve_rt.cli.client import NoExecutorError  # noqa: PLC0415
    from mauve_rt.cli.views import console  # noqa: PLC0415
    from mauve_rt.cli.watch_view import Selection, view  # noqa: PLC0415

    begun_s = time.monotonic()
    while time.monotonic() < begun_s + _FIGURES_S or (
        not all(executor.is_there for executor in executors) and time.monotonic() < begun_s + _FIRST_S
    ):
        look()
    missing = [executor.name for executor in executors if not executor.is_there]
    if missing:
        raise NoExecutorError(f"no answer from {' and '.join(missing)}; see mauve nodes")
    console().print(view(executors, Selection(), has_keys=False))


def _show(executors: "Sequence[WatchedExecutor]", look: Callable[[], None]) -> None:
    """Until a key ends it."""
    from rich.live import Live  # noqa: PLC0415

    from mauve_rt.cli.views import console  # noqa: PLC0415
    from mauve_rt.cli.watch_view import Selection, view  # noqa: PLC0415

    selection = Selection()
    with keys_at_once(), Live(console=console(), screen=True, auto_refresh=False) as live:
        shown_s = 0.0
        while True:
            look()
            keys = [*pressed_keys()]
            if any(not press(key, selection, executors) for key in keys):
                return
            is_due = not selection.is_paused and time.monotonic() >= shown_s + _REFRESH_S
            if keys or is_due:
                live.update(view(executors, selection), refresh=True)
                shown_s = time.monotonic()


def press(key: str, selection: "Selection", executors: "Sequence[WatchedExecutor]") -> bool:
    """Do what a key stands for; False: leave."""
    if selection.is_typing:
        _type(key, selection)
    elif key == "q":
        return False
    elif key == "/":
        selection.is_typing, selection.filter = True, ""
    elif key in ("p", " "):
        selection.is_paused = not selection.is_paused
    elif key in _STEPS:
        selection.cursor += _STEPS[key]
    else:
        _choose(key, selection, executors)
    return True


def _choose(key: str, selection: "Selection", executors: "Sequence[WatchedExecutor]") -> None:
    """The order of the components, or one of them."""
    from mauve_rt.cli.watch_view import SORTED_BY, rows  # noqa: PLC0415

    if key == "s":
        selection.sorted_by = SORTED_BY[(SORTED_BY.index(selection.sorted_by) + 1) % len(SORTED_BY)]
    elif key == "enter" and selection.opened is None:
        shown = rows(executors, selection)
        if shown:
            row = shown[max(0, min(selection.cursor, len(shown) - 1))]
            selection.opened = row.executor, row.component.name
            _open(executors, *selection.opened)
    elif key == "escape":
        selection.filter = selection.filter if selection.opened is not None else ""
        selection.opened = None
        _open(executors, "", "")


def _open(executors: "Sequence[WatchedExecutor]", name: str, component: str) -> None:
    for executor in executors:
        executor.open(component if executor.name == name else "")


def _type(key: str, selection: "Selection") -> None:
    if key in ("enter", "escape"):
        selection.is_typing = False
        selection.filter = selection.filter if key == "enter" else ""
    elif key in _BACKSPACE:
        selection.filter = selection.filter[:-1]
    elif len(key) == 1 and key.isprintable():
        selection.filter += key
