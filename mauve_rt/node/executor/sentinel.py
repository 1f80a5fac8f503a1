"""The sentinel: a process that publishes safe outputs when native code has crashed the executor.

mauve_rt/sentinel/sentinel.cpp is the other side. It learns here which outputs a stop would write, and
between activation and a stop that they are not safe.
"""

import contextlib
import os
import socket
import threading
import time
from collections.abc import Iterator
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
    """The other process, from configure() to close(). Any thread may call; `_lock` protects every member."""

    def __init__(self, node: Any, runtime: Runtime, bound: BoundResources) -> None:
        self._node = node
        self._runtime = runtime
        self._bound = bound
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None
        self._process = 0
        self._sent: list[bytes] = []  # the outputs
        self._awaited = 0  # answers to lists of outputs
        self._subscribers = 0
        self._problem: str | None = None  # None: there is no sentinel

    def configure(self) -> None:
        """Start the process where the architecture wants one; it makes its publishers meanwhile."""
        if self._runtime.model.sentinel:
            with self._open():
                self._start()
                self._follow()

    def arm(self) -> None:
        """Outputs are not safe from now on; waits for the publishers, for 2 s at most."""
        with self._open() as its_socket:
            if its_socket is None:
                return
            self._follow()
            until_s = time.monotonic() + _READY_S
            while self._awaited > 0 and (left_s := until_s - time.monotonic()) > 0.0:
                self._take_answer(its_socket, wait_s=left_s)
            if self._awaited > 0:
                self._report(f"its publishers are not ready after {_READY_S:g} s")
            its_socket.send(_UNSAFE)

    def disarm(self) -> None:
        """Outputs are safe."""
        with self._open() as its_socket:
            if its_socket is not None:
                its_socket.send(_SAFE)

    def follow(self) -> None:
        """Send the present outputs, if others were sent before, and notice the end of the process."""
        with self._open() as its_socket:
            while its_socket is not None and self._take_answer(its_socket, wait_s=0.0):
                pass
            self._follow()

    def status(self) -> tuple[str, bool] | None:
        """How it is, in words, and whether that is well; None: the architecture wants none."""
        with self._lock:
            if self._problem is None:
                return None
            outputs, subscribers = len(self._sent), self._subscribers
            watches = f"watches {counted(outputs, 'output')}, {counted(subscribers, 'subscriber')}"
            return self._problem or watches, not self._problem

    def close(self) -> None:
        """End the process. May be called again."""
        self.disarm()
        with self._lock:
            self._problem = None
            self._release()
            until_s = time.monotonic() + _END_S
            while self._process and not self._has_ended() and time.monotonic() < until_s:
                time.sleep(0.001)
            self._process = 0

    # ---- under the lock

    @contextlib.contextmanager
    def _open(self) -> Iterator[socket.socket | None]:
        """The socket, under the lock; None: there is no process. After an error there is none either."""
        with self._lock:
            try:
                yield self._socket
            except OSError as error:
                self._release()
                self._report(str(error))

    def _start(self) -> None:
        self._sent, self._awaited, self._subscribers, self._problem = [], 0, 0, ""
        own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        own.settimeout(0.0)  # a send to a process that hangs fails
        self._socket = own
        peer = os.getpid()
        priority = self._runtime.model.sender.priority + _ABOVE_SENDER
        node = (self._node.get_namespace(), f"{self._node.get_name()}_{_PROGRAM}")
        with theirs:
            self._process = start_native_program(
                native_program(_PROGRAM),
                (theirs.fileno(),),
                (str(peer), f"/proc/{peer}/status", str(priority), *node),
                environment=os.environ | without_shared_memory() | _libraries(),
            )

    def _follow(self) -> None:
        if self._socket is not None and (outputs := self._outputs()) != self._sent:
            self._socket.send(_OUTPUTS + b"".join(outputs))
            self._sent = outputs
            self._awaited += 1

    def _outputs(self) -> list[bytes]:
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
                words = (
                    int(qos.reliability),
                    int(qos.durability),
                    qos.deadline.nanoseconds,
                    qos.lifespan.nanoseconds,
                    int(qos.liveliness),
                    qos.liveliness_lease_duration.nanoseconds,
                    bound.topic,
                    bound.type_name,
                    len(message),
                )
                found.append("".join(f"{word} " for word in words).encode() + message)
        return found

    def _take_answer(self, its_socket: socket.socket, *, wait_s: float) -> bool:
        """Whether there was one."""
        its_socket.settimeout(wait_s)
        try:
            answer = its_socket.recv(_ANSWER_BYTES)
        except (TimeoutError, BlockingIOError):
            return False
        finally:
            its_socket.settimeout(0.0)
        if not answer:
            raise ConnectionError("it has ended")
        if answer.isdigit():
            self._subscribers = int(answer)
            return True
        self._awaited -= 1
        self._report("" if answer == _READY else one_line(answer.decode("utf-8", "replace")))
        return True

    def _report(self, problem: str) -> None:
        if problem and problem != self._problem:
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
