"""Run a command of the build. Generators of rosidl share one parse of each interface.

    parse_once.py PYTHON GENERATOR --generator-arguments-file FILE ...

The parsed form of an interface is kept beside it, in NAME.idl.parsed, for the generators that run later.
Any other command runs as it is.
"""

import hashlib
import os
import pickle
import runpy
import sys
from pathlib import Path

from rosidl_parser import parser
from rosidl_parser.definition import IdlFile, IdlLocator
from rosidl_parser.parser import parse_idl_file


def parse_once(locator: IdlLocator) -> IdlFile:
    """Do what parse_idl_file does, with the kept form where that is of the same text."""
    path = locator.get_absolute_path()
    digest = hashlib.sha256(path.read_bytes()).digest()
    kept = Path(f"{path}.parsed")
    try:
        of, content = pickle.loads(kept.read_bytes())  # noqa: S301 - of this build's own folder
    except (OSError, EOFError, ValueError, pickle.UnpicklingError):
        of = None
    if of != digest:
        content = parse_idl_file(locator).content
        new = Path(f"{kept}.{os.getpid()}")  # two generators may be here at a time
        new.write_bytes(pickle.dumps((digest, content)))
        new.replace(kept)
    return IdlFile(locator, content)


def main() -> None:
    """Become the command, or run the generator in this process."""
    command = sys.argv[1:]
    if "--generator-arguments-file" not in command:
        os.execvp(command[0], command)  # noqa: S606
    parser.parse_idl_file = parse_once
    sys.argv = command[1:]
    sys.path[0] = str(Path(command[1]).parent)
    runpy.run_path(command[1], run_name="__main__")


if __name__ == "__main__":
    main()
