"""The executor as a process: bad input, signals, kills, faults, lifecycle, names."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.highlevel import AnyReader
from std_msgs.msg import Float64

from mauve_msgs.msg import ArchitectureState, ComponentInfo
from mauve_msgs.srv import ListComponents, Start, Stop
from mauve_rt._kernel import END_SIGNALS
from mauve_rt.control.requests import Code

NODE = "/robot_1/executor"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BAD_INPUT = 2
GONE_S = 8.0  # less than the ten seconds of a request that may hold it up

Starter = Callable[..., Any]


def _topics_of(bag: Path) -> dict[str, int]:
    with AnyReader([bag]) as reader:
        return {topic: info.msgcount for topic, info in reader.topics.items()}


def _one_line(executor: Any) -> str:
    assert executor.wait() == BAD_INPUT, executor.output
    lines = executor.output.splitlines()
    assert len(lines) == 1, executor.output
    return lines[0]


# ---- bad input


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (
            "[counter.set, set.read]",
            "[countr.set, set.read]",
            "17:6: connection from unknown component 'countr'",
        ),
        ("core: executor_tests/Counter,", "core: executor_tests/Unready,", "4:3: component 'counter'"),
        ("CounterFsm,\n            alt", "LoopFsm,\n            alt", "4:84: component 'counter'"),
    ],
)
def test_bad_architecture(
    before: str, after: str, message: str, architecture: Path, start_executor: Starter
) -> None:
    text = architecture.read_text(encoding="utf-8")
    assert before in text
    architecture.write_text(text.replace(before, after, 1), encoding="utf-8")
    line = _one_line(start_executor("-p", f"architecture:={architecture}"))
    assert line.startswith(f"executor: {architecture}:{message}")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "executor: parameter 'architecture' is missing: ros2 run mauve_rt executor"),
        (
            ["-p", "architecture:=nowhere.yaml"],
            "executor: nowhere.yaml:1:1: cannot read the file: No such file",
        ),
        (["-p", "architecture:=FILE", "-p", "use_sim_time:=true"], "use_sim_time: expected false"),
        (
            ["-p", "architecture:=FILE", "-p", "autostart:=perhaps"],
            "parameter autostart: expected true or false",
        ),
        (["-p", "architecture:=FILE", "-p", "bag:=5"], "bag"),
        (
            ["-p", "architecture:=FILE", "-p", "report_phase_timeout_s:=5.0"],
            "report_phase_timeout_s: expected a number of at least 0 and at most 2, found 5",
        ),
        (
            ["-p", "architecture:=FILE", "-p", "counter.step:=99"],
            "(parameter counter.step): expected at least 0",
        ),
        (
            [
                "-p",
                "architecture:=FILE",
                "-p",
                "bag:=BAG",
                "-p",
                "record_topics:=['talk:std_msgs/msg/Flaot64']",
            ],
            "topic to record: expected name, name:package/msg/Type of an installed message",
        ),
        (["-p", "architecture:=FILE", "-p", "conter.step:=1"], "unknown component; did you mean counter?"),
        (
            ["-p", "architecture:=FILE", "-p", "bagg:=BAG"],
            "parameter bagg: an executor has none of that name",
        ),
    ],
)
def test_bad_parameters(
    arguments: list[str], message: str, architecture: Path, start_executor: Starter
) -> None:
    bag = architecture.parent / "bag"
    words = [word.replace("FILE", str(architecture)).replace("BAG", str(bag)) for word in arguments]
    assert message in _one_line(start_executor(*words))


def test_bag_that_exists_already(architecture: Path, start_executor: Starter, tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={tmp_path / 'bag'}")
    assert executor.wait() == BAD_INPUT
    assert str(tmp_path / "bag") in executor.output


# ---- ends


@pytest.mark.parametrize("number", sorted(map(signal.Signals, END_SIGNALS)))
def test_signal_seals_the_bag(
    number: signal.Signals, architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    ignored = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # the executor inherits that
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    signal.signal(signal.SIGHUP, ignored)
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 10, "counts")
    status, seconds = executor.end(number)
    assert (status, "Traceback" in executor.output) == (0, False), executor.output
    assert seconds < GONE_S
    topics = _topics_of(bag)
    assert topics["/robot_1/count"] > 10
    assert topics[f"{NODE}/state"] >= 2
    assert topics[f"{NODE}/trace/batches"] > 0


def test_signal_at_any_moment_of_the_start(
    architecture: Path, start_executor: Starter, tmp_path: Path
) -> None:
    for number in range(8):
        bag = tmp_path / f"bag_{number}"
        executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
        executor.wait_begun()
        time.sleep(0.12 * number)  # any moment is a good one
        status, seconds = executor.end(signal.SIGINT)
        lines = executor.output.splitlines()
        complaints = [line for line in lines if "[INFO]" not in line and "no real time" not in line]
        assert (status, complaints) == (0, [])
        assert seconds < GONE_S
        if bag.exists():
            _topics_of(bag)


def test_signal_while_a_request_waits(architecture: Path, start_executor: Starter, graph: Any) -> None:
    text = architecture.read_text(encoding="utf-8")
    architecture.write_text(
        text.replace("core: executor_tests/Counter,", "core: executor_tests/Slow,", 1), encoding="utf-8"
    )
    executor = start_executor("-p", f"architecture:={architecture}")
    graph.ask_later(Stop, f"{NODE}/stop", component="counter", timeout_s=10.0)
    graph.spin_until(lambda: True, "the request to leave")
    status, seconds = executor.end(signal.SIGINT)
    assert status == 0, executor.output
    assert seconds < GONE_S


def test_killed_executor_leaves_a_bag_that_opens(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 50, "counts")
    executor.end(signal.SIGKILL)
    assert _topics_of(bag)["/robot_1/count"] > 20


def test_outputs_are_safe_at_the_end(executor: Any, graph: Any) -> None:
    counts = graph.hear(Float64, "/robot_1/count")
    graph.spin_until(lambda: len(counts) > 10, "counts")
    executor.end(signal.SIGINT)
    graph.spin_until(lambda: counts[-1].data == 0.0, "the type's zero, written at the stop")


# ---- faults


def test_fault_is_told_at_once_and_the_others_run_on(executor: Any, graph: Any) -> None:
    states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    diagnostics = graph.hear(DiagnosticArray, "/diagnostics")
    voice = graph.voice(Float64, "/robot_1/set")
    voice.publish(Float64(data=-1e9))

    def faulted() -> bool:
        return bool(states) and states[-1].components[0].state == ComponentInfo.FAULTED

    graph.spin_until(faulted, "the fault in ~/state")
    assert "set to something unheard of" in states[-1].components[0].fault
    graph.spin_until(lambda: "component 'counter' is faulted" in executor.output, "the fault on stderr")
    reply = graph.ask(Start, f"{NODE}/start", component="counter")
    assert (reply.success, reply.code) == (False, Code.FAULTED)
    assert "a step configure, or replace_core" in reply.message
    first = graph.ask(ListComponents, f"{NODE}/list_components").components[1].releases

    def told() -> bool:
        levels = {status.name: status.level for status in diagnostics[-1].status} if diagnostics else {}
        return levels.get(f"{NODE}: counter") == DiagnosticStatus.ERROR and f"{NODE}: guard" in levels

    graph.spin_until(told, "the fault in /diagnostics")

    def runs_on() -> bool:
        return bool(graph.ask(ListComponents, f"{NODE}/list_components").components[1].releases > first)

    graph.spin_until(runs_on, "releases of the others")


# ---- real-time rights

NO_RIGHTS = ["prlimit", "--rtprio=0", "--memlock=65536"]
if os.geteuid() == 0:  # root has them whatever the limits say
    NO_RIGHTS = ["setpriv", "--bounding-set=-sys_nice,-ipc_lock", *NO_RIGHTS]


def test_without_real_time_rights_it_runs_and_says_so(
    architecture: Path, start_executor: Starter, graph: Any
) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", wrapper=NO_RIGHTS)
    reply = graph.ask(ListComponents, f"{NODE}/list_components")
    assert not reply.realtime.granted
    assert {part.policy for part in reply.components} == {"SCHED_OTHER"}
    (about_fifo,) = [line for line in reply.realtime.missing if line.startswith("SCHED_FIFO")]
    assert "/etc/security/limits.d" in about_fifo  # how to grant it
    states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    graph.spin_until(lambda: bool(states), "~/state")
    assert states[-1].realtime == reply.realtime
    executor.await_output(about_fifo)
    assert executor.output.count(about_fifo) == 1


def test_require_realtime_refuses_to_run_without(architecture: Path, start_executor: Starter) -> None:
    arguments = ("-p", f"architecture:={architecture}", "-p", "require_realtime:=true")
    executor = start_executor(*arguments, wrapper=NO_RIGHTS)
    assert executor.wait() == 1
    assert executor.output.startswith("executor: real time is required and was not granted: SCHED_FIFO")


# ---- lifecycle and names


def test_lifecycle_step_by_step(architecture: Path, start_executor: Starter, graph: Any) -> None:
    executor = start_executor("-p", f"architecture:={architecture}", "-p", "autostart:=false")

    def change(transition: int) -> str:
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=Transition(id=transition)).success
        return str(graph.ask(GetState, f"{NODE}/get_state").current_state.label)

    def states() -> list[int]:
        return [part.state for part in graph.ask(ListComponents, f"{NODE}/list_components").components]

    assert states() == []
    refused = graph.ask(Stop, f"{NODE}/stop", component="counter")
    assert (refused.code, "is not active" in refused.message) == (Code.NOT_ACTIVE, True)
    for _ in range(2):
        assert change(Transition.TRANSITION_CONFIGURE) == "inactive"
        assert states() == [ComponentInfo.STOPPED] * 3
        assert graph.ask(Start, f"{NODE}/start", component="counter").code == Code.NOT_ACTIVE
        for _ in range(2):
            assert change(Transition.TRANSITION_ACTIVATE) == "active"
            assert states() == [ComponentInfo.RUNNING] * 3
            counts = graph.hear(Float64, "/robot_1/count")
            graph.spin_until(lambda counts=counts: len(counts) > 2, "counts")
            assert change(Transition.TRANSITION_DEACTIVATE) == "inactive"
            assert states() == [ComponentInfo.STOPPED] * 3
        assert change(Transition.TRANSITION_CLEANUP) == "unconfigured"
    architecture.write_text("mauve: 1\n", encoding="utf-8")
    configure = Transition(id=Transition.TRANSITION_CONFIGURE)
    assert not graph.ask(ChangeState, f"{NODE}/change_state", transition=configure).success
    executor.await_output("the file has no 'components'")
    assert executor.end(signal.SIGTERM)[0] == 0


def test_one_file_serves_robots_of_other_names(
    architecture: Path, start_executor: Starter, graph: Any
) -> None:
    start_executor("-p", f"architecture:={architecture}", "-r", "__ns:=/robot_7", "-p", "counter.step:=3")
    counter = graph.ask(ListComponents, "/robot_7/executor/list_components").components[0]
    assert "step=3.0" in counter.properties
    counts = graph.hear(Float64, "/robot_7/count")
    graph.spin_until(lambda: len(counts) > 2, "counts under the other name")


def test_further_topics_are_recorded(
    architecture: Path, start_executor: Starter, graph: Any, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    latched = graph.node.create_publisher(Float64, "/robot_1/decisions", LATCHED)
    latched.publish(Float64(data=1.0))  # said before anybody listened
    topics = "['talk:std_msgs/msg/Float64', 'decisions:std_msgs/msg/Float64:transient_local']"
    executor = start_executor(
        *("-p", f"architecture:={architecture}", "-p", f"bag:={bag}", "-p", f"record_topics:={topics}")
    )
    voice = graph.voice(Float64, "/robot_1/talk")
    for number in range(20):
        voice.publish(Float64(data=float(number)))
        time.sleep(0.1)
    executor.end(signal.SIGINT)
    recorded = _topics_of(bag)
    assert recorded["/robot_1/talk"] > 0
    assert recorded["/robot_1/decisions"] == 1
