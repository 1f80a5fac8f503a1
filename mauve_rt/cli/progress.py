"""Progress of long work on a terminal: a bar on standard error, gone at the end. Nothing elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from mauve_rt.cli.plain_output import beneath, plain
from mauve_rt.trace.progress import Progress, silent

SHOWN_AFTER_S = 1.0
"""Shorter work shows no bar."""


@contextmanager
def shown() -> Iterator[Progress]:
    """What to call with the progress."""
    console = Console(file=beneath(sys.stderr))
    if not console.is_terminal:
        yield silent
        return
    columns = (BarColumn(), TaskProgressColumn(), TimeRemainingColumn(), TextColumn("{task.description}"))
    bar = Bar(*columns, console=console, transient=True)
    task = bar.add_task("", total=1.0)
    begun_s = time.monotonic()

    def show(done: float, what: str) -> None:
        bar.update(task, completed=done, description=escape(plain(what)))
        if not bar.live.is_started and time.monotonic() >= begun_s + SHOWN_AFTER_S:
            bar.start()

    try:
        yield show
    finally:
        if bar.live.is_started:
            bar.stop()
