"""A program in a terminal, as a user sees it and types."""

import os
import pty
import re
import select
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from ros_processes import PATIENCE_S

_CONTROLS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


class Terminal:
    """A program in a terminal of 80 columns."""

    def __init__(
        self,
        *words: str,
        domain: int,
        folder: Path | None = None,
        variables: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self._master, terminal = pty.openpty()
        environment = {
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
            "TERM": "xterm",
            "COLUMNS": "80",
            "LINES": "50",
            **variables,
        }
        self.process = subprocess.Popen(
            [sys.executable, "-m", "mauve_rt.cli", *words],
            env=environment,
            cwd=folder,
            stdin=terminal,
            stdout=terminal,
            stderr=terminal,
        )
        os.close(terminal)
        self._text = ""

    def press(self, keys: str) -> None:
        """As a user does."""
        self._text = ""
        os.write(self._master, keys.encode())

    def await_text(self, *words: str) -> str:
        """Until all of these are on the screen; returns what was written since the last key."""
        deadline = time.monotonic() + PATIENCE_S
        while not all(word in self._text for word in words):
            assert time.monotonic() < deadline, f"no {words} in {self._text[-3000:]}"
            if select.select([self._master], [], [], 0.1)[0]:
                written = os.read(self._master, 65536).decode(errors="replace")
                self._text = (self._text + _CONTROLS.sub("", written))[-20000:]
        return self._text

    def end(self) -> None:
        """By force, where the program still runs."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self._master)
