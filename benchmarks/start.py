"""From the start of an executor's process to the first release of its components, beside a node of rclpy."""

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


class Start(NamedTuple):
    """Milliseconds from the process's start on."""

    configured_ms: float
    released_ms: float


def start_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of an executor with five components, and of rclpy's node with one publisher and timer."""
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
        beside="rclpy node with one timer, ready to spin",
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
    time.sleep(_RELEASE_S)
    executor.end()
    found = talkers.releases()
    configured_ns = min(int(rows[0, 0]) for rows in found)
    released_ns = min(int(rows[1, 1]) for rows in found)
    return Start((configured_ns - begin_ns) / 1e6, (released_ns - begin_ns) / 1e6)


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
    program = str(Path(__file__).with_name("rclpy_publisher.py"))
    processes.spawn("rclpy", program, "/bench_start", "1")
    processes.await_output("rclpy", "ready")
    ready_ns = int(processes.output("rclpy").split()[-1])
    processes.end("rclpy")
    return Start(0.0, (ready_ns - begin_ns) / 1e6)
