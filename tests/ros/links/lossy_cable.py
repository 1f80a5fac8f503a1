"""The cable between two machines, as a process: see impaired_cable.py."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from mauve_examples.mission.hosts import Hosts


class LossyCable:
    """A perfect one until set() is called."""

    def __init__(self, hosts: Hosts) -> None:
        """Take the place of the machines' switch."""
        wrapper, ports = hosts.take_off_switch()
        program = str(Path(__file__).with_name("impaired_cable.py"))
        self._process = subprocess.Popen(
            [*wrapper, sys.executable, program, *ports],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
        )
        assert self._answer() == "ready"

    def set(self, **settings: Any) -> None:
        """How it differs from a perfect one."""
        assert self._process.stdin is not None
        print(json.dumps(settings), file=self._process.stdin)
        assert self._answer() == "ok"

    def close(self) -> None:
        """Carry nothing any more."""
        self._process.kill()
        self._process.wait()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()
