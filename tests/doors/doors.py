"""What the tests of the doors (colcon, pip) share: sources, clean shells, an executor that was installed."""

import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_S = 60.0
DOMAINS = range(201, 230)  # none that the stages draw from which run at the same time
# What setup files of ROS and of this clone put into a shell.
ROS_VARIABLES = (
    "AMENT_",
    "CMAKE_",
    "COLCON_",
    "LD_LIBRARY_PATH",
    "PYTHON",
    "ROS_",
    "RMW_",
    "VIRTUAL_ENV",
    "_ROS_",
)
# Nothing that the doors do not test. All else has the set-up's flags: so ccache has what the set-up compiled.
LEAN_BUILD = ("-DMAUVE_BUILD_BENCHMARKS=OFF", "-DMAUVE_BUILD_EXAMPLES=OFF", "-DMAUVE_BUILD_TESTS=OFF")
NINJA = {"CMAKE_GENERATOR": "Ninja"}  # CMake's own choice is make, which a bare machine has not
# A job for each processor. Left alone, colcon lets ninja start one only while the load is below that.
ALL_JOBS = {"MAKEFLAGS": f"-j{os.cpu_count()}"}


def source_files() -> set[str]:
    """What a clone of the working tree as it is would have."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    return {name for name in names if (ROOT / name).is_file()}


def copy_sources(to: Path) -> None:
    """Clone the working tree as it is."""
    for name in source_files():
        (to / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, to / name)


def shell_without(*prefixes: Path) -> dict[str, str]:
    """This process's environment, with nothing below these prefixes in any list of paths."""
    environment = {}
    for name, value in os.environ.items():
        kept = [part for part in value.split(os.pathsep) if not any(map(Path(part).is_relative_to, prefixes))]
        if kept:
            environment[name] = os.pathsep.join(kept)
    return environment


def run(*command: str | Path, environment: Mapping[str, str], cwd: Path | None = None) -> str:
    """Run to the end; returns what was printed on stdout, and fails with all of it where the command does."""
    done = subprocess.run(command, env=environment, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{command}:\n{done.stdout}\n{done.stderr}"
    return done.stdout


def build(*command: str | Path, environment: Mapping[str, str], cwd: Path | None = None) -> str:
    """Run what compiles, as nicely as can be: other tests run meanwhile."""
    return run("nice", "-n", "19", *command, environment=environment, cwd=cwd)


class InstalledExecutor:
    """PREFIX/lib/mauve_rt/executor, as `ros2 run mauve_rt executor` starts it, and `mauve` beside it."""

    def __init__(
        self, command: Sequence[str | Path], architecture: Path, *, mauve: Path, environment: dict[str, str]
    ) -> None:
        self._mauve = mauve
        self._environment = environment | {"ROS_DOMAIN_ID": str(random.choice(DOMAINS))}  # noqa: S311
        arguments = ["--ros-args", "-p", f"architecture:={architecture}"]
        self._log = architecture.parent / "executor.log"
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [*command, *arguments],
                env=self._environment,
                cwd=architecture.parent,  # `python -m` in the clone would find the sources
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    @property
    def output(self) -> str:
        return self._log.read_text("utf-8")

    def mauve(self, *words: str) -> str:
        """What a verb prints."""
        assert self.process.poll() is None, self.output
        return run(self._mauve, *words, environment=self._environment)

    def wait_until_there(self) -> None:
        """Until `mauve` sees it."""
        deadline = time.monotonic() + PATIENCE_S
        command = [self._mauve, "nodes"]
        while subprocess.run(command, env=self._environment, capture_output=True, check=False).returncode:
            assert self.process.poll() is None, self.output
            assert time.monotonic() < deadline, "no executor is seen"

    def component(self) -> dict[str, Any]:
        """The only component, as `mauve list` tells."""
        [component] = json.loads(self.mauve("list", "/executor", "--json"))["components"]
        return dict(component)

    def wait_for_releases(self) -> None:
        """Until the component has run."""
        deadline = time.monotonic() + PATIENCE_S
        before = self.component()["releases"]
        while self.component()["releases"] == before:
            assert time.monotonic() < deadline, f"no release since the {before}th"

    def libraries(self) -> set[Path]:
        """The shared libraries of ours that it has loaded."""
        maps = Path(f"/proc/{self.process.pid}/maps").read_text("utf-8").splitlines()
        files = {Path(line.split(maxsplit=5)[5]) for line in maps if line.count("/") > 0}
        return {file for file in files if "mauve" in file.name and ".so" in file.name}

    def interrupt(self) -> int:
        """Ctrl-C; returns the exit status."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(PATIENCE_S)


@contextlib.contextmanager
def installed_executor(
    command: Sequence[str | Path], architecture: Path, *, mauve: Path, environment: dict[str, str]
) -> Iterator[InstalledExecutor]:
    """One that is gone at the end, whatever happens."""
    executor = InstalledExecutor(command, architecture, mauve=mauve, environment=environment)
    try:
        executor.wait_until_there()
        yield executor
    finally:
        executor.process.kill()
        executor.process.wait()
