"""What a verb of `mauve` costs, beside a program that does nothing but ask the same."""

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import native
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from rows import Row, compared
from settings import Settings
from talkers import Talkers, plugin_prefix

_COMPONENTS = 5
_CPU_MS, _ANSWER_MS, _COMPLETION_MS = 300.0, 500.0, 300.0
_BESIDE = "rclpy client of the same service"


class _Run(NamedTuple):
    cpu_ms: float
    wall_ms: float


def command_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of `mauve list`, of a client of rclpy, of `mauve nodes`, and of a completion after them."""
    with Processes() as processes:
        talkers = Talkers(
            processes.folder / "listed.yaml", count=_COMPONENTS, priority=settings.priority, cpu=settings.cpu
        )
        executor = ExecutorProcess(processes, talkers.architecture, plugins=plugin_prefix(processes.folder))
        name = f"{executor.namespace}/executor"
        program = str(Path(__file__).with_name("rclpy_list.py"))
        executor.wait()
        rounds = native.interleaved(
            settings.rounds,
            lambda _: _run("-m", "mauve_rt.cli", "list", name),
            lambda _: _run(program, name),
            lambda _: _run("-m", "mauve_rt.cli", "nodes"),
            lambda _: _complete(f"mauve stop {name} ", processes.folder / "completions"),
        )
        executor.end()
    for verb, place in (("list", 0), ("nodes", 2)):
        runs = [(found[place], found[1]) for found in rounds]
        yield compared(
            f"CPU time of `mauve {verb}`",
            [(mauve.cpu_ms, rclpy.cpu_ms) for mauve, rclpy in runs],
            unit="ms",
            beside=_BESIDE,
            limit=_CPU_MS,
        )
        yield compared(
            f"from typing `mauve {verb}` to its end",
            [(mauve.wall_ms, rclpy.wall_ms) for mauve, rclpy in runs],
            unit="ms",
            beside=_BESIDE,
            limit=_ANSWER_MS,
        )
    yield compared(
        "from the Tab key to the components of `mauve stop NODE`",
        [(found[3].wall_ms, found[1].wall_ms) for found in rounds],
        unit="ms",
        beside=_BESIDE,
        limit=_COMPLETION_MS,
    )


def _complete(line: str, answer: Path) -> _Run:
    """As a shell asks for the words at the end of a line."""
    asked = {"_ARGCOMPLETE": "1", "COMP_LINE": line, "COMP_POINT": str(len(line))}
    run = _run("-m", "mauve_rt.cli", environment={**asked, "_ARGCOMPLETE_STDOUT_FILENAME": str(answer)})
    if not answer.read_bytes():
        raise BenchmarkError(f"{line}: expected the names of components, found none")
    return run


def _run(*words: str, environment: Mapping[str, str] = MappingProxyType({})) -> _Run:
    begin_s = time.monotonic()
    with subprocess.Popen(
        [sys.executable, "-P", *words], stdout=subprocess.DEVNULL, env={**os.environ, **environment}
    ) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    wall_s = time.monotonic() - begin_s
    if process.returncode:
        raise BenchmarkError(f"{' '.join(words)} ended with status {process.returncode}")
    return _Run(1e3 * (usage.ru_utime + usage.ru_stime), 1e3 * wall_s)
