"""An executor that minds, by a rule of its own, whether a talker speaks; each is a process."""

import itertools
import os
import re
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ros_processes import ExecutorProcess

PATIENCE_S = 60.0
_TOLD = re.compile(r"\[(\d+\.\d+)\] \[[\w.]*executor\]: quiet: (\w+): ")
_ARCHITECTURE = """\
mauve: 1
components:
  metronome: {shell: mauve_examples/MetronomeShell, core: mauve_examples/Metronome,
              fsm: mauve_examples/MetronomeFsm, alternatives: [mauve_examples/Accelerando], priority: 20,
              properties: {period_us: 10000}}
resources:
  heard: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: /talk, direction: subscribe, qos: QOS}}
  beat: {kind: shared_data, type: std_msgs/msg/Float64}
connections:
  - [metronome.beat, beat.write]
"""
_RULES = """\
mauve: 1
rules:
  - name: quiet
    when: {KIND: {topic: /talk, longer_than_s: LIMIT}}
    do: [{kind: replace_core, target: metronome, name: mauve_examples/Accelerando}]
    undo: {for_s: UNDO, do: [{kind: replace_core, target: metronome, name: mauve_examples/Metronome}]}
"""


class Listener:
    """The executor."""

    def __init__(
        self,
        folder: Path,
        *,
        limit_s: float,
        undo_s: float,
        kind: str = "silence",
        qos: str = "reliable",
        wrapper: Sequence[str] = (),
        environment: dict[str, str] | None = None,
    ) -> None:
        """Start it."""
        architecture, rules = folder / "listener.yaml", folder / "rules.yaml"
        architecture.write_text(_ARCHITECTURE.replace("QOS", qos), encoding="utf-8")
        text = _RULES.replace("KIND", kind).replace("LIMIT", str(limit_s)).replace("UNDO", str(undo_s))
        rules.write_text(text, encoding="utf-8")
        self.executor = ExecutorProcess(
            folder,
            {"PYTHONUNBUFFERED": "1", **(environment or {})},
            ["-p", f"architecture:={architecture}", "-p", f"rules:={rules}"],
            wrapper=wrapper,
        )

    def decisions(self) -> list[str]:
        """All of the rule so far."""
        return [what for _, what in _TOLD.findall(self.executor.output)]

    def count(self, decision: str) -> int:
        """How often it has decided so."""
        return self.decisions().count(decision)

    def alarms(self) -> int:
        """How often the condition has become true."""
        return self.count("condition_true")

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for it."""
        deadline_s = time.monotonic() + PATIENCE_S
        while not condition():
            assert self.executor.process.poll() is None, self.executor.output
            assert time.monotonic() < deadline_s, f"gave up waiting for {what}:\n{self.executor.output}"
            time.sleep(0.02)

    def is_usual(self) -> bool:
        """Whether the rule is armed, and what it did is undone."""
        decisions = self.decisions()
        done = decisions.count("done")
        return "armed" in decisions and decisions.count("do") == decisions.count("undo") == done / 2

    def process(self) -> int:
        """The id of the executor's process, which a wrapper may have begun."""
        return self.executor.process.pid

    def close(self) -> None:
        """End it by force."""
        self.executor.process.kill()
        self.executor.process.wait()


class Talker:
    """Speaks on /talk while it runs."""

    def __init__(
        self,
        period_s: float,
        *,
        times: Path = Path(os.devnull),
        wrapper: Sequence[str] = (),
        environment: dict[str, str] | None = None,
    ) -> None:
        """Start it; `times`: the file of when it spoke."""
        program = str(Path(__file__).with_name("talker.py"))
        self._times = times
        self._command = [*wrapper, sys.executable, program, "/talk", str(period_s), str(times)]
        self._environment = os.environ | (environment or {})
        self.start()

    def start(self) -> None:
        """Start it, or start it anew."""
        self._process = subprocess.Popen(self._command, env=self._environment)

    def longest_silence_s(self, since_s: float) -> float:
        """The longest time between two of its messages from an instant on, as its own clock has it."""
        data = self._times.read_bytes()
        spoke = [
            since_s,
            *(at_s for (at_s,) in struct.iter_unpack("d", data[: len(data) // 8 * 8]) if at_s > since_s),
        ]
        return max(later - earlier for earlier, later in itertools.pairwise([*spoke, time.monotonic()]))

    def signal(self, number: signal.Signals) -> None:
        """Freeze, thaw or kill it."""
        self._process.send_signal(number)
        if number == signal.SIGKILL:
            self._process.wait()
