"""Safe outputs wait for nothing: no interpreter's lock, no console that nobody reads, no request."""

import contextlib
import fcntl
import os
import signal
import socket
import tempfile
import time
import tty
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import ListComponents, LoadRules, Reconfigure, Stop
from mauve_rt._kernel import STOP_TIMEOUT_NS
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
REQUESTS = 100
SMALLEST_PIPE = 4096  # bytes
DEACTIVATE = Transition(id=Transition.TRANSITION_DEACTIVATE)


def counts_of(graph: Any) -> list[Float64]:
    counts: list[Float64] = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 3, "counts")
    return counts


def await_safe(graph: Any, counts: list[Float64]) -> None:
    graph.spin_until(lambda: counts[-1].data == 0.0, "the type's zero, written at the stop")


@pytest.mark.parametrize("sent", [("best_effort", 3), ("reliable", 1)])
@pytest.mark.parametrize("how", ["signal", "deactivate", "stop"])
def test_the_output_of_a_stop_is_sent_three_times_where_a_message_may_be_lost(
    sent: tuple[str, int], how: str, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    qos, times = sent
    text = architecture.read_text(encoding="utf-8")
    published = "name: count, direction: publish"
    architecture.write_text(text.replace(published, f"{published}, qos: {qos}"), encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}")
    reliability = ReliabilityPolicy[qos.upper()]
    counts = graph.hear(Float64, "/robot_1/count", QoSProfile(depth=100, reliability=reliability))
    graph.spin_until(lambda: len(counts) > 3, "counts")
    if how == "deactivate":
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=DEACTIVATE).success
    elif how == "stop":
        assert graph.ask(Stop, f"{NODE}/stop", component="counter").success
    if how != "stop":
        assert executor.end(signal.SIGTERM)[0] == 0
    graph.spin_until(lambda: [count.data for count in counts].count(0.0) >= times, "all of them")
    if how == "stop":
        time.sleep(0.1)  # for one too many
        assert executor.end(signal.SIGTERM)[0] == 0
    assert counts[-times].data == 0.0
    if qos == "best_effort":  # a reliable one is sent again while it is not acknowledged
        assert [count.data for count in counts].count(0.0) == times


@pytest.fixture(params=["pipe", "terminal"])
def unread(request: Any) -> Iterator[int]:
    """The writer's end of something that nobody reads, and that holds a few lines."""
    if request.param == "pipe":
        reader, writer = os.pipe()
        fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, SMALLEST_PIPE)
    else:
        reader, writer = os.openpty()
        tty.setraw(writer)
    yield writer
    os.close(writer)
    os.close(reader)


def test_a_console_that_nobody_reads_holds_up_nothing(
    unread: int, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", console=unread)
    counts = counts_of(graph)
    for number in range(REQUESTS):  # each is a line of some 300 characters
        text = f"'{number:0200}'"
        label = ReconfigurationStep(kind="set_property", target="sleepy", name="label", value=text)
        assert graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[label]).success
    assert graph.ask(ListComponents, f"{NODE}/list_components").components
    assert executor.end(signal.SIGTERM)[0] == 0
    await_safe(graph, counts)


def test_the_bound_of_a_safe_stop_is_told(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}")
    counts_of(graph)
    assert executor.end(signal.SIGTERM)[0] == 0
    assert "a signal makes outputs safe within 5 ms and the longest state that runs" in executor.output
    assert f"runs on for {STOP_TIMEOUT_NS / 1e6:g} ms is given up" in executor.output


def test_a_signal_waits_for_no_lock_of_the_interpreter(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, kept: Callable[[Any], Path]
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}")
    counts = counts_of(graph)
    keeping = kept(executor)
    try:
        graph.spin_until(lambda: keeping.read_text("utf-8") == "keeping", "the interpreter to be kept")
        executor.process.send_signal(signal.SIGTERM)
        await_safe(graph, counts)
        assert keeping.read_text("utf-8") == "keeping", "outputs are safe while the interpreter is kept"
        executor.wait()
    finally:
        keeping.unlink()


def test_a_signal_needs_no_thread_and_no_memory(
    architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8").replace("period_ms: 5000", "period_ms: 20")
    before = "sleepy: {shell: executor_tests/CounterShell, core: executor_tests/"
    text = text.replace(f"{before}Counter,", f"{before}PyForbidding,", 1)
    architecture.write_text(text, encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}")
    counts = counts_of(graph)
    time.sleep(1.0)  # for the threads of the start
    Path(tempfile.gettempdir(), f"mauve_forbidding_{executor.process.pid}").touch()
    await_safe(graph, counts)
    assert executor.wait() == 0, executor.output


class Manager:
    """A service manager, as systemd is one to a service of type notify: it hears what a process says."""

    def __init__(self, folder: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(folder / "notify"))
        self._socket.setblocking(False)
        self.heard: list[tuple[float, str]] = []
        self.environment = {"NOTIFY_SOCKET": str(folder / "notify"), "WATCHDOG_USEC": "1000000"}

    def hear(self, state: str) -> int:
        """How often a state was reported by now."""
        with contextlib.suppress(BlockingIOError):
            while True:
                self.heard.append((time.monotonic(), self._socket.recv(1000).decode()))
        return [said for _, said in self.heard].count(state)

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    manager = Manager(tmp_path)
    yield manager
    manager.close()


def test_a_node_whose_python_is_silent_says_so(
    architecture: Path,
    start_executor: Callable[..., Any],
    graph: Any,
    kept: Callable[[Any], Path],
    manager: Manager,
) -> None:
    words = ("-p", f"architecture:={architecture}", "-p", "node_silent_after_s:=2.0")
    executor = start_executor(*words, environment=manager.environment)
    counts_of(graph)
    graph.spin_until(lambda: manager.hear("READY=1") == 1, "that it is ready")
    graph.spin_until(lambda: manager.hear("WATCHDOG=1") > 1, "that it works")
    assert "silent" not in executor.output
    file = kept(executor)
    try:
        graph.spin_until(lambda: file.read_text("utf-8") == "keeping", "the interpreter to be kept")
        graph.spin_until(lambda: "node: Python has been silent" in executor.output, "that it is silent")
        manager.hear("WATCHDOG=1")
        manager.heard.clear()
        graph.spin_until(lambda: file.read_text("utf-8") == "over", "the interpreter")
        graph.spin_until(lambda: "node: Python works again" in executor.output, "that it works again")
        graph.spin_until(lambda: manager.hear("WATCHDOG=1") > 0, "that it works again")
    finally:
        file.unlink()
    assert executor.end(signal.SIGTERM)[0] == 0
    assert manager.hear("STOPPING=1") == 1


RULES = """\
mauve: 1
rules:
  - name: stuck
    in: executor
    when: {node_silent: {longer_than_s: 2.0}}
    do: [{kind: replace_core, target: counter, name: executor_tests/Backwards}]
"""


def test_a_rule_acts_on_a_silent_python(
    architecture: Path,
    start_executor: Callable[..., Any],
    graph: Any,
    kept: Callable[[Any], Path],
    tmp_path: Path,
) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text(RULES, encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"rules:={rules}")
    counts = counts_of(graph)
    graph.spin_until(lambda: "stuck: armed" in executor.output, "the rule")
    file = kept(executor)
    try:
        graph.spin_until(lambda: file.read_text("utf-8") == "keeping", "the interpreter to be kept")
        graph.spin_until(lambda: counts[-1].data < counts[-2].data, "the core that counts backwards")
        assert file.read_text("utf-8") == "keeping", "the rule has acted while the interpreter is kept"
        graph.spin_until(lambda: "stuck: done" in executor.output, "that it is reported")
    finally:
        file.unlink()
    assert executor.end(signal.SIGTERM)[0] == 0


def test_a_rules_file_that_is_a_pipe_is_refused_at_once(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}")
    counts = counts_of(graph)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    refused = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(pipe))
    assert (refused.success, refused.code) == (False, Code.INVALID), refused
    assert "not a regular file" in refused.message
    assert graph.ask(ChangeState, f"{NODE}/change_state", transition=DEACTIVATE).success
    await_safe(graph, counts)
    assert executor.end(signal.SIGTERM)[0] == 0
