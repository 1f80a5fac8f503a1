"""How a bag gets onto the disk: by this process, or by a keeper, whose writes no kill of this one tears."""

import contextlib
import os
import socket
import struct
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from mauve_rt.native_program import start_native_program

_ORDER = struct.Struct("<QQQ")  # offset, length, size: as struct Order of keeper.cpp
_OUTCOME = struct.Struct("<i")
_KEEP_SIZE = 2**64 - 1
_LAST_WRITE_S = 0.5  # how long close() waits for the keeper's end


class Disk:
    """Writes from this process."""

    def write(
        self, descriptor: int, parts: Sequence[bytes | bytearray], offset: int, *, size: int | None = None
    ) -> None:
        """Write all of it there, one part behind the other, then give the file that size.

        One system call; more only where the system took less (a full disk, which then says so, or over 2 GB).

        Raises:
            OSError: the system refused; what it took before is in the file.

        """
        written = os.pwritev(descriptor, parts, offset)
        if written < sum(map(len, parts)):
            rest = memoryview(b"".join(parts))[written:]
            while rest:
                offset += written
                written = os.pwrite(descriptor, rest, offset)
                rest = rest[written:]
        if size is not None:
            os.ftruncate(descriptor, size)

    def close(self) -> None:
        """No more is written. May be called again."""


class KeptDisk(Disk):
    """Writes by a process of its own, the keeper: a kill of this process finds each write done, or not begun.

    Linux gives up a write between two pages when its process is killed. The keeper has a session of its own
    and ends when this process has ended. Where there is no keeper any more, this process writes itself.
    For one thread at a time.
    """

    def __init__(self, program: Path, *, on_error: Callable[[str], None]) -> None:
        """Start the keeper. `on_error` is told, once, that it has ended, or cannot be started."""
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
        self, descriptor: int, parts: Sequence[bytes | bytearray], offset: int, *, size: int | None = None
    ) -> None:
        """As Disk.write(); this process writes again what a keeper that has just ended may have begun."""
        outcome = self._ask(descriptor, parts, offset, size)
        if outcome is None:
            super().write(descriptor, parts, offset, size=size)
        elif outcome:
            raise OSError(outcome, os.strerror(outcome))

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
        self, descriptor: int, parts: Sequence[bytes | bytearray], offset: int, size: int | None
    ) -> int | None:
        """Let the keeper write; its errno. None: there is no keeper."""
        if self._socket is None:
            return None
        length = sum(map(len, parts))
        order = _ORDER.pack(offset, length, _KEEP_SIZE if size is None else size)
        try:
            self._put(parts, length)
            socket.send_fds(self._socket, [order], [descriptor])
            answer = self._socket.recv(_OUTCOME.size)
            if answer:
                return int(_OUTCOME.unpack(answer)[0])
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
        super().write(self._memory, parts, 0)

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
