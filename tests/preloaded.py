"""Libraries for LD_PRELOAD: a system call that hangs or fails, in a process that a test starts."""

import shutil
import subprocess
from pathlib import Path

import pytest


def shared_library(source: Path, text: str) -> str:
    """Compile C; returns the library."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        pytest.skip("there is no C compiler")
    source.write_text(text, encoding="utf-8")
    library = source.with_suffix(".so")
    words = [compiler, "-shared", "-fPIC", "-o", library, source, "-ldl"]
    subprocess.run(words, check=True, timeout=120)
    return str(library)
