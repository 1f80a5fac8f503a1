"""How long work tells how far it is."""

from collections.abc import Callable

Progress = Callable[[float, str], None]
"""Called with the share that is done, from 0 to 1, and what is being done, in a word or two."""


def silent(done: float, what: str) -> None:
    """Tell nobody."""


def part(progress: Progress, begin: float, end: float) -> Progress:
    """Return the progress of a piece of work that takes the whole from `begin` to `end`."""

    def tell(done: float, what: str) -> None:
        progress(begin + (end - begin) * done, what)

    return tell
