"""With `sentinel: true` outputs are safe after a crash of native code; nothing else lets it publish."""

import contextlib
import itertools
import os
import random
import signal
import socket
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64

from mauve_msgs.msg import ReconfigurationStep
from mauve_msgs.srv import Reconfigure, Start, Stop
from mauve_rt.native_program import native_program, start_native_program

NODE = "/robot_1/executor"
COUNT = "/robot_1/count"
CRASHES = 20
CORES = {"segmentation fault": -3e8, "abort": -4e8, "stack overflow": -5e8}  # what Counter does with it
SIGNALS = {"killed": signal.SIGKILL}
HOWS = (*CORES, *SIGNALS)
ACTIVATE, DEACTIVATE = (
    Transition(id=Transition.TRANSITION_ACTIVATE),
    Transition(id=Transition.TRANSITION_DEACTIVATE),
)


class Heard(NamedTuple):
    """A message, and its number among those of its publisher."""

    value: float
    number: int


class Listener:
    """Everything on a topic."""

    def __init__(self, graph: Any, reliability: str = "reliable", topic: str = COUNT, **more: Any) -> None:
        self._graph = graph
        self.heard: list[Heard] = []
        qos = QoSProfile(depth=1000, reliability=ReliabilityPolicy[reliability.upper()], **more)

        def hear(message: Float64, info: Any) -> None:
            self.heard.append(Heard(message.data, info["publication_sequence_number"]))

        self._subscription = graph.node.create_subscription(Float64, topic, hear, qos)

    def await_counts(self) -> None:
        """Until the executor has sent some more."""
        topic = self._subscription.topic_name
        self._graph.spin_until(lambda: self._graph.node.count_publishers(topic) > 1, "the sentinel")
        self.settle()  # each of the two has to discover the other
        before = len(self.heard)
        self._graph.spin_until(lambda: len(self.heard) > before + 5, "counts")

    def await_safe(self) -> None:
        """Until the last message is the type's zero, and stays it."""
        self._graph.spin_until(lambda: bool(self.heard) and self.heard[-1].value == 0.0, "the safe output")
        self.settle()
        assert self.heard[-1].value == 0.0

    def settle(self, length_s: float = 0.5) -> None:
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


@pytest.mark.parametrize("number", range(CRASHES))
def test_a_crash_at_any_instant_makes_outputs_safe(
    number: int, watched: Callable[..., Path], start_executor: Callable[..., Any], graph: Any
) -> None:
    how, qos = HOWS[number % len(HOWS)], ("reliable", "best_effort")[number // len(HOWS) % 2]
    executor = start_executor("-p", f"architecture:={watched(qos)}")
    listener = Listener(graph, qos)
    listener.await_counts()
    listener.settle(random.uniform(0.0, 0.1))  # noqa: S311 - no secret
    if how in CORES:
        voice = graph.voice(Float64, "/robot_1/set")
        voice.publish(Float64(data=CORES[how]))
    else:
        executor.process.send_signal(SIGNALS[how])
    listener.await_safe()
    assert executor.wait() < 0, "a signal has ended it"
    assert not listener.is_of_one_publisher(), "the sentinel's own"


@pytest.mark.parametrize("how", ["signal", "deactivate", "stopped", "interrupted", "slow"])
def test_nothing_but_a_crash_makes_the_sentinel_publish(
    how: str, watched: Callable[..., Path], start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={watched()}")
    listener = Listener(graph)
    listener.await_counts()
    assert "sentinel" in children(executor.process.pid)
    if how == "deactivate":
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=DEACTIVATE).success
        listener.await_safe()
        executor.process.kill()
    elif how == "stopped":
        executor.process.send_signal(signal.SIGSTOP)
        listener.settle(2.0)
        executor.process.send_signal(signal.SIGCONT)
        listener.await_counts()
        executor.end(signal.SIGTERM)
    elif how == "interrupted":  # as Ctrl-C does
        os.kill(children(executor.process.pid)["sentinel"], signal.SIGINT)
        listener.await_counts()
        assert "sentinel" in children(executor.process.pid)
        executor.end(signal.SIGINT)
    elif how == "slow":
        assert graph.ask(Stop, f"{NODE}/stop", component="counter").success
        listener.settle()
        assert graph.ask(Start, f"{NODE}/start", component="counter").success
        listener.await_counts()
        executor.end(signal.SIGTERM)
    else:
        assert executor.end(signal.SIGTERM)[0] == 0
    listener.await_safe()
    assert listener.is_of_one_publisher()


def test_after_another_activation_the_sentinel_watches_again(
    watched: Callable[..., Path], start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={watched()}")
    listener = Listener(graph)
    listener.await_counts()
    for transition in (DEACTIVATE, ACTIVATE):
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=transition).success
    listener.await_counts()
    executor.process.kill()
    listener.await_safe()
    assert not listener.is_of_one_publisher()


def test_a_late_listener_gets_nothing_from_the_sentinel(
    watched: Callable[..., Path], start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={watched('transient_local')}")
    Listener(graph).await_counts()
    late = Listener(graph, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    late.await_counts()
    assert late.is_of_one_publisher()
    executor.process.kill()
    late.await_safe()


def test_outputs_that_a_request_adds_are_watched(
    watched: Callable[..., Path], start_executor: Callable[..., Any], graph: Any
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
    graph.spin_until(lambda: graph.node.count_publishers("/robot_1/other") == 2, "the sentinel's publisher")
    other.settle(1.0)
    executor.process.kill()
    other.await_safe()
    listener.await_safe()


def test_an_executor_without_its_sentinel_says_so_and_goes_on(
    watched: Callable[..., Path], start_executor: Callable[..., Any], graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={watched()}")
    listener = Listener(graph)
    listener.await_counts()
    statuses: list[DiagnosticArray] = graph.hear(DiagnosticArray, "/diagnostics")

    def levels() -> list[bytes]:
        return [
            status.level
            for array in statuses
            for status in array.status
            if status.name == f"{NODE}: sentinel"
        ]

    graph.spin_until(lambda: DiagnosticStatus.OK in levels(), "that it watches")
    os.kill(children(executor.process.pid)["sentinel"], signal.SIGKILL)
    graph.spin_until(lambda: DiagnosticStatus.ERROR in levels(), "that it is gone")
    executor.await_output("sentinel: it has ended")
    listener.await_counts()
    assert executor.end(signal.SIGTERM)[0] == 0


def test_an_executor_has_no_sentinel_of_itself(executor: Any, graph: Any) -> None:
    listener = Listener(graph)
    graph.spin_until(lambda: len(listener.heard) > 5, "counts")
    assert children(executor.process.pid) == {}


@pytest.fixture
def alone(tmp_path: Path, domain: int) -> Iterator[Callable[[str], Any]]:
    """`alone(status)`: a sentinel of this process, which has the safe output of COUNT; its socket."""
    own, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    status = tmp_path / "status"
    status.write_text("CoreDumping:\t0\n", encoding="ascii")
    pidfd, file = os.pidfd_open(os.getpid()), os.open(status, os.O_RDONLY)
    process = start_native_program(
        native_program("sentinel"),
        (theirs.fileno(), pidfd, file),
        ("1", "/robot_1", "alone"),
        environment=os.environ | {"ROS_DOMAIN_ID": str(domain)},
    )
    theirs.close()
    os.close(pidfd)
    os.close(file)
    qos = struct.pack("<6q", ReliabilityPolicy.RELIABLE, DurabilityPolicy.VOLATILE, 0, 0, 0, 0)
    texts = (COUNT.encode(), b"std_msgs/msg/Float64", bytes(serialize_message(Float64())))
    memory = os.memfd_create("outputs")
    os.write(memory, qos + b"".join(struct.pack("<I", len(text)) + text for text in texts))
    socket.send_fds(own, [b"o"], [memory])
    os.close(memory)
    assert own.recv(100) == b"ready"
    own.send(b"u")

    yield lambda text: status.write_text(text, encoding="ascii")
    own.close()
    with contextlib.suppress(ChildProcessError, ProcessLookupError):
        if os.waitpid(process, os.WNOHANG) == (0, 0):
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)


def test_a_core_dump_is_a_crash_before_it_ends(alone: Callable[[str], Any], graph: Any) -> None:
    listener = Listener(graph)
    graph.spin_until(lambda: graph.node.count_publishers(COUNT) == 1, "the sentinel")
    listener.settle(1.0)
    assert listener.heard == []
    alone("CoreDumping:\t1\n")
    listener.await_safe()
