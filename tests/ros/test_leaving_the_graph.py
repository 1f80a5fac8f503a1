"""What is left of a process that ended in order: nothing, at once.

A DDS participant that is not disposed of stays in the graph of others for its lease, 20 s, and its shared
memory in /dev/shm for ever.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import State, Transition
from lifecycle_msgs.srv import ChangeState, GetState

SOON_S = 8.0  # far below the lease
SEGMENT = re.compile(r"/dev/shm/fastrtps_[0-9a-f]{16}")  # noqa: S108 - of one participant: 0.5 MB
EXECUTOR = "/robot_1/executor"
ENDS = ["SIGINT", "SIGTERM"]

Starter = Callable[..., Any]


def segments_of(process_id: int | str) -> set[Path]:
    """Shared memory of the participants that a process has: it holds their locks; others' it only maps."""
    found = set()
    for descriptor in Path(f"/proc/{process_id}/fd").glob("*"):
        with contextlib.suppress(OSError):  # closed meanwhile
            target = str(descriptor.readlink())
            if SEGMENT.fullmatch(target.removesuffix("_el")) and target.endswith("_el"):
                found.add(Path(target.removesuffix("_el")))
    return found


OWN_SHARED_MEMORY = 'mount -t tmpfs none /dev/shm && "$@"; status=$?; ls /dev/shm > "$0"; exit $status'
"""Other tests' processes are killed beside this one, and leave segments: only of its own it can tell."""


def is_there(graph: Any, name: str) -> bool:
    """Whether the test's own node sees a node of that full name."""
    return any(
        f"{space.rstrip('/')}/{node}" == name for node, space in graph.node.get_node_names_and_namespaces()
    )


def ends_whole(
    graph: Any, process: "subprocess.Popen[bytes]", end: str, name: str, *, by_udp: bool = False
) -> int:
    """End a process whose node is seen; returns its exit status. By UDP there is no shared memory."""
    graph.spin_until(lambda: is_there(graph, name), f"node {name}")
    segments = segments_of(process.pid)
    assert bool(segments) != by_udp, "shared memory of DDS to be left over"
    process.send_signal(getattr(signal, end))
    status = process.wait(SOON_S)
    assert not [path for path in segments if path.exists()]
    graph.spin_until(lambda: not is_there(graph, name), f"{name} to be gone", SOON_S)
    return status


@pytest.fixture
def start_program(domain: int, tmp_path: Path) -> Iterator[Starter]:
    """start_program(module, words ...): `python -m`, in this module's domain, ended with the test."""
    started: list[subprocess.Popen[bytes]] = []

    def start(*words: str) -> "subprocess.Popen[bytes]":
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
        with (tmp_path / "program.log").open("wb") as log:
            command = [sys.executable, "-m", *words]
            started.append(subprocess.Popen(command, env=environment, stdout=log, stderr=log))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def change_state(graph: Any, *transitions: int) -> None:
    for transition in transitions:
        reply = graph.ask(ChangeState, f"{EXECUTOR}/change_state", transition=Transition(id=transition))
        assert reply.success


@pytest.mark.parametrize("end", ENDS)
def test_of_an_active_executor(end: str, executor: Any, graph: Any) -> None:
    def state() -> int:
        return int(graph.ask(GetState, f"{EXECUTOR}/get_state").current_state.id)

    graph.spin_until(lambda: state() == State.PRIMARY_STATE_ACTIVE, "active")
    assert ends_whole(graph, executor.process, end, EXECUTOR) == 0


def test_of_an_executor_with_a_bag(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    graph.spin_until(bag.is_dir, "the bag")
    assert ends_whole(graph, executor.process, "SIGINT", EXECUTOR) == 0


def test_of_an_executor_that_was_shut_down(executor: Any, graph: Any) -> None:
    change_state(graph, Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert ends_whole(graph, executor.process, "SIGTERM", EXECUTOR) == 0


def test_of_an_executor_that_never_started_anything(start_executor: Starter, graph: Any) -> None:
    executor = start_executor("-p", "autostart:=false", "-r", "__ns:=/robot_1")
    assert ends_whole(graph, executor.process, "SIGTERM", EXECUTOR) == 0


@pytest.mark.parametrize(
    "bad",
    [
        "bag_split_s:=-1.0",  # refused by us, when rclpy has made its node
        "start_type_description_service:=5",  # by rclpy, in the midst of it
        "bag:=/proc/no/bag",  # while it is configured
    ],
)
def test_of_a_refused_start(bad: str, architecture: Path, start_executor: Starter, tmp_path: Path) -> None:
    left = tmp_path / "left"
    wrapper = ["unshare", "--mount", "sh", "-c", OWN_SHARED_MEMORY, str(left)]
    if subprocess.run(["unshare", "--mount", "true"], check=False).returncode != 0:
        pytest.skip("no mount namespace can be made here")
    executor = start_executor("-p", f"architecture:={architecture}", "-p", bad, wrapper=wrapper)
    assert executor.wait() == 2, executor.output
    names = left.read_text("utf-8").split()
    assert not [name for name in names if SEGMENT.fullmatch(f"/dev/shm/{name}")]  # noqa: S108


RULES = """\
mauve: 1
rules:
  - name: lost
    when: {silence: {topic: in, type: std_msgs/msg/Bool, longer_than_s: 0.5}}
    do: [{kind: stop, target: counter}]
"""
SUPERVISOR = ["mauve_rt.node.supervisor.main", "--ros-args", "-p", "rules:={rules}"]
RADIO = ["mauve_examples.mission.radio", "--ros-args", "-p", "robots:=[robot_1]"]
EVENTS = ["mauve_rt.cli", "events", EXECUTOR]


@pytest.fixture
def rules(tmp_path: Path) -> Path:
    path = tmp_path / "rules.yaml"
    path.write_text(RULES, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("words", "name", "end"),
    [
        (SUPERVISOR, "/supervisor", "SIGINT"),
        (SUPERVISOR, "/supervisor", "SIGTERM"),
        (RADIO, "/radio", "SIGINT"),
        (RADIO, "/radio", "SIGTERM"),
        (EVENTS, "/mauve_{pid}", "SIGINT"),
    ],
)
def test_of_others(
    words: Sequence[str], name: str, end: str, rules: Path, *, start_program: Starter, graph: Any
) -> None:
    process = start_program(*(word.format(rules=rules) for word in words))
    is_mauve = words is EVENTS
    assert ends_whole(graph, process, end, name.format(pid=process.pid), by_udp=is_mauve) == 0
