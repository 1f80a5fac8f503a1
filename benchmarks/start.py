"""The start of an executor, beside that of a managed node of rclpy: time, CPU time, memory."""

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import native
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from rows import Row, alone, compared
from settings import Settings
from talkers import Talkers, plugin_prefix

_COMPONENTS = 5
_START_S = 30.0
_RELEASE_S = 0.3  # from the threads' creation on; the first release is due after 20 ms


_RATIO, _MEMORY_MB = 1.3, 80.0
_BESIDE = "managed node of rclpy, ready to spin"


class Start(NamedTuple):
    """Milliseconds from the process's start on; what it took by then."""

    configured_ms: float
    released_ms: float
    cpu_ms: float
    memory_mb: float


def start_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of an executor with five components, and of rclpy's node."""
    with Processes() as processes:
        plugins = plugin_prefix(processes.folder)

        def executor(number: int) -> Start:
            path = processes.folder / f"start_{number}.yaml"
            talkers = Talkers(path, count=_COMPONENTS, priority=settings.priority, cpu=settings.cpu)
            return _executor_start(processes, talkers, plugins)

        def rclpy_node(_: int) -> Start:
            return _rclpy_start(processes)

        rounds = native.interleaved(settings.rounds, executor, rclpy_node)
    yield compared(
        f"start of an executor with {_COMPONENTS} components, from its process to the first release",
        [(found[0].released_ms, found[1].released_ms) for found in rounds],
        unit="ms",
        beside=_BESIDE,
        ratio_limit=_RATIO,
    )
    yield compared(
        "CPU time of it, with some of the components' own",
        [(found[0].cpu_ms, found[1].cpu_ms) for found in rounds],
        unit="ms",
        beside=_BESIDE,
        ratio_limit=_RATIO,
    )
    yield compared(
        "resident memory after it",
        [(found[0].memory_mb, found[1].memory_mb) for found in rounds],
        unit="MB",
        beside=_BESIDE,
        limit=_MEMORY_MB,
    )
    yield alone(
        "of it, until the components are being configured",
        [found[0].configured_ms for found in rounds],
        unit="ms",
        note="interpreter, imports, file and plug-ins; the rest is ROS and the deployment",
    )


def _executor_start(processes: Processes, talkers: Talkers, plugins: Path) -> Start:
    begin_ns = time.monotonic_ns()
    executor = ExecutorProcess(processes, talkers.architecture, plugins=plugins)
    _await_thread(executor.pid, talkers.names[-1])
    cpu_ms = _cpu_ms(executor.pid)
    time.sleep(_RELEASE_S)
    memory_mb = _memory_mb(executor.pid)  # with what is loaded after the first release
    executor.end()
    found = talkers.releases()
    configured_ns = min(int(rows[0, 0]) for rows in found)
    released_ns = min(int(rows[1, 1]) for rows in found)
    return Start((configured_ns - begin_ns) / 1e6, (released_ns - begin_ns) / 1e6, cpu_ms, memory_mb)


def _await_thread(pid: int, name: str) -> None:
    """Until a process has a thread of that name."""
    until = time.monotonic() + _START_S
    while not any(_thread_name(task) == name for task in Path(f"/proc/{pid}/task").glob("*")):
        if time.monotonic() > until:
            raise BenchmarkError(f"no thread {name} within {_START_S:g} s")
        time.sleep(0.05)


def _thread_name(task: Path) -> str:
    try:
        return (task / "comm").read_text(encoding="utf-8").strip()
    except OSError:  # it has ended
        return ""


def _rclpy_start(processes: Processes) -> Start:
    begin_ns = time.monotonic_ns()
    pid = processes.spawn("rclpy", str(Path(__file__).with_name("rclpy_lifecycle.py")))
    processes.await_output("rclpy", "ready")
    _, ready_ns, cpu_ms = processes.output("rclpy").split()
    memory_mb = _memory_mb(pid)
    processes.end("rclpy")
    return Start(0.0, (int(ready_ns) - begin_ns) / 1e6, float(cpu_ms), memory_mb)


def _cpu_ms(pid: int) -> float:
    """CPU time of a process so far, all threads."""
    fields = Path(f"/proc/{pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return 1e3 * (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory_mb(pid: int) -> float:
    """Resident memory of a process."""
    pages = int(Path(f"/proc/{pid}/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
