"""Checks of the places that executors write to, and of what dead processes left there."""

import fcntl
import os
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

from mauve_rt.counts import counted
from mauve_rt.doctor.finding import Computer, Finding, Status, error, ok, warning
from mauve_rt.scratch import scratch_folders

_MEMORY = "/dev/shm"  # noqa: S108 - Fast DDS's
_LEAST_MEMORY, _LEAST_DISK = 64 << 20, 1 << 30
_MARK = "_el"  # Fast DDS holds the lock of this file while the participant of the segment lives
_PROFILE = re.compile(r"mauve_(\d+)_[0-9a-f]{16}\.xml")  # that an executor writes while it starts
_BLOCK_BYTES = 512  # of st_blocks


def check_shared_memory(computer: Computer) -> Iterator[Finding]:
    """Whether Fast DDS can make its segments in /dev/shm."""
    folder = computer.path(_MEMORY)
    if not folder.is_dir() or not os.access(folder, os.W_OK | os.X_OK):
        found = "cannot be written" if folder.is_dir() else "is missing"
        yield error(
            f"{_MEMORY} {found}",
            cost="Fast DDS has no shared memory: participants may not start",
            remedy=f"sudo mount -t tmpfs -o mode=1777 tmpfs {_MEMORY}",
        )
        return
    yield room(_MEMORY, shutil.disk_usage(folder).free, least=_LEAST_MEMORY)


def check_disk(computer: Computer) -> Iterator[Finding]:
    """Whether a recording has room in the current folder."""
    folder = computer.path(str(Path.cwd()))
    yield room(str(Path.cwd()), shutil.disk_usage(folder).free, least=_LEAST_DISK)


def room(path: str, free: int, *, least: int) -> Finding:
    """The free room of a folder, in bytes, and whether it is enough."""
    found = f"{free / (1 << 20):,.0f} MiB free in {path}"
    if free >= least:
        return ok(found)
    return Finding(
        status=Status.WARNING if free else Status.ERROR,
        found=found,
        cost=f"less than {least >> 20:,} MiB: a recording ends early, or a participant does not start",
        remedy=f"delete files: du -sh {path}/* | sort -h",
    )


def check_leftovers(computer: Computer) -> Iterator[Finding]:
    """Files of processes that ended without removing them."""
    segments, hidden = _dead_segments(computer.path(_MEMORY))
    profiles = [
        file
        for folder in scratch_folders()
        for file in _listed(computer.path(str(folder)))
        if (match := _PROFILE.fullmatch(file.name)) and not computer.path(f"/proc/{match[1]}").exists()
    ]
    dead = [*segments, *profiles]
    note = f"; {counted(hidden, 'file')} of other accounts not examined" if hidden else ""
    if not dead:
        yield ok(f"none{note}")
        return
    size = sum(file.stat().st_blocks * _BLOCK_BYTES for file in dead if file.exists())
    yield warning(
        f"{counted(len(dead), 'file')} of dead processes, {size / (1 << 20):.1f} MiB{note}",
        cost="memory or disk stays in use until the computer starts again",
        remedy=shlex.join(["rm", *map(str, dead)]),
    )


def _dead_segments(folder: Path) -> tuple[list[Path], int]:
    """The files of segments whose lock no process holds, and how many locks could not be tried."""
    dead, hidden = [], 0
    names = [file.name for file in _listed(folder) if file.name.startswith("fastrtps_")]
    for name in names:
        if not name.endswith(_MARK):
            continue
        is_held = _is_held(folder / name)
        hidden += is_held is None
        if is_held is False:
            dead += [folder / each for each in (name.removesuffix(_MARK), name) if each in names]
    return dead, hidden


def _is_held(lock: Path) -> bool | None:
    """Whether a process holds the lock of a file; None: it cannot be tried."""
    try:
        with lock.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    return False


def _listed(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []
