"""With `sentinel: true` outputs are safe after a crash of native code; nothing else lets it publish."""

import ctypes
import itertools
import os
import random
import signal
import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import Reconfigure
from mauve_rt.native_program import native_program, start_native_program

NODE = "/robot_1/executor"
COUNT = "/robot_1/count"
CRASHES = 6
CORES = {"segmentation fault": -3e8, "abort": -4e8, "stack overflow": -5e8}  # what Counter does with it
HOWS = (*CORES, "killed")
ACTIVATE, DEACTIVATE = (
    Transition(id=Transition.TRANSITION_ACTIVATE),
    Transition(id=Transition.TRANSITION_DEACTIVATE),
)
ATTACH, DETACH = 16, 17  # of sys/ptrace.h


class Heard(NamedTuple):
    """A message, and its number among those of its publisher."""

    value: float
    number: int


class Listener:
    """Everything on a topic."""

    def __init__(self, graph: Any, reliability: str = "reliable", topic: str = COUNT, **more: Any) -> None:
        self._graph = graph
        self.heard: list[Heard] = []
        self._publishers = 0
        qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy[reliability.upper()], **more)

        def hear(message: Float64, info: Any) -> None:
            self.heard.append(Heard(message.data, info["publication_sequence_number"]))

        def match(event: Any) -> None:
            self._publishers = event.current_count

        events = SubscriptionEventCallbacks(matched=match)
        self._subscription = graph.node.create_subscription(Float64, topic, hear, qos, event_callbacks=events)

    def await_counts(self) -> None:
        """Until it knows the executor's publisher and the sentinel's, and the executor has sent some more."""
        self.await_publishers(2)
        self.await_more()

    def await_more(self) -> None:
        """Until the executor has sent some more."""
        before = len(self.heard)
        self._graph.spin_until(lambda: len(self.heard) > before + 5, "counts")

    def await_publishers(self, number: int) -> None:
        """Until it has discovered so many."""
        self._graph.spin_until(lambda: self._publishers == number, "publishers")

    def await_safe(self) -> None:
        """Until the last message is the type's zero, and stays it."""
        self._graph.spin_until(lambda: bool(self.heard) and self.heard[-1].value == 0.0, "the safe output")
        self.settle()
        assert self.heard[-1].value == 0.0

    def settle(self, length_s: float = 0.3) -> None:
        """Receive all there is, and what comes in this time."""
        until_s = time.monotonic() + length_s
        self._graph.spin_until(lambda: time.monotonic() > until_s, "time")

    def is_of_one_publisher(self) -> bool:
        """Another one's first message would have a smaller number."""
        numbers = [each.number for each in self.heard]
        return all(before < after for before, after in itertools.pairwise(numbers))


def children(process_id: int) -> dict[str, int]:
    """The child processes of a process by their names; one that has ended has none."""
    found = {}
    for task in Path(f"/proc/{process_id}/task").glob("*/children"):
        for child in task.read_text("ascii").split():
            words = Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
            found[Path(words[0].decode()).name] = int(child)
    return found


@pytest.fixture
def watched(architecture: Path) -> Callable[[str], Path]:
    """`watched(qos)`: the architecture with a sentinel, and its topic with this quality of service."""

    def make(qos: str = "reliable") -> Path:
        text = architecture.read_text(encoding="utf-8")
        text = text.replace("{namespace: /robot_1}", "{namespace: /robot_1, sentinel: true}")
        text = text.replace(
            "{name: count, direction: publish}", f"{{name: count, direction: publish, qos: {qos}}}"
        )
        architecture.write_text(text, encoding="utf-8")
        return architecture

    return make


@pytest.fixture
def levels(graph: Any) -> Callable[[str], list[bytes]]:
    """`levels(words)`: of the sentinel's statuses in /diagnostics that have these words, so far."""
    arrays: list[DiagnosticArray] = []
    graph.node.create_subscription(DiagnosticArray, "/diagnostics", arrays.append, 100)

    def find(words: str) -> list[bytes]:
        return [
            status.level
            for array in arrays
            for status in array.status
            if status.name == f"{NODE}: sentinel" and words in status.message
        ]

    return find


@pytest.fixture
def await_watch(levels: Callable[[str], list[bytes]], graph: Any) -> Callable[[str], None]:
    """`await_watch("1 output, 1 subscriber")`: until the sentinel has discovered these."""
    return lambda what: graph.spin_until(lambda: DiagnosticStatus.OK in levels(f"watches {what}"), what)


@pytest.mark.parametrize("number", range(CRASHES))
def test_a_crash_at_any_instant_makes_outputs_safe(
    number: int,
    watched: Callable[..., Path],
    start_executor: Callable[..., Any],
    graph: Any,
    await_watch: Callable[[str], None],
) -> None:
    how, qos = HOWS[number % len(HOWS)], ("reliable", "best_effort")[number % 2]
    executor = start_executor("-p", f"architecture:={watched(qos)}")
    listener = Listener(graph, qos)
    listener.await_counts()
    await_watch("1 output, 1 subscriber")
    listener.settle(random.uniform(0.0, 0.1))  # noqa: S311 - no secret
    if how in CORES:
        voice = graph.voice(Float64, "/robot_1/set")
        voice.publish(Float64(data=CORES[how]))
    else:
        executor.process.kill()
    listener.await_safe()
    assert executor.wait() < 0, "a signal has ended it"
    assert not listener.is_of_one_publisher(), "the sentinel's own"


@pytest.mark.parametrize("how", ["deactivate", "stopped", "debugged", "interrupted"])
def test_nothing_but_a_crash_makes_the_sentinel_publish(
    how: str,
    watched: Callable[..., Path],
    start_executor: Callable[..., Any],
    graph: Any,
    await_watch: Callable[[str], None],
) -> None:
    executor = start_executor("-p", f"architecture:={watched()}")
    listener = Listener(graph)
    listener.await_counts()
    await_watch("1 output, 1 subscriber")
    process = executor.process.pid
    if how == "deactivate":
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=DEACTIVATE).success
        listener.await_safe()
        executor.process.kill()
    elif how == "stopped":
        executor.process.send_signal(signal.SIGSTOP)
        listener.settle(2.0)
        executor.process.send_signal(signal.SIGCONT)
        listener.await_counts()
        assert executor.end(signal.SIGTERM)[0] == 0
    elif how == "debugged":
        ptrace = ctypes.CDLL(None).ptrace
        assert ptrace(ATTACH, process, None, None) == 0
        os.waitpid(process, 0)
        listener.settle(0.5)
        assert ptrace(DETACH, process, None, None) == 0
        assert executor.end(signal.SIGTERM)[0] == 0
    else:  # as Ctrl-C does
        os.kill(children(process)["sentinel"], signal.SIGINT)
        listener.await_counts()
        assert "sentinel" in children(process)
        executor.end(signal.SIGINT)
    listener.await_safe()
    assert listener.is_of_one_publisher()


def test_after_another_activation_the_sentinel_watches_again(
    watched: Callable[..., Path],
    start_executor: Callable[..., Any],
    graph: Any,
    await_watch: Callable[[str], None],
) -> None:
    """And a late listener gets nothing from it before the crash."""
    executor = start_executor("-p", f"architecture:={watched('transient_local')}")
    Listener(graph).await_counts()
    for transition in (DEACTIVATE, ACTIVATE):
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=transition).success
    late = Listener(graph, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    late.await_counts()
    await_watch("1 output, 2 subscribers")
    assert late.is_of_one_publisher()
    executor.process.kill()
    late.await_safe()
    assert not late.is_of_one_publisher()


def test_outputs_that_a_request_adds_are_watched(
    watched: Callable[..., Path],
    start_executor: Callable[..., Any],
    graph: Any,
    await_watch: Callable[[str], None],
) -> None:
    executor = start_executor("-p", f"architecture:={watched()}")
    listener = Listener(graph)
    listener.await_counts()
    component = (
        "{shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm}"
    )
    resource = "{kind: shared_data, type: std_msgs/msg/Float64, topic: {name: other, direction: publish}}"
    steps = [
        ReconfigurationStep(kind="add_resource", target="other", value=resource),
        ReconfigurationStep(kind="add_component", target="second", value=component),
        ReconfigurationStep(kind="connect", target="second", name="count", value="other.write"),
        ReconfigurationStep(kind="start", target="second"),
    ]
    reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    assert reply.success, reply.message
    other = Listener(graph, topic="/robot_1/other")
    other.await_counts()
    await_watch("2 outputs, 2 subscribers")
    executor.process.kill()
    other.await_safe()
    listener.await_safe()


def test_an_executor_without_its_sentinel_says_so_and_goes_on(
    watched: Callable[..., Path],
    start_executor: Callable[..., Any],
    graph: Any,
    levels: Callable[[str], list[bytes]],
) -> None:
    executor = start_executor("-p", f"architecture:={watched()}")
    listener = Listener(graph)
    listener.await_counts()
    os.kill(children(executor.process.pid)["sentinel"], signal.SIGKILL)
    graph.spin_until(lambda: DiagnosticStatus.ERROR in levels("it has ended"), "that it is gone")
    executor.await_output("sentinel: it has ended")
    listener.await_more()
    assert executor.end(signal.SIGTERM)[0] == 0


def test_an_executor_has_no_sentinel_of_itself(executor: Any, graph: Any) -> None:
    Listener(graph).await_more()
    assert children(executor.process.pid) == {}


ALIVE = (
    "Name:\tpython\nVmSize:\t1 kB\nCoreDumping:\t0\nSigPnd:\t0000000000000000\nShdPnd:\t0000000000000000\n"
)
ENDING = {
    "a core dump": ("CoreDumping:\t0", "CoreDumping:\t1"),
    "SIGKILL": ("SigPnd:\t0000000000000000", "SigPnd:\t0000000000000100"),
    "no memory": ("VmSize:\t1 kB\n", ""),
}


@pytest.fixture
def alone(tmp_path: Path, domain: int) -> Iterator[Path]:
    """A sentinel of this process, which has the safe output of COUNT; the status that it reads."""
    own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    status = tmp_path / "status"
    status.write_text(ALIVE, encoding="ascii")
    with theirs:
        process = start_native_program(
            native_program("sentinel"),
            (theirs.fileno(),),
            (str(os.getpid()), str(status), "1", "/robot_1", "alone"),
            environment=os.environ | {"ROS_DOMAIN_ID": str(domain)},
        )
    message = bytes(serialize_message(Float64()))
    reliable, volatile = int(ReliabilityPolicy.RELIABLE), int(DurabilityPolicy.VOLATILE)
    words = f"o{reliable} {volatile} 0 0 0 0 {COUNT} std_msgs/msg/Float64 {len(message)} "
    own.send(words.encode() + message)
    assert own.recv(100) == b"ready"
    own.send(b"u")
    yield status
    own.close()
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)


@pytest.mark.parametrize("sign", ENDING)
def test_a_crash_shows_before_the_process_has_ended(sign: str, alone: Path, graph: Any) -> None:
    listener = Listener(graph)
    listener.await_publishers(1)
    alone.write_text(ALIVE.replace("\n", f"\nGroups:\t{'1 ' * 4000}\n", 1), encoding="ascii")
    listener.settle()
    assert listener.heard == []
    alone.write_text(ALIVE.replace(*ENDING[sign]), encoding="ascii")
    listener.await_safe()
