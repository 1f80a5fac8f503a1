"""From a save of the tutorial's core to the first release of the new code, as `mauve dev` reports it."""

import os
import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

from executor_process import ExecutorProcess
from native import ROOT, BenchmarkError
from processes import Processes
from rows import Row, alone
from settings import Settings

_TUTORIAL = ROOT / "docs" / "tutorials" / "01_first_component.md"
_FILE = re.compile(r"`([\w./]+\.\w+)`:\n\n```\w+\n(.*?)```", re.DOTALL)
_SOURCE = Path("climate", "src", "room.hpp")
_LIMIT_S = 5.0
_DEV = "dev"
_NO_CACHE = {"CCACHE_DISABLE": "1"}  # each save is new to the compiler


def save_rows(settings: Settings) -> Iterator[Row]:
    """Saves of one source of a package that is built as in the tutorial, while its component runs."""
    with Processes() as processes:
        _write_package(processes.folder)
        prefix, build = _build_package(processes.folder)
        executor = ExecutorProcess(processes, processes.folder / "room.yaml", plugins=prefix)
        executor.wait()
        words = ["-m", "mauve_rt.cli", "dev", f"{executor.namespace}/executor", "--build", build]
        words += ["--watch", str(processes.folder / "climate"), "--probation", "0", "--plain"]
        processes.spawn(_DEV, *words, **_NO_CACHE)
        processes.await_output(_DEV, "the executor answers")
        for number in range(1, settings.rounds + 1):
            _save(processes.folder / _SOURCE, number)
            processes.await_output(_DEV, f"cycle {number}: in force")
        told = processes.output(_DEV)
        processes.end(_DEV)
        executor.end()
    yield from rows_of(told)


def rows_of(told: str) -> Iterator[Row]:
    """The rows of the events that `mauve dev --plain` printed."""
    total_s = _seconds(r"first release ([\d.]+) s after the save", told)
    build_s = _seconds(r"built in ([\d.]+) s", told)
    reload_s = _seconds(r"reloaded in ([\d.]+) s", told)
    if not len(total_s) == len(build_s) == len(reload_s) > 0:
        raise BenchmarkError(f"mauve dev: a save led to no release of new code: {told}")
    yield alone(
        "from a save of the tutorial's C++ core to the first release of the new code, by `mauve dev`",
        total_s,
        unit="s",
        limit=_LIMIT_S,
        note=f"worst {max(total_s):.2f} s of {len(total_s)}; built as in the tutorial, no compiler cache",
    )
    yield alone("of it, the build", build_s, unit="s")
    yield alone("of it, the reload", reload_s, unit="s")
    rest_s = [whole - sum(parts) for whole, *parts in zip(total_s, build_s, reload_s, strict=True)]
    note = "the save is complete when two polls of the files find the same; and `mauve dev` itself"
    yield alone("of it, all else", rest_s, unit="s", note=note)


def _write_package(folder: Path) -> None:
    for name, text in _FILE.findall(_TUTORIAL.read_text(encoding="utf-8")):
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def _build_package(folder: Path) -> tuple[Path, str]:
    """Where the package is installed, and the command that builds and installs what was saved."""
    prefix, build = folder / "install", folder / "build"
    generator = os.environ.get("CMAKE_GENERATOR", "Ninja")
    prepare = ["cmake", "-S", str(folder / "climate"), "-B", str(build), "-G", generator]
    prepare += ["-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_INSTALL_PREFIX={prefix}"]
    command = ["cmake", "--build", str(build), "--target", "install"]
    for words in (prepare, command):
        done = subprocess.run(words, env=os.environ | _NO_CACHE, capture_output=True, text=True, check=False)
        if done.returncode:
            raise BenchmarkError(f"the tutorial's package: {done.stdout[-500:]} {done.stderr[-500:]}")
    return prefix, shlex.join(command)


def _save(source: Path, number: int) -> None:
    """Change the code, as an editor does that renames a new file."""
    text = source.read_text(encoding="utf-8")
    changed = re.sub(r"temperature_\{[\d.]+\}", f"temperature_{{15.{number}}}", text)
    if changed == text:
        raise BenchmarkError(f"{_TUTORIAL.name}: expected a member temperature_{{15.0}} in {source.name}")
    new = source.with_suffix(".new")
    new.write_text(changed, encoding="utf-8")
    new.replace(source)


def _seconds(pattern: str, told: str) -> list[float]:
    return [float(found) for found in re.findall(pattern, told)]
