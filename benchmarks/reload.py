"""What a reload of rebuilt code costs: releases of its component, time, and memory that stays."""

import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from busy_executor import ARCHITECTURE
from executor_process import ExecutorProcess
from native import ROOT, BenchmarkError
from processes import Processes
from rows import Row, alone, exactly_zero
from settings import Settings

from mauve_msgs.srv import Reload
from mauve_rt.cli.client import Client, connected
from mauve_rt.parts import ament_index

_PACKAGE = "mauve_examples"
_LIBRARY = "libmauve_tutorials.so"
_MEMORY_LIMIT_KIB = 200.0
_PATIENCE_S = 10.0


def reload_rows(settings: Settings) -> Iterator[Row]:
    """Reloads of the tutorial's library, each of a file that was written anew, while its component runs."""
    with Processes() as processes:
        prefix = _installed(processes.folder / "prefix")
        executor = ExecutorProcess(processes, ARCHITECTURE, plugins=prefix)
        executor.wait()
        missed, times_s, growth_kib = [], [], []
        with connected() as client:
            _reload(client, executor, prefix)  # which loads the code for reloads
            for _ in range(settings.rounds):
                before_kib = _memory_kib(executor.pid)
                lost = 0
                for _ in range(settings.reloads):
                    reply, took_s = _reload(client, executor, prefix)
                    lost += sum(max(step.missed_releases, 0) for step in reply.report)
                    times_s.append(took_s)
                growth_kib.append((_memory_kib(executor.pid) - before_kib) / settings.reloads)
                missed.append(lost)
        executor.end()
    count = settings.rounds * settings.reloads
    yield exactly_zero(
        f"releases of a 1 kHz component missed by reloads of its code (of {count} reloads)", missed
    )
    yield alone(
        "memory that each reload leaves behind",
        growth_kib,
        limit=_MEMORY_LIMIT_KIB,
        unit="KiB",
        note=f"most in a round {max(growth_kib):.0f} KiB each; nothing is ever closed",
    )
    yield alone("reload of rebuilt code, from request to reply", [1e3 * time for time in times_s], unit="ms")


def _installed(prefix: Path) -> Path:
    """A prefix of the benchmark's own, whose library it may write."""
    (prefix / "lib").mkdir(parents=True)
    index = prefix / "share" / "ament_index" / "resource_index"
    for kind in ("packages", "mauve_rt_plugins"):
        (index / kind).mkdir(parents=True)
    (index / "packages" / _PACKAGE).touch()
    listed = {package: file for package, _, file in ament_index.resources("mauve_rt_plugins")}
    shutil.copy(listed[_PACKAGE], index / "mauve_rt_plugins" / _PACKAGE)
    for library in (ROOT / "install" / "lib").glob("libmauve_*.so"):
        if library.name in (_LIBRARY, "libmauve_examples.so"):
            shutil.copyfile(library, prefix / "lib" / library.name)
    return prefix


def _build(library: Path) -> None:
    """As a build leaves the library: a new file under its name, of other contents."""
    new = library.with_suffix(".new")
    new.write_bytes(library.read_bytes() + b"\0" * 8)
    new.replace(library)


def _reload(client: Client, executor: ExecutorProcess, prefix: Path) -> tuple[Reload.Response, float]:
    _build(prefix / "lib" / _LIBRARY)
    began_s = time.monotonic()
    reply = client.call(Reload, f"{executor.namespace}/executor/reload", Reload.Request(requested_by="bench"))
    if not reply.success or not reply.loaded:
        raise BenchmarkError(f"reload: {reply.message}")
    return reply, time.monotonic() - began_s


def _memory_kib(pid: int) -> float:
    """The resident memory of a process."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith("VmRSS:")))
