"""Output without the control characters of others: names in a bag, or in an answer, may hold any.

A terminal would obey them: they move the cursor, set its title, or turn the order of letters around.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

_LINES = "\n\t"


def plain(text: str) -> str:
    """The text, with each character that is not to be seen as an escape of Python; lines and tabs stay."""
    if text.isprintable():
        return text
    return "".join(each if each.isprintable() or each in _LINES else ascii(each)[1:-1] for each in text)


class _PlainStream:
    """As the stream beneath it, but that all it writes is plain."""

    def __init__(self, beneath: TextIO) -> None:
        self.beneath = beneath

    def write(self, text: str) -> int:
        self.beneath.write(plain(text))
        return len(text)

    def writelines(self, lines: Any) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.beneath, name)


@contextmanager
def plain_output() -> Iterator[None]:
    """Inside of it stdout and stderr write plain text."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (stream and _PlainStream(stream) for stream in before)
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def beneath(stream: TextIO) -> TextIO:
    """What takes escape sequences of our own, as colours; the text among them has to be plain."""
    return stream.beneath if isinstance(stream, _PlainStream) else stream
