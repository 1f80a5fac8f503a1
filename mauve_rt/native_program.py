"""Native programs that the executor starts and that outlive a crash of it: their places, and their start."""

import os
import signal
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path

# What ends a group of processes must not end such a program: it ends with the process that has started it.
_NO_END = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGUSR1, signal.SIGUSR2)


def native_prefix() -> Path:
    """Where MAUVE RT is installed: the prefix that has the native modules."""
    spec = find_spec("mauve_rt._kernel")
    native = Path(__file__ if spec is None or spec.origin is None else spec.origin)
    return native.resolve().parents[4]  # PREFIX/lib/pythonX.Y/site-packages/mauve_rt/


def native_program(name: str) -> Path:
    """Where a program is installed."""
    return native_prefix() / "libexec" / "mauve_rt" / name


def start_native_program(
    program: Path,
    descriptors: Sequence[int],
    words: Sequence[str] = (),
    *,
    environment: Mapping[str, str] | None = None,
) -> int:
    """Start a process that has these file descriptors, in a session of its own; its id.

    Its arguments are the numbers of the descriptors, then `words`.

    Raises:
        OSError: it cannot be started.
    """
    quiet = [
        (os.POSIX_SPAWN_OPEN, number, os.devnull, os.O_RDWR, 0)
        for number in range(3)
        if number not in descriptors
    ]
    kept = [(os.POSIX_SPAWN_DUP2, number, number) for number in descriptors]
    return os.posix_spawn(
        program,
        [program.name, *map(str, descriptors), *words],
        environment or {},
        file_actions=[*quiet, *kept],
        setsid=True,
        setsigmask=_NO_END,
    )
