"""Completers of the names that an executor has: of `mauve` and `ros2 mauve`, by argcomplete.

`completed_by(parser.add_argument("executor"), complete_executors)` gives an argument its completer. A
completer takes names from the file of `completion_cache`. Where that file is old, a process of its own asks
the executors for the next completion. A completer prints nothing and raises nothing; it loads no ROS.
"""

import argparse
import contextlib
import os
import re
import sys
import time
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # loaded when a completion is asked for: each verb imports this module
    from mauve_rt.cli.completion_cache import Cache, CachedExecutor, CachedGraph

Completer = Callable[..., list[str]]
_ANSWER_S = 0.27  # from the start of the process; a user waits for 0.3 s, and a process takes time to end
_POLL_S = 0.01
_OFFERED = re.compile(r"[A-Za-z0-9_/.~-]+")  # names come from the network: nothing that a shell interprets
_OF_SHELL = re.compile(r"_ARGCOMPLETE|COMP_")  # variables by which a shell asks for a completion


def completed_by(action: argparse.Action, completer: Completer) -> None:
    """Let argcomplete complete an argument by one of the functions below."""
    action.completer = completer  # type: ignore[attr-defined]


def complete_executors(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:  # noqa: ARG001
    """Executors' nodes, e.g. `/robot_1/executor`; without the first slash where the user typed none."""
    names = [executor.name for executor in _known()]
    if prefix and not prefix.startswith("/"):
        names = [name.lstrip("/") for name in names]
    return _offered(prefix, names)


def complete_executors_and_files(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Executors' nodes, and files and folders."""
    folder = prefix[: prefix.rfind("/") + 1]
    found: list[str] = []
    with contextlib.suppress(OSError), os.scandir(folder or ".") as entries:
        found = [f"{folder}{entry.name}{'/' if entry.is_dir() else ''}" for entry in entries]
    return [*complete_executors(prefix, parsed_args), *_offered(prefix, found)]


def complete_components(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Components of the executor on the command line."""
    return _offered(prefix, [each.name for one in _executor_of(parsed_args) for each in one.components])


def complete_cores(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Cores that may replace the present one of the component on the command line."""
    component = getattr(parsed_args, "component", None)
    found = [each for one in _executor_of(parsed_args) for each in one.components if each.name == component]
    return _offered(prefix, [core for each in found for core in each.alternatives])


def complete_values(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """Resources, and COMPONENT.PORT of each port that reads or writes values, of the executor."""
    names: list[str] = []
    for executor in _executor_of(parsed_args):
        names += executor.resources
        names += [f"{each.name}.{port}" for each in executor.components for port in each.ports]
    return _offered(prefix, names)


def complete_properties(prefix: str, parsed_args: argparse.Namespace, **_: Any) -> list[str]:
    """COMPONENT.PROPERTY of each property of the executor's components."""
    found = [each for one in _executor_of(parsed_args) for each in one.components]
    return _offered(prefix, [f"{each.name}.{name}" for each in found for name in each.properties])


def _offered(prefix: str, names: Iterable[str]) -> list[str]:
    found = {name for name in names if name.startswith(prefix) and _OFFERED.fullmatch(name)}
    return sorted(found)


def _executor_of(parsed_args: argparse.Namespace) -> list["CachedExecutor"]:
    """The executor on the command line, if it is known."""
    subjects = getattr(parsed_args, "subject", None) or [None]  # of a verb that also takes files
    name = getattr(parsed_args, "executor", subjects[0])
    if not isinstance(name, str):
        return []
    absolute = "/" + name.strip("/")
    return [executor for executor in _known(absolute) if executor.name == absolute]


def _known(executor: str = "") -> list["CachedExecutor"]:
    """Executors whose processes are likely to run; with `executor`, that one's parts are wanted, too."""
    try:
        return _read_and_refresh(executor)
    except Exception:  # noqa: BLE001 - a shell that completes prints no error
        return []


def _read_and_refresh(executor: str) -> list["CachedExecutor"]:
    from mauve_rt.cli.completion_cache import Cache  # noqa: PLC0415

    cache = Cache.of_environment()
    if cache is None:
        return []
    graph = cache.read()
    if not graph.is_current(time.time(), executor):
        has_ended = start_refresh(cache)
        while not _has_answer(cache, graph, executor) and not has_ended() and _process_age_s() < _ANSWER_S:
            time.sleep(_POLL_S)
            graph = cache.read()
        graph = cache.read()  # its last word, where it has ended
    return _believable(cache, graph)


def _believable(cache: "Cache", graph: "CachedGraph") -> list["CachedExecutor"]:
    now_s, sockets = time.time(), cache.sockets()
    return [each for each in graph.executors.values() if each.is_believable(now_s, sockets)]


def _has_answer(cache: "Cache", graph: "CachedGraph", executor: str) -> bool:
    """Whether the wanted names are known, or it is known that there are none: nothing to wait for."""
    if graph.is_current(time.time(), executor):
        return True
    believable = _believable(cache, graph)
    if executor:
        return any(each.name == executor and each.listed_s for each in believable)
    return bool(believable) and graph.found_s > 0


def start_refresh(cache: "Cache") -> Callable[[], bool]:
    """Let a process of its own write the cache anew, unless one does; returns whether that process has ended.

    The process inherits the locked file: one refresh runs at a time, and a lock ends with its process.
    """
    import fcntl  # noqa: PLC0415 - only a refresh needs these
    import subprocess  # noqa: PLC0415

    from mauve_rt.cli.completion_cache import open_own  # noqa: PLC0415

    environment = {name: value for name, value in os.environ.items() if not _OF_SHELL.match(name)}
    with contextlib.suppress(OSError), open_own(cache.lock, os.O_RDWR) as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return lambda: False  # it runs already
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "mauve_rt.cli.completion_refresh"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
            pass_fds=(lock,),
            start_new_session=True,  # a Ctrl-C in the terminal is not for it
        )
        return lambda: process.poll() is not None
    return lambda: True


def _process_age_s() -> float:
    """Time since this process began; the interpreter's start is part of what the user waits for."""
    with open("/proc/self/stat", encoding="ascii", errors="replace") as file:  # noqa: PTH123 - no need of pathlib
        ticks = int(file.read().rpartition(")")[2].split()[19])  # starttime
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
