"""How a bag gets onto the disk: by this process, or by a keeper, whose writes no kill of this one tears.

A write of a file and the metadata.yaml that tells of it are one order. What is written is on the disk
(fdatasync) within `SYNC_PERIOD_S`, and where the order says so: at a split and at the end.
"""

import contextlib
import errno
import os
import socket
import struct
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from mauve_rt.native_program import start_native_program

SYNC_PERIOD_S = 1.0  # as kSyncPeriod of keeper.cpp
METADATA = "metadata.yaml"
_NEW_METADATA = f".{METADATA}.new"
_ORDER = struct.Struct("<QQQQQ")  # offset, length, size, metadata_length, flags: struct Order of keeper.cpp
_SYNC, _IN_PLACE = 1, 2
_ANSWER = struct.Struct("<ii")  # error, is_metadata: struct Answer of keeper.cpp
_KEEP_SIZE = 2**64 - 1
_LAST_WRITE_S = 0.5  # how long close() waits for the keeper's end


class MetadataError(OSError):
    """The file is written; its metadata.yaml is not."""


class Metadata(NamedTuple):
    """A metadata.yaml to write with a file."""

    folder: int
    """A file descriptor."""
    data: bytes
    in_place: bool = False
    """Over the present one, which takes no room on the disk; else written beside and renamed."""


class Disk:
    """Writes from this process."""

    def __init__(self) -> None:
        self._synced_s = time.monotonic()

    def write(
        self,
        descriptor: int,
        parts: Sequence[bytes | bytearray],
        offset: int,
        *,
        size: int | None = None,
        metadata: Metadata | None = None,
        sync: bool = False,
    ) -> None:
        """Write all of it there, one part behind the other, then give the file that size; then `metadata`.

        Each file is one system call; more only where the system took less (a full disk, which then says so,
        or over 2 GB).

        Raises:
            MetadataError: the system refused, the file is written.
            OSError: the system refused; what it took before is in the file.

        """
        _write_all(descriptor, parts, offset)
        if size is not None:
            os.ftruncate(descriptor, size)
        is_due = sync or time.monotonic() >= self._synced_s + SYNC_PERIOD_S
        if is_due:
            _sync(descriptor)
            self._synced_s = time.monotonic()
        if metadata is not None:
            try:
                _write_metadata(metadata, sync=is_due)
            except OSError as error:
                raise MetadataError(error.errno, error.strerror) from error

    def close(self) -> None:
        """No more is written. May be called again."""


def sync_folder(path: Path) -> None:
    """Have the names in a folder on the disk, where the file system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


class KeptDisk(Disk):
    """Writes by a process of its own, the keeper: a kill of this process finds each write done, or not begun.

    Linux gives up a write between two pages when its process is killed. The keeper has a session of its own
    and ends when this process has ended. Where there is no keeper any more, this process writes itself.
    For one thread at a time.
    """

    def __init__(self, program: Path, *, on_error: Callable[[str], None]) -> None:
        """Start the keeper. `on_error` is told, once, that it has ended, or cannot be started."""
        super().__init__()
        self._on_error = on_error
        self._room = 0
        self._process = 0
        self._memory = -1
        self._socket: socket.socket | None = None
        try:
            self._memory = os.memfd_create("bag")
            self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with theirs:
                self._process = start_native_program(program, (theirs.fileno(), self._memory))
        except OSError as error:
            self._give_up(f"{program} cannot be started ({error.strerror})")

    def write(
        self,
        descriptor: int,
        parts: Sequence[bytes | bytearray],
        offset: int,
        *,
        size: int | None = None,
        metadata: Metadata | None = None,
        sync: bool = False,
    ) -> None:
        """As Disk.write(); this process writes again what a keeper that has just ended may have begun."""
        answer = self._ask(descriptor, parts, offset, size=size, metadata=metadata, sync=sync)
        if answer is None:
            super().write(descriptor, parts, offset, size=size, metadata=metadata, sync=sync)
            return
        error, is_metadata = answer
        if error:
            raise (MetadataError if is_metadata else OSError)(error, os.strerror(error))

    def close(self) -> None:
        """End the keeper; one that waits for its disk is left behind."""
        process, self._process = self._process, 0
        self._release()
        until_s = time.monotonic() + _LAST_WRITE_S
        while process and time.monotonic() < until_s:
            with contextlib.suppress(ChildProcessError):
                if os.waitpid(process, os.WNOHANG) == (0, 0):
                    time.sleep(0.001)
                    continue
            return

    def _ask(
        self,
        descriptor: int,
        parts: Sequence[bytes | bytearray],
        offset: int,
        *,
        size: int | None,
        metadata: Metadata | None,
        sync: bool,
    ) -> tuple[int, int] | None:
        """Let the keeper write; its errno, and whether of metadata.yaml. None: there is no keeper."""
        if self._socket is None:
            return None
        length = sum(map(len, parts))
        descriptors, flags = [descriptor], _SYNC if sync else 0
        metadata_length = 0
        if metadata is not None:
            descriptors.append(metadata.folder)
            flags |= _IN_PLACE if metadata.in_place else 0
            metadata_length = len(metadata.data)
            parts = [*parts, metadata.data]
        kept_size = _KEEP_SIZE if size is None else size
        order = _ORDER.pack(offset, length, kept_size, metadata_length, flags)
        try:
            self._put(parts, length + metadata_length)
            socket.send_fds(self._socket, [order], descriptors)
            answer = self._socket.recv(_ANSWER.size)
            if answer:
                error, is_metadata = _ANSWER.unpack(answer)
                return error, is_metadata
            why = "it has ended"
        except OSError as error:
            why = str(error.strerror)
        self.close()
        self._give_up(f"the keeper of the bag is gone ({why})")
        return None

    def _put(self, parts: Sequence[bytes | bytearray], length: int) -> None:
        """Into the memory, which the keeper reads."""
        if length > self._room:
            os.ftruncate(self._memory, length)
            self._room = length
        _write_all(self._memory, parts, 0)

    def _give_up(self, why: str) -> None:
        self._release()
        self._on_error(f"{why}: from here on a kill inside of a write can tear the bag")

    def _release(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        memory, self._memory = self._memory, -1
        if memory >= 0:
            os.close(memory)


def _write_all(descriptor: int, parts: Sequence[bytes | bytearray], offset: int) -> None:
    length = sum(map(len, parts))
    written = os.pwritev(descriptor, parts, offset) if length else 0
    if written < length:
        rest = memoryview(b"".join(parts))[written:]
        while rest:
            offset += written
            written = os.pwrite(descriptor, rest, offset)
            rest = rest[written:]


def _sync(descriptor: int) -> None:
    try:
        os.fdatasync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:  # of what is on no disk
            raise


def _write_metadata(metadata: Metadata, *, sync: bool) -> None:
    """As write_metadata() of keeper.cpp."""
    folder = metadata.folder
    how = os.O_WRONLY | os.O_CLOEXEC
    if metadata.in_place:
        descriptor = os.open(METADATA, how, dir_fd=folder)
    else:
        descriptor = os.open(_NEW_METADATA, how | os.O_CREAT | os.O_TRUNC, 0o644, dir_fd=folder)
    try:
        try:
            _write_all(descriptor, (metadata.data,), 0)
            os.ftruncate(descriptor, len(metadata.data))
            if sync:
                os.fdatasync(descriptor)
        finally:
            os.close(descriptor)
        if not metadata.in_place:
            os.rename(_NEW_METADATA, METADATA, src_dir_fd=folder, dst_dir_fd=folder)
            if sync:
                os.fsync(folder)
    except OSError:
        if not metadata.in_place:
            with contextlib.suppress(OSError):
                os.unlink(_NEW_METADATA, dir_fd=folder)
        raise
