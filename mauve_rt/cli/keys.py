"""Keys of a terminal: pressed without Enter, read without waiting."""

import os
import select
import sys
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager

_ESCAPE = "\x1b"


@contextmanager
def keys_at_once() -> Iterator[None]:
    """Keys arrive without Enter and are not echoed."""
    before = termios.tcgetattr(sys.stdin)
    try:
        tty.setcbreak(sys.stdin)
        yield
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


def pressed_keys() -> Iterator[str]:
    """The keys pressed since the last call; "up", "down", "enter" and "escape" by these names."""
    if not select.select([sys.stdin], [], [], 0)[0]:
        return
    text = os.read(sys.stdin.fileno(), 1024).decode(errors="replace")
    if not text:
        raise KeyboardInterrupt  # the terminal is gone
    named = {"\x1b[A": "up", "\x1b[B": "down", "\x1bOA": "up", "\x1bOB": "down"}
    while text:
        sequence = text[:3]
        if sequence in named:
            yield named[sequence]
            text = text[3:]
        else:
            yield {"\r": "enter", "\n": "enter", _ESCAPE: "escape"}.get(text[0], text[0])
            text = text[1:]
