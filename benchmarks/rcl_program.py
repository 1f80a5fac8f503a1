"""Runs a C++ program that uses rcl alone.

rcl_program.py publish|subscribe|send|take|record [--name value ...]

Some of rcl's libraries want an interpreter's symbols, so that the program is a function of a library that an
interpreter calls. No Python runs while it does.
"""

import ctypes
import signal
import sys
from pathlib import Path

LIBRARY = Path(__file__).resolve().parent.parent / "build" / "benchmarks" / "libbench_rcl.so"


def main() -> int:
    """The function's exit status."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Python's own handler would wait for the function's end
    words = [word.encode() for word in sys.argv[1:]]
    function = getattr(ctypes.CDLL(str(LIBRARY)), f"bench_{sys.argv[1]}")
    status: int = function(len(words), (ctypes.c_char_p * len(words))(*words))
    return status


if __name__ == "__main__":
    sys.exit(main())
