"""The sentinel: a process that publishes safe outputs when native code has crashed the executor.

mauve_rt/sentinel/sentinel.cpp is the other side. It learns here which outputs a stop would write, and
between activation and a stop that they are not safe.
"""

import contextlib
import os
import socket
import struct
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mauve_rt.control.runtime import Runtime
from mauve_rt.counts import counted
from mauve_rt.errors import one_line
from mauve_rt.native_program import native_program, start_native_program
from mauve_rt.node.executor.bound_resources import BoundResources
from mauve_rt.node.shared.discovery import without_shared_memory

_OUTPUTS, _UNSAFE, _SAFE = b"o", b"u", b"s"  # enum class Order of sentinel.cpp
_READY = b"ready"
_READY_S = 2.0  # how long an activation waits for the publishers
_END_S = 0.5  # how long close() waits for the process
_ANSWER_BYTES = 4096
_ABOVE_SENDER = 2  # in priority: the outputs of stops are one above it
_PROGRAM = "sentinel"


class Sentinel:
    """The other process, from configure() to close(). Any thread may call.

    | member     | written by                  | under   |
    | ---------- | --------------------------- | ------- |
    | all        | any thread                  | `_lock` |
    """

    def __init__(self, node: Any, runtime: Runtime, bound: BoundResources) -> None:
        self._node = node
        self._runtime = runtime
        self._bound = bound
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._process = 0
        self._sent = b""  # the list of outputs
        self._count = 0
        self._awaited = 0  # answers
        self._problem: str | None = None  # None: there is no sentinel

    def configure(self) -> None:
        """Start the process where the architecture wants one; it makes its publishers meanwhile."""
        if not self._runtime.model.sentinel:
            return
        with self._lock:
            try:
                self._start()
            except OSError as error:
                self._fail(f"it cannot be started ({error.strerror})")
                return
            self._follow()

    def arm(self) -> None:
        """Outputs are not safe from now on; waits for the publishers, for 2 s at most."""
        with self._lock:
            self._follow()
            until_s = time.monotonic() + _READY_S
            while self._awaited and self._socket is not None and time.monotonic() < until_s:
                self._take_answers(wait_s=max(until_s - time.monotonic(), 0.0))
            if self._awaited and self._socket is not None:
                self._report(f"its publishers are not ready after {_READY_S:g} s")
            self._send(_UNSAFE)

    def disarm(self) -> None:
        """Outputs are safe."""
        with self._lock:
            self._send(_SAFE)

    def follow(self) -> None:
        """Send the present outputs, if others were sent before, and notice the end of the process."""
        with self._lock:
            self._take_answers(wait_s=0.0)
            self._follow()

    def status(self) -> tuple[str, bool] | None:
        """How it is, in words, and whether that is well; None: the architecture wants none."""
        with self._lock:
            if self._problem is None:
                return None
            return self._problem or f"watches {counted(self._count, 'output')}", not self._problem

    def close(self) -> None:
        """End the process. May be called again."""
        with self._lock:
            self._send(_SAFE)
            self._problem = None
            self._release()
            until_s = time.monotonic() + _END_S
            while self._process and not self._has_ended() and time.monotonic() < until_s:
                time.sleep(0.001)
            self._process = 0

    # ---- under the lock

    def _start(self) -> None:
        self._sent, self._count, self._awaited, self._problem = b"", 0, 0, ""
        own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        priority = self._runtime.model.sender.priority + _ABOVE_SENDER
        words = (str(priority), self._node.get_namespace(), f"{self._node.get_name()}_{_PROGRAM}")
        pidfd = os.pidfd_open(os.getpid())
        status = os.open("/proc/self/status", os.O_RDONLY)
        try:
            self._process = start_native_program(
                native_program(_PROGRAM),
                (theirs.fileno(), pidfd, status),
                words,
                environment=os.environ | without_shared_memory() | _libraries(),
            )
        except OSError:
            own.close()
            raise
        finally:
            theirs.close()
            os.close(pidfd)
            os.close(status)
        self._socket = own

    def _follow(self) -> None:
        if self._socket is None:
            return
        outputs = self._outputs()
        packed = b"".join(outputs)
        if packed == self._sent:
            return
        file = os.memfd_create("outputs")
        try:
            os.write(file, packed)
            socket.send_fds(self._socket, [_OUTPUTS], [file])
        except OSError as error:
            self._fail(str(error.strerror))
            return
        finally:
            os.close(file)
        self._sent, self._count = packed, len(outputs)
        self._awaited += 1

    def _outputs(self) -> Sequence[bytes]:
        """What a stop writes of what is published now."""
        messages = {
            (port.resource, port.type): port.stop_message
            for part in self._runtime.components()
            for port in part.ports
            if port.stop_message
        }
        found = []
        for bound in self._bound.published():
            message = messages.get((bound.resource, bound.type_name))
            if message is not None:
                qos = bound.profile
                figures = struct.pack(
                    "<6q",
                    qos.reliability,
                    qos.durability,
                    qos.deadline.nanoseconds,
                    qos.lifespan.nanoseconds,
                    qos.liveliness,
                    qos.liveliness_lease_duration.nanoseconds,
                )
                texts = (bound.topic.encode(), bound.type_name.encode(), message)
                found.append(figures + b"".join(struct.pack("<I", len(text)) + text for text in texts))
        return found

    def _send(self, order: bytes) -> None:
        if self._socket is not None:
            try:
                self._socket.send(order)
            except OSError as error:
                self._fail(str(error.strerror))

    def _take_answers(self, *, wait_s: float) -> None:
        while self._socket is not None:
            self._socket.settimeout(wait_s)
            try:
                answer = self._socket.recv(_ANSWER_BYTES)
            except (TimeoutError, BlockingIOError):
                return
            except OSError as error:
                self._fail(str(error.strerror))
                return
            finally:
                if self._socket is not None:
                    self._socket.settimeout(None)
            if not answer:
                self._fail("it has ended")
                return
            self._awaited = max(self._awaited - 1, 0)
            if answer == _READY:
                self._problem = ""
            else:
                self._report(one_line(answer.decode("utf-8", "replace")))
            wait_s = 0.0

    def _fail(self, why: str) -> None:
        """It is gone: say so once, and go on without."""
        self._release()
        self._report(self._problem or why)

    def _report(self, problem: str) -> None:
        if problem != self._problem:
            self._node.get_logger().error(
                f"sentinel: {problem}: a crash of native code leaves drivers with the last outputs"
            )
        self._problem = problem

    def _release(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _has_ended(self) -> bool:
        with contextlib.suppress(ChildProcessError):
            return os.waitpid(self._process, os.WNOHANG) != (0, 0)
        return True


def _libraries() -> dict[str, str]:
    """The variable by which it finds the libraries of ROS that this process has."""
    mapped = Path("/proc/self/maps").read_text("utf-8").split()
    folders = {str(Path(word).parent) for word in mapped if word.endswith("/librcl.so")}
    given = os.environ.get("LD_LIBRARY_PATH")
    return {"LD_LIBRARY_PATH": os.pathsep.join([*folders, *([given] if given else [])])}
