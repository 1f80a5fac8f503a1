"""A robot whose outputs end, each for a cause of its own, and their last messages at two listeners.

One listener is on the robot's computer, the other one on another computer, with a lossy cable between them.
All of them read one CLOCK_MONOTONIC. The tests and the benchmark of the last messages share this file.
"""

import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TextIO

from lossy_cable import LossyCable
from ros_processes import ExecutorProcess
from waiting import wait_until

from mauve_examples.mission.hosts import Hosts

CAUSES = ("fault", "e_stop", "sigterm")
QUALITIES = ("reliable", "best_effort")
OUTPUTS = [f"{quality}/{cause}" for quality in QUALITIES for cause in CAUSES]
CONDITIONS: dict[str, dict[str, Any]] = {
    "nothing lost": {},
    "10 % lost": {"loss": 0.1},
    "30 % lost": {"loss": 0.3},
    "stalled interface": {},
    "cut cable": {"up": False},
}
STALLED, CUT = "stalled interface", "cut cable"
LOCAL, REMOTE = "robot", "remote"
PERIOD_MS, TIMEOUT_S = 4, 0.3
IMPAIRED_S = 1.0
PATIENCE_S = 5.0
SETTLED_S = 0.4  # a reliable publisher repairs the output of a stop for 0.2 s
_RANGE = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}
_RECORDER = Path(__file__).with_name("recorder_of_outputs.py")
_STALL = [
    "tc",
    "qdisc",
    "add",
    "dev",
    "cable",
    "root",
    "tbf",
    "rate",
    "1kbit",
    "burst",
    "2k",
    "limit",
    "100m",
]
_RESUME = ["tc", "qdisc", "del", "dev", "cable", "root"]
_ORDERS = {"fault": ("order", "-1e9"), "e_stop": ("button", "1.0")}
_RULES = """\
mauve: 1
rules:
  - name: e_stop
    safety: true
    otherwise: stop
    when: {value: {topic: button, field: data, above: 0.5}}
    do: [{kind: stop, target: reliable_e_stop}, {kind: stop, target: best_effort_e_stop}]
"""


def _architecture() -> str:
    """A component for each output."""
    components, resources, connections = [], [], []
    for output in OUTPUTS:
        name, quality = output.replace("/", "_"), output.partition("/")[0]
        components.append(
            f"  {name}: {{shell: executor_tests/CounterShell, core: executor_tests/Counter,"
            f" fsm: executor_tests/CounterFsm, priority: 40, properties: {{period_ms: {PERIOD_MS}}}}}"
        )
        topic = (
            f"{{name: {output}, direction: publish, qos: {quality}, driver_timeout_ms: {TIMEOUT_S * 1e3:g}}}"
        )
        resources.append(f"  {name}_count: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {topic}}}")
        connections.append(f"  - [{name}.count, {name}_count.write]")
        if output.endswith("/fault"):
            connections.append(f"  - [{name}.set, order.read]")
    for name in ("order", "button"):
        topic = f"{{name: {name}, direction: subscribe}}"
        resources.append(f"  {name}: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {topic}}}")
    parts = {"components": components, "resources": resources, "connections": connections}
    return "\n".join(
        ["mauve: 1", *(line for key, lines in parts.items() for line in (f"{key}:", *lines)), ""]
    )


class Message(NamedTuple):
    """A line of a listener's file."""

    time_s: float
    topic: str
    value: float


class Listener:
    """Its process, and the messages it has received."""

    def __init__(self, process: subprocess.Popen[str], file: Path) -> None:
        self._process = process
        file.touch()
        self._lines = file.open(encoding="utf-8")
        self._part = ""  # of a line that is being written
        self._messages: dict[str, list[Message]] = defaultdict(list)

    def publish(self, topic: str, value: str) -> None:
        """Publish a value; received() has the instant."""
        assert self._process.stdin is not None
        print(topic, value, file=self._process.stdin)

    def received(self, topic: str, since_s: float) -> list[Message]:
        """Messages of a topic since an instant."""
        *lines, self._part = (self._part + self._lines.read()).split("\n")
        for line in lines:
            time_s, name, value = line.split()
            self._messages[name].append(Message(float(time_s), name, float(value)))
        return [message for message in self._messages[topic] if message.time_s >= since_s]


class Ending(NamedTuple):
    """The messages of an output at a listener, from its cause on."""

    cause: str
    quality: str
    host: str
    caused_s: float
    messages: list[Message]

    def is_safe(self) -> bool:
        """Whether the last message is the safe one."""
        return bool(self.messages) and self.messages[-1].value == 0.0

    def safe_after_s(self) -> float:
        """From the cause to the first safe message after which no other value comes."""
        others = [index for index, message in enumerate(self.messages) if message.value != 0.0]
        return self.messages[others[-1] + 1 if others else 0].time_s - self.caused_s


class Trial(NamedTuple):
    """One executor's life under one condition."""

    endings: list[Ending]
    watched: list[Ending]  # commands of the remote driver, which its watch decides, from the condition on


class Machines:
    """The two computers and the listeners, for one executor after another."""

    def __init__(self, folder: Path, environment: dict[str, str] | None = None) -> None:
        """Make them.

        Raises:
            HostsError: no such computers can be made here.
        """
        self._folder = folder
        self._environment = _RANGE | (environment or {})
        self._architecture, self._rules = folder / "outputs.yaml", folder / "e_stop.yaml"
        self._architecture.write_text(_architecture(), encoding="utf-8")
        self._rules.write_text(_RULES, encoding="utf-8")
        self._hosts = Hosts([LOCAL, REMOTE])
        self._cable = LossyCable(self._hosts)
        self._processes: list[subprocess.Popen[str]] = []
        self.listeners = {host: self._listen(host, folder / host) for host in (LOCAL, REMOTE)}
        self._executor: ExecutorProcess | None = None

    def run(self, host: str, *words: str, stdout: TextIO | None = None) -> subprocess.Popen[str]:
        """Run a Python program on a computer until close()."""
        wrapper = [*self._hosts.wrapper(host), sys.executable, "-P"]
        process = subprocess.Popen(
            [*wrapper, *words],
            env=os.environ | self._environment,
            stdin=subprocess.PIPE,
            stdout=stdout,
            text=True,
            bufsize=1,
        )
        self._processes.append(process)
        return process

    def _listen(self, host: str, file: Path) -> Listener:
        return Listener(self.run(host, str(_RECORDER), str(file), str(TIMEOUT_S), *OUTPUTS), file)

    def start(self) -> None:
        """Start an executor, until both listeners receive each output and its rule is armed."""
        began_s = time.monotonic()
        given = ["-p", f"architecture:={self._architecture}", "-p", f"rules:={self._rules}"]
        self._executor = ExecutorProcess(
            self._folder, self._environment, given, wrapper=self._hosts.wrapper(LOCAL)
        )
        for listener in self.listeners.values():
            for output in OUTPUTS:
                self._wait_until(lambda: len(listener.received(output, began_s)) > 20)  # noqa: B023
        self._executor.await_output("e_stop: armed")

    def impair(self, condition: str) -> None:
        """Let a condition begin."""
        if condition == STALLED:
            self._in_robot(*_STALL)
        self._cable.set(**CONDITIONS[condition])

    def end(self, condition: str) -> list[Ending]:
        """Let each cause end its outputs, one cause after another, and the executor with the last."""
        reached = (LOCAL,) if condition in (STALLED, CUT) else (LOCAL, REMOTE)
        endings = []
        for cause in CAUSES:
            caused_s = self._cause(cause)
            self._settle(reached, f"reliable/{cause}", caused_s)
            endings += [
                Ending(cause, quality, host, caused_s, self._received(host, quality, cause, caused_s))
                for quality in QUALITIES
                for host in reached
            ]
        return endings

    def restore(self, condition: str) -> None:
        """Let a condition end."""
        if condition == STALLED:
            self._in_robot(*_RESUME)
        self._cable.set()

    def trial(self, condition: str) -> Trial:
        """Let an executor live, and its outputs end once the condition has lasted for a while."""
        self.start()
        began_s = time.monotonic()
        self.impair(condition)
        time.sleep(IMPAIRED_S)
        endings = self.end(condition)
        watched = [
            Ending(cause, "watch", REMOTE, began_s, self._received(REMOTE, "watch/reliable", cause, began_s))
            for cause in CAUSES
        ]
        self.restore(condition)
        return Trial(endings, watched)

    def close(self) -> None:
        """End all of it."""
        if self._executor is not None:
            self._executor.process.kill()
            self._executor.wait()
        for process in self._processes:
            process.kill()
            process.wait()
        self._cable.close()
        self._hosts.close()

    def _received(self, host: str, quality: str, cause: str, since_s: float) -> list[Message]:
        return self.listeners[host].received(f"{quality}/{cause}", since_s)

    def _cause(self, cause: str) -> float:
        """Let it come; returns its instant, s."""
        local, began_s = self.listeners[LOCAL], time.monotonic()
        if cause in _ORDERS:
            topic, value = _ORDERS[cause]
            local.publish(topic, value)
            wait_until(lambda: local.received(topic, began_s))
            began_s = local.received(topic, began_s)[0].time_s
        else:
            assert self._executor is not None
            status, _ = self._executor.end(signal.SIGTERM)
            assert status == 0, self._executor.output
        return began_s

    def _settle(self, hosts: tuple[str, ...], output: str, since_s: float) -> None:
        """Wait for the safe value, as a computer may let listeners wait, and for repairs and copies."""
        until_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < until_s:
            last = [self.listeners[host].received(output, since_s)[-1:] for host in hosts]
            if all(messages and messages[0].value == 0.0 for messages in last):
                break
            time.sleep(0.01)
        time.sleep(SETTLED_S)

    def _wait_until(self, condition: Callable[[], object]) -> None:
        executor = self._executor
        assert executor is not None

        def holds() -> object:
            assert executor.process.poll() is None, executor.output
            return condition()

        wait_until(holds)

    def _in_robot(self, *words: str) -> None:
        subprocess.run([*self._hosts.wrapper(LOCAL), *words], check=True)
