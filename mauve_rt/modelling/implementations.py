"""Whether the implementations of a model in Python have the methods that it names; the build asks.

    python -m mauve_rt.modelling.implementations plugins.txt FOLDER...

The folders are those that hold parts of the package: its sources, and what was generated.
"""

import importlib
import pkgutil
import sys
from pathlib import Path

from mauve_rt.errors import exception_text


def main(index: str, *folders: str) -> int:
    """Import each module that the index names; its classes complain themselves. Returns the exit status."""
    sys.path[:0] = folders
    lines = [line.split("#")[0].split(";") for line in Path(index).read_text(encoding="utf-8").splitlines()]
    targets = [words[3].strip().split(":") for words in lines if len(words) > 1]
    status = 0
    for module, name in targets:
        try:
            package = importlib.import_module(module.partition(".")[0])
            package.__path__ = pkgutil.extend_path(package.__path__, package.__name__)
            getattr(importlib.import_module(module), name)
        except Exception as error:  # noqa: BLE001 - whatever a module of the user raises
            print(f"{module}:{name}: {exception_text(error)}", file=sys.stderr)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
