"""A robot of `mauve new package`, brought to its first live swap: for the stages ros and doors."""

import os
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

PATIENCE_S = 100.0


class NewRobot:
    """A package that is written now, and commands that are typed in it."""

    def __init__(
        self, folder: Path, name: str, *options: str, environment: Mapping[str, str], mauve: str
    ) -> None:
        self.folder = folder / name
        self._name = name
        self._mauve = mauve
        self._environment = dict(environment)
        self._begun_s = time.monotonic()
        self.mauve("new", "package", name, *options, cwd=folder)

    def mauve(self, *words: str, cwd: Path | None = None) -> str:
        """What a command prints; fails with it where the command fails."""
        done = subprocess.run(
            [self._mauve, *words],
            env=self._environment,
            cwd=cwd or self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert done.returncode == 0, f"mauve {' '.join(words)}:\n{done.stdout}"
        return done.stdout

    def build(self, *options: str) -> str:
        """Build the package; a compiler that complains fails."""
        said = self.mauve("build", *options)
        assert "warning: " not in said, said
        return said

    def warnings(self) -> str:
        """What `mauve check` has to say of its files, once it is built."""
        setup = f"install/share/{self._name}/local_setup.bash"
        done = subprocess.run(
            ["bash", "-c", f"source {setup} && '{self._mauve}' check architecture/*.yaml"],
            env=self._environment,
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stderr

    @contextmanager
    def running(self, *words: str) -> Iterator[None]:
        """While `mauve run` does. Ctrl-C ends it."""
        with tempfile.TemporaryFile("w+") as log:
            process = subprocess.Popen(
                [self._mauve, "run", *words], env=self._environment, cwd=self.folder, stdout=log, stderr=log
            )
            try:
                deadline = time.monotonic() + PATIENCE_S
                while not self._is_seen():
                    log.seek(0)
                    assert process.poll() is None, log.read()
                    assert time.monotonic() < deadline, "no executor is seen"
                yield
                process.send_signal(signal.SIGINT)
                status = process.wait(PATIENCE_S)
                log.seek(0)
                assert status == 0, log.read()
            finally:
                process.kill()
                process.wait()

    def _is_seen(self) -> bool:
        command = [self._mauve, "nodes"]
        return (
            subprocess.run(command, env=self._environment, capture_output=True, check=False).returncode == 0
        )

    def swap(self) -> float:
        """Replace the core of the robot that runs; returns the seconds since its package was begun."""
        said = self.mauve("replace-core", "/executor", "drive", f"{self._name}/Halt")
        seconds = time.monotonic() - self._begun_s
        assert f"component 'drive' runs {self._name}/Halt, in place of {self._name}/Drive" in said
        assert "missed releases 0" in said
        assert "took over position" in said
        print(f"{seconds:.1f} s from `mauve new` to the swap, {os.cpu_count()} CPUs")  # noqa: T201 - for the log of the stage
        return seconds

    def wait_for_core(self, core: str) -> None:
        """Until the component has it."""
        deadline = time.monotonic() + PATIENCE_S
        while f'"core": "{core}"' not in self.mauve("list", "/executor", "--json"):
            assert time.monotonic() < deadline, f"{core} never came"
