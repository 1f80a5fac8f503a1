"""Log lines of components and resources: on /rosout, the console and in the bag; levels by every way."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from rcl_interfaces.msg import Log, LoggerLevel
from rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message

from mauve_msgs.srv import ReplaceCore
from mauve_rt._kernel import Simulation
from mauve_rt.cli.log_level_verb import CHOICES
from mauve_rt.interfaces.log_messages import SEVERITIES
from mauve_rt.simulation.executor import SimulatedExecutor
from mauve_rt.simulation.topics import SimulatedTopics

NODE, LOGGER = "/robot_1/executor", "robot_1.executor"
KEPT = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DEBUG, INFO = 10, 20


def run_mauve(domain: int, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "mauve_rt.cli", *words],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def lines_of(part: str, heard: list[Any]) -> list[Any]:
    return [log for log in heard if log.name == f"{LOGGER}.{part}"]


def recorded(bag: Path) -> list[Any]:
    found = []
    for file in sorted(bag.glob("*.mcap")):
        with file.open("rb") as stream:
            for schema, channel, message in make_reader(stream).iter_messages(["/rosout"]):
                assert schema is not None
                assert (schema.name, channel.topic) == ("rcl_interfaces/msg/Log", "/rosout")
                found.append((message.log_time, deserialize_message(message.data, Log)))
    return found


@pytest.mark.parametrize("core", ["Counter", "PyCounter"])
def test_a_line_is_on_rosout_the_console_and_in_the_bag(
    core: str, start_executor: Callable[..., Any], architecture: Path, tmp_path: Path, graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    before = "core: executor_tests/Counter, fsm: executor_tests/CounterFsm,\n            alternatives"
    assert before in text
    after = before.replace("Counter,", f"{core},", 1).replace(
        "alternatives", "log_level: debug, alternatives"
    )
    architecture.write_text(text.replace(before, after), encoding="utf-8")
    heard = graph.hear(Log, "/rosout", KEPT)
    bag = tmp_path / "bag"
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}")
    graph.spin_until(lambda: len(lines_of("counter", heard)) >= 12, "lines of the counter")
    assert not lines_of("guard", heard), "its level is info"
    (first, *_rest, _last) = lines_of("counter", heard)
    assert first.level == DEBUG
    assert first.msg.startswith("Count: counted to ")
    if core == "Counter":
        assert (first.function.split("(")[0].split()[-1].endswith("act"), first.line > 0) == (True, True)
        assert first.file.endswith("executor_tests.cpp")
    graph.spin_until(lambda: first.msg in executor.output, "the line on the console")
    graph.spin_until(
        lambda: any("more lines within a second]" in log.msg for log in lines_of("counter", heard)),
        "50 lines a second to be bundled",
    )
    assert executor.end(signal.SIGINT)[0] == 0
    found = [(time_ns, log) for time_ns, log in recorded(bag) if log.name == f"{LOGGER}.counter"]
    assert found[0][1] == first
    stamps = [log.stamp.sec * 1_000_000_000 + log.stamp.nanosec for _, log in found]
    assert stamps == sorted(stamps)
    assert [time_ns for time_ns, _ in found] == sorted(time_ns for time_ns, _ in found)


def test_levels_are_set_by_mauve_and_by_the_services_of_ros(executor: Any, graph: Any, domain: int) -> None:
    heard = graph.hear(Log, "/rosout", KEPT)
    shown = run_mauve(domain, "log-level", NODE, "counter")
    assert (shown.returncode, shown.stdout) == (0, "counter: info\n"), shown.stderr
    assert not lines_of("counter", heard)
    shown = run_mauve(domain, "log-level", NODE, "counter", "debug")
    assert (shown.returncode, shown.stdout) == (0, "counter: debug\n"), shown.stderr
    graph.spin_until(lambda: bool(lines_of("counter", heard)), "lines of the counter")
    refused = run_mauve(domain, "log-level", NODE, "cuonter", "debug")
    assert refused.returncode == 1
    assert "cuonter" in refused.stderr, "which is none of its components"

    names = [f"{LOGGER}.counter", f"{LOGGER}.set", LOGGER]
    wanted = [LoggerLevel(name=name, level=level) for name, level in zip(names, (40, 10, 10), strict=True)]
    wanted += [LoggerLevel(name=names[0], level=35), LoggerLevel(name=f"{LOGGER}.none", level=10)]
    reply = graph.ask(SetLoggerLevels, f"{NODE}/set_logger_levels", levels=wanted)
    assert [result.successful for result in reply.results] == [True, True, True, False, False]
    assert (
        "expected 10 (debug), 20 (info), 30 (warn), 40 (error), 50 (fatal), found 35"
        in reply.results[3].reason
    )
    reply = graph.ask(GetLoggerLevels, f"{NODE}/get_logger_levels", names=names)
    assert [(level.name, level.level) for level in reply.levels] == list(
        zip(names, (40, 10, 10), strict=True)
    )
    assert executor.process.poll() is None


def test_the_command_takes_the_levels_that_there_are() -> None:
    assert tuple(SEVERITIES) == CHOICES


def test_what_a_refused_core_says_in_its_hook_is_told(executor: Any, graph: Any) -> None:
    heard = graph.hear(Log, "/rosout", KEPT)
    reply = graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core="executor_tests/Unready")
    assert not reply.success
    graph.spin_until(
        lambda: [log.msg for log in lines_of("counter", heard)] == ["nothing is there to get ready with"],
        "the line of the hook",
    )
    assert executor.process.poll() is None


def test_virtual_time_has_the_instants_of_its_lines(architecture: Path, tmp_path: Path) -> None:
    text = architecture.read_text(encoding="utf-8")
    architecture.write_text(text.replace("priority: 40", "priority: 40, log_level: debug"), encoding="utf-8")
    simulation, topics = Simulation(), SimulatedTopics()
    console: list[str] = []
    executor = SimulatedExecutor(
        simulation, topics, architecture, tmp_path / "bag", complain=pytest.fail, console=console.append
    )
    simulation.every(simulation.now_ns(), 50_000_000, executor.record)
    simulation.deploy()
    executor.activate()
    epoch_ns = simulation.epoch_ns()
    simulation.run_until(epoch_ns + 100_000_000)
    executor.close()
    logs = recorded(tmp_path / "bag")
    assert [time_ns for time_ns, _ in logs] == [epoch_ns + n * 20_000_000 for n in range(len(logs))]
    assert [log.msg for _, log in logs] == [f"Count: counted to {n}.0 by 1" for n in range(1, len(logs) + 1)]
    assert len(logs) >= 5
    first = f"[DEBUG] [{epoch_ns / 1e9:.6f}] [{LOGGER}.counter]: Count: counted to 1.0 by 1"
    assert console[0] == first


def test_a_bag_that_takes_rosout_has_each_line_once(
    start_executor: Callable[..., Any], architecture: Path, tmp_path: Path, graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    architecture.write_text(text.replace("priority: 40", "priority: 40, log_level: debug"), encoding="utf-8")
    heard = graph.hear(Log, "/rosout", KEPT)
    bag = tmp_path / "bag"
    topics = ("-p", "record_topics:=['/rosout:rcl_interfaces/msg/Log:transient_local']")
    executor = start_executor("-p", f"architecture:={architecture}", "-p", f"bag:={bag}", *topics)
    graph.spin_until(lambda: len(lines_of("counter", heard)) >= 5, "lines of the counter")
    assert executor.end(signal.SIGINT)[0] == 0
    texts = [log.msg for log in lines_of("counter", [log for _, log in recorded(bag)])]
    assert len(texts) >= 5
    assert len(texts) == len(set(texts))
