"""Cores in Python for the executor's tests."""

import ctypes
import errno
import os
import signal
import struct
import tempfile
import threading
import time
from pathlib import Path
from typing import ClassVar

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64

from mauve_msgs.srv import ReplaceCore, Stop
from mauve_rt.parts.cores import Core


class PyCounter(Core):
    """Counts in hundreds."""

    def configure(self) -> None:
        """Start from nothing."""
        self.count = 0.0

    def act(self) -> None:
        """Count once."""
        sample = self.shell.set.read()
        if sample.is_new:
            self.count = sample.value.data
        self.count += 100.0 * self.shell.step.value
        self.shell.count.write(Float64(data=self.count))
        self.log().debug("counted to {:.1f} by {}", self.count, "hundreds")


class PyTimed(PyCounter):
    """Declares worst-case execution times and state."""

    budget_ns = 50_000
    state_fields: ClassVar[dict[str, str]] = {"count": "float64"}
    wcet_ns: ClassVar[dict[str, int]] = {"act": 400_000, "is_enabled": 2_000}

    def is_enabled(self) -> bool:
        """Ask the shell."""
        return self.shell.enabled.value


class PyHanging(PyCounter):
    """Does not come out of its third activation: as Hanging of executor_tests.cpp."""

    def configure(self) -> None:
        """Not hung yet."""
        super().configure()
        self.acts = 0
        self.mutex = threading.Lock()

    def act(self) -> None:
        """Count once, but the third time."""
        self.acts += 1
        if self.acts == 3:
            self.hang(self.shell.label.value)
        super().act()

    def hang(self, how: str) -> None:
        """In the way that a label says."""
        if how == "loop":
            while not self.shell.set.read().is_new:
                pass
        elif how == "sleep":
            time.sleep(4)
        elif how == "lock":
            self.mutex.acquire()
            self.mutex.acquire()
        elif how:
            Path(how).read_bytes()


class PyLeaving(PyCounter):
    """Leaves as a program does."""

    def configure(self) -> None:
        """Never comes back."""
        raise SystemExit("the core has left")


class _GarbledError(Exception):
    """One whose text cannot be had."""

    def __str__(self) -> str:
        raise UnicodeError("no words \udcff")


class PyGarbled(PyCounter):
    """Raises what has no text when it is prepared; what has no valid one when it runs."""

    def configure(self) -> None:
        """Never succeeds."""
        raise _GarbledError


class PyHeld(Core):
    """As Held of the library. Raises for a number far below zero."""

    def act(self) -> None:
        """Wait for the number."""
        self.shell.count.write(Float64(data=-1.0))
        until_s = time.monotonic() + (3.0 if self.shell.label.value == "briefly" else 30.0)
        while not (sample := self.shell.set.read()).is_new and time.monotonic() < until_s:
            time.sleep(0.001)
        if sample.value.data < -1e6:
            raise ValueError("set to something unheard of")


class PyAgreeing(PyCounter):
    """Says by a file that its label names that it was asked whether it takes over."""

    def adopt(self, _old: object) -> None:
        """Agree."""
        Path(self.shell.label.value).touch()


class PyAsking(PyCounter):
    """Asks its own executor for what its label says while it is configured, as nobody should."""

    def configure(self) -> None:
        """Wait for the answer."""
        super().configure()
        name, _, component = self.shell.label.value.partition(" ")
        kind = {"stop": Stop, "replace_core": ReplaceCore}[name]
        context = Context()
        rclpy.init(context=context)
        node = Node("asking", context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        client = node.create_client(kind, f"/robot_1/executor/{name}")
        request = kind.Request(component=component, cause="asked by a part that is being configured")
        if name == "replace_core":
            request.core = "executor_tests/Backwards"
        client.wait_for_service()
        executor.spin_until_future_complete(client.call_async(request))  # without a time-out
        node.destroy_node()
        context.try_shutdown()


class PyPatient(PyCounter):
    """Is being configured until there is a file that its label names; says by a file beside it that it is."""

    def configure(self) -> None:
        """Wait for the file."""
        super().configure()
        awaited = Path(self.shell.label.value)
        awaited.with_suffix(".begun").touch()
        until_s = time.monotonic() + 60.0
        while not awaited.exists() and time.monotonic() < until_s:
            time.sleep(0.001)


class PyKeeping(PyCounter):
    """Keeps the interpreter as a file of the process says, and says in it that it does.

    For as many s, or until somebody opens a pipe to write.
    """

    def act(self) -> None:
        """Count once, or keep it: a PyDLL's functions are called without letting go of the interpreter."""
        awaited = Path(tempfile.gettempdir()) / f"mauve_keeping_{os.getpid()}"
        if awaited.exists() and (how := awaited.read_text("utf-8")) not in ("keeping", "over"):
            awaited.write_text("keeping", encoding="utf-8")
            libc = ctypes.PyDLL(None)
            if how.isdigit():
                libc.usleep(int(how) * 1_000_000)
            else:
                libc.close(libc.open(how.encode(), os.O_RDONLY))
            awaited.write_text("over", encoding="utf-8")
            time.sleep(0.8)  # its state goes on for longer than a stop of all waits
        super().act()


class PyForbidding(PyCounter):
    """Ends the process by a signal, as a file says, once the system gives it neither a thread nor memory."""

    def act(self) -> None:
        """Count once, or forbid both (seccomp, all threads) and send the signal."""
        awaited = Path(tempfile.gettempdir()) / f"mauve_forbidding_{os.getpid()}"
        if awaited.exists():
            awaited.unlink()
            _forbid_threads_and_memory()
            os.kill(os.getpid(), signal.SIGTERM)
        super().act()


class PyPausing(PyCounter):
    """Stays in its state while there is a file that its label names."""

    def act(self) -> None:
        """Wait for the file's end, then count."""
        until_s = time.monotonic() + 200.0
        while Path(self.shell.label.value).exists() and time.monotonic() < until_s:
            time.sleep(0.002)
        super().act()


def _forbid_threads_and_memory() -> None:
    seccomp, calls = {
        "x86_64": (317, (56, 435, 9, 12)),  # clone, clone3, mmap, brk
        "aarch64": (277, (220, 435, 222, 214)),
    }[os.uname().machine]
    load_call, jump_if_equal, give = 0x20, 0x15, 0x06
    allow, refuse = 0x7FFF0000, 0x00050000 | errno.EAGAIN
    steps = [(load_call, 0, 0, 0)]
    for call in calls:
        steps += [(jump_if_equal, 0, 1, call), (give, 0, 0, refuse)]
    steps.append((give, 0, 0, allow))
    program = ctypes.create_string_buffer(b"".join(struct.pack("=HBBI", *step) for step in steps))
    filter_ = struct.pack("@HP", len(steps), ctypes.addressof(program))
    libc = ctypes.CDLL(None, use_errno=True)
    no_new_privileges, filter_mode, all_threads = 38, 1, 1
    if libc.prctl(no_new_privileges, 1, 0, 0, 0) or libc.syscall(seccomp, filter_mode, all_threads, filter_):
        raise OSError(ctypes.get_errno(), "no filter of system calls")
