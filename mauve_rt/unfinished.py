"""Names for what is made beside its place, and put there once it is finished."""

import os
from pathlib import Path


def beside(path: Path) -> Path:
    """A name in the folder of `path` that no other call gives, in whatever process or container."""
    return path.with_name(f".{path.name}.{os.getpid()}_{os.urandom(8).hex()}")
