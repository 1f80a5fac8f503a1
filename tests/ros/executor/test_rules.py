"""Rules that the executor runs itself: they act without any Python, are told, and are loaded anew."""

import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_processes import keep_interpreter
from std_msgs.msg import Float64

import mauve_rt.trace
from mauve_msgs.msg import ArchitectureState, ReconfigurationEvent, ReconfigurationStep, SupervisorDecision
from mauve_msgs.srv import ListComponents, ListRules, LoadRules, Reconfigure, ReplaceCore, ResetRule, Stop
from mauve_msgs.srv import Start as StartComponent
from mauve_rt.control.requests import Code
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.recording.ledger import snapshot_of

NODE = "/robot_1/executor"
USUAL, SAFE = "executor_tests/Counter", "executor_tests/Backwards"
SILENCE_S, UNDO_S = 1.0, 0.3  # longer than a busy machine keeps the voice from speaking
ROBOT = """\
mauve: 1
executor: {namespace: /robot_1}
components:
  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
            alternatives: [executor_tests/Backwards, executor_tests/TwinShell, executor_tests/Twin,
                           executor_tests/TwinFsm], priority: 40, properties: {period_ms: 20}}
  python: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
           alternatives: [executor_tests/PyKeeping], properties: {period_ms: 50}}
resources:
  count: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: count, direction: publish}}
  beat: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: beat, direction: subscribe}}
connections:
  - [counter.count, count.write]
"""
RULES = f"""\
mauve: 1
rules:
  - name: quiet
    when: {{silence: {{topic: beat, longer_than_s: {SILENCE_S}}}}}
    do: [{{kind: replace_core, target: counter, name: {SAFE}}}]
    undo: {{for_s: {UNDO_S}, do: [{{kind: replace_core, target: counter, name: {USUAL}}}]}}
"""
ROUND = ["condition_true", "do", "done", "condition_false", "undo", "done"]  # of the rule's decisions
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Voice:
    """Speaks on /robot_1/beat every 50 ms while it is on, from a thread of its own."""

    def __init__(self, graph: Any) -> None:
        self._publisher = graph.voice(Float64, "/robot_1/beat")
        self._on = threading.Event()
        self._end = threading.Event()
        self.stopped_ns = 0  # when it last spoke, by the clock of ROS
        self._thread = threading.Thread(target=self._speak)
        self._thread.start()

    def _speak(self) -> None:
        while not self._end.is_set():
            if self._on.wait(0.05):
                self._publisher.publish(Float64(data=0.0))
                self.stopped_ns = time.time_ns()
                time.sleep(0.05)

    def on(self) -> None:
        self._on.set()

    def off(self) -> None:
        self._on.clear()

    def close(self) -> None:
        self._end.set()
        self._thread.join()


class Robot:
    """An executor with rules, as others see it."""

    def __init__(self, graph: Any, process: Any) -> None:
        self.graph, self.process = graph, process
        self.decisions = graph.hear(SupervisorDecision, f"{NODE}/decisions", LATCHED)
        self.states = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
        self.voice = Voice(graph)
        self.voice.on()

    def told(self) -> list[Any]:
        """The rule's decisions but those that a busy machine adds: what it does was not ready in time."""
        return [each for each in self.decisions if each.rule == "quiet" and each.decision != "suppressed"]

    def said(self) -> list[str]:
        return [each.decision for each in self.told()]

    def core(self, component: str = "counter") -> str:
        newest = self.states[-1].components if self.states else []
        return next((each.core for each in newest if each.name == component), "")

    def await_core(self, core: str) -> None:
        self.graph.spin_until(lambda: self.core() == core, f"core {core}")

    def await_said(self, decision: str, count: int = 1) -> Any:
        self.graph.spin_until(lambda: self.said().count(decision) >= count, f"{count} times {decision}")
        return [each for each in self.decisions if each.decision == decision][count - 1]

    def await_end(self, act: str) -> tuple[Any, Any]:
        """The decisions `act` and `done`, where they are the newest of the rule.

        A busy machine may have kept the voice from speaking before, for as long as the rule waits.
        """

        def newest() -> list[Any]:
            return self.told()[-2:]

        self.graph.spin_until(
            lambda: [each.decision for each in newest()] == [act, "done"], f"the end of {act}"
        )
        assert newest()[1].act == act
        return tuple(newest())

    def nanoseconds(self, decision: Any) -> int:
        return int(decision.stamp.sec) * 1_000_000_000 + int(decision.stamp.nanosec)


@pytest.fixture
def files(tmp_path: Path, plugin_prefix: Path) -> tuple[Path, Path]:
    robot, rules = tmp_path / "robot.yaml", tmp_path / "rules.yaml"
    robot.write_text(ROBOT, encoding="utf-8")
    rules.write_text(RULES, encoding="utf-8")
    return robot, rules


Start = Callable[..., Robot]


@pytest.fixture
def start(files: tuple[Path, Path], graph: Any, start_executor: Callable[..., Any]) -> Iterator[Start]:
    """start(): a robot whose executor runs RULES."""
    robots: list[Robot] = []

    def started(*arguments: str) -> Robot:
        architecture, rules = files
        words = ["-p", f"architecture:={architecture}", "-p", f"rules:={rules}", *arguments]
        robots.append(Robot(graph, start_executor(*words)))
        return robots[-1]

    yield started
    for robot in robots:
        robot.voice.close()


def test_a_rule_writes_a_snapshot_when_its_action_begins(
    start: Start, files: tuple[Path, Path], graph: Any, tmp_path: Path
):
    files[1].write_text(f"{RULES}    snapshot: true\n", encoding="utf-8")
    robot = start("-p", f"bag:={tmp_path / 'kept'}", "-p", "bag_snapshot_s:=30.0")
    robot.await_said("armed")
    robot.await_core(USUAL)
    robot.voice.off()
    robot.await_core(SAFE)
    robot.process.await_output("rule quiet: its snapshot is written to")
    is_there = lambda: [bag for bag in (tmp_path / "kept").glob("snapshot_*") if _is_complete(bag)]  # noqa: E731
    graph.spin_until(is_there, "the snapshot")
    trace = mauve_rt.trace.open(is_there()[0])
    assert "do" in [each.decision for each in trace.decisions if each.rule == "quiet"], "the cause is in it"
    assert trace.lost == 0


def test_a_rule_without_a_recording_into_memory_acts_all_the_same(
    start: Start, files: tuple[Path, Path], graph: Any
):
    files[1].write_text(f"{RULES}    snapshot: true\n", encoding="utf-8")
    robot = start()
    robot.await_said("armed")
    robot.await_core(USUAL)
    robot.voice.off()
    robot.await_core(SAFE)
    robot.process.await_output("rule quiet: no snapshot: a snapshot needs a recording into memory")


def _is_complete(bag: Path) -> bool:
    found = snapshot_of(examine_bag(bag).custom_data)
    return found is not None and found.is_complete


def test_acts_undoes_and_tells(start: Start, graph: Any):
    robot = start()
    events = graph.hear(ReconfigurationEvent, f"{NODE}/events")
    robot.await_said("armed")
    graph.spin_until(lambda: [list(each.rules) for each in robot.states[-1:]] == [["quiet"]], "activation")
    robot.await_core(USUAL)
    robot.voice.off()
    robot.await_core(SAFE)
    do, done = robot.await_end("do")
    assert do.reason.startswith(f"nothing on /robot_1/beat for {SILENCE_S}")
    assert do.silence_s >= SILENCE_S
    assert robot.nanoseconds(do) - robot.voice.stopped_ns > 0.9 * SILENCE_S * 1e9, "no sooner than it may"
    assert done.act == "do"
    assert done.took_s > 0, "a release came after"
    assert done.bound_s > 0
    assert done.message == f"component 'counter' runs {SAFE}, in place of {USUAL}"
    cause = f"quiet: {do.reason}"
    graph.spin_until(lambda: any(event.cause == cause for event in events), "the event")
    event = next(event for event in events if event.cause == cause)
    assert (event.requested_by, event.from_core, event.to_core) == (NODE, USUAL, SAFE)
    robot.voice.on()
    robot.await_core(USUAL)
    robot.await_end("undo")
    assert robot.said() == ["armed", *(ROUND * len(robot.said()))[: len(robot.said()) - 1]]


def test_acts_while_a_component_in_python_keeps_the_interpreter(start: Start, graph: Any, tmp_path: Path):
    """In one call that does not let go of it: no line of Python runs in the executor while the call lasts."""
    robot = start()
    robot.await_said("armed")
    counts = graph.hear(Float64, "/robot_1/count")
    reply = graph.ask(
        ReplaceCore, f"{NODE}/replace_core", component="python", core="executor_tests/PyKeeping"
    )
    assert reply.success, reply.message
    os.mkfifo(pipe := tmp_path / "pipe")
    keeping = keep_interpreter(robot.process, str(pipe))
    try:
        graph.spin_until(lambda: keeping.read_text() == "keeping", "the interpreter to be kept")
        robot.voice.off()

        def counts_down() -> bool:
            return len(counts) > 1 and counts[-1].data < counts[-2].data

        graph.spin_until(counts_down, "the safe core at work")
        assert keeping.read_text() == "keeping", "while the interpreter was still kept"
    finally:
        os.close(os.open(pipe, os.O_RDWR))  # the call ends; does not wait for it
        keeping.unlink()
    robot.await_core(SAFE)
    robot.await_said("done")


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_acts_without_its_supervisor(start: Start, files: tuple[Path, Path], domain: int, number: Any):
    robot = start()
    robot.await_said("armed")
    words = [sys.executable, "-m", "mauve_rt.node.supervisor.main", "--ros-args", "-p", f"rules:={files[1]}"]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    supervisor = subprocess.Popen([*words, "-r", "__ns:=/robot_1"], env=environment)
    try:
        told = robot.graph.hear(SupervisorDecision, "/robot_1/supervisor/decisions", LATCHED)
        robot.graph.spin_until(lambda: supervisor.poll() is None and bool(robot.states), "both")
        supervisor.send_signal(number)
        robot.voice.off()
        robot.await_core(SAFE)
        robot.voice.on()
        robot.await_core(USUAL)
        assert not [each for each in told if each.decision in ("do", "undo", "done")], "it is the executor's"
    finally:
        supervisor.kill()
        supervisor.wait()


def test_takes_up_what_is_in_effect(start: Start, graph: Any, files: tuple[Path, Path]):
    """Loaded anew while degraded: the same rule goes on; another one of the name takes up what is done."""
    robot = start()
    robot.await_said("armed")
    robot.voice.off()
    robot.await_end("do")
    reply = graph.ask(LoadRules, f"{NODE}/load_rules", path="")
    assert (reply.success, reply.message) == (True, "rules at work: 1")
    robot.await_said("armed", 2)
    assert [each.in_effect for each in graph.ask(ListRules, f"{NODE}/list_rules").rules] == [True]
    assert "adopted" not in robot.said()
    files[1].write_text(RULES.replace(f"for_s: {UNDO_S}", "for_s: 0.4"), encoding="utf-8")
    assert graph.ask(LoadRules, f"{NODE}/load_rules", path="").success
    robot.await_said("adopted")
    robot.voice.on()
    robot.await_core(USUAL)


SILENCE = f"{{silence: {{topic: beat, longer_than_s: {SILENCE_S}}}}}"
STOP = RULES.replace(SILENCE, "{value: {topic: beat, field: data, above: 0.5}}")


def pressed(robot: Robot, graph: Any) -> Callable[[float], None]:
    """A stop is pressed by a value that is published once; the function publishes another one."""
    robot.await_said("armed")
    robot.voice.off()
    publisher = graph.voice(Float64, "/robot_1/beat")
    graph.spin_until(lambda: publisher.get_subscription_count() > 0, "the executor to listen")
    time.sleep(0.1)  # the voice has spoken its last
    publisher.publish(Float64(data=1.0))
    robot.await_core(SAFE)
    return lambda value: publisher.publish(Float64(data=value))


def stays_pressed(robot: Robot, graph: Any) -> bool:
    until_s = time.monotonic() + 3 * UNDO_S
    graph.spin_until(lambda: time.monotonic() > until_s, "the time after which it would be undone")
    return robot.core() == SAFE and "undo" not in robot.said()


def test_a_stop_that_lasts_is_not_undone_by_new_rules_or_activations(
    start: Start, graph: Any, files: tuple[Path, Path]
):
    files[1].write_text(STOP, encoding="utf-8")
    robot = start()
    press = pressed(robot, graph)
    for for_s in (UNDO_S, UNDO_S, 0.2):  # the same rule, and another one of its name
        files[1].write_text(STOP.replace(f"for_s: {UNDO_S}", f"for_s: {for_s}"), encoding="utf-8")
        assert graph.ask(LoadRules, f"{NODE}/load_rules", path="").success
        assert stays_pressed(robot, graph)
    for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
        change = Transition(id=transition)
        assert graph.ask(ChangeState, f"{NODE}/change_state", transition=change).success
    robot.await_said("armed", 5)
    assert stays_pressed(robot, graph)
    press(0.0)
    robot.await_core(USUAL)


SAFETY = STOP.replace("name: quiet", "name: quiet\n    safety: true\n    latch: true\n    otherwise: stop")
OTHERS = f"""\
mauve: 1
rules:
  - name: other
    when: {{silence: {{topic: beat, longer_than_s: 1000.0}}}}
    do: [{{kind: replace_core, target: counter, name: {SAFE}}}]
"""


def test_an_active_safety_rule_is_let_go_by_name_only(start: Start, graph: Any, files: tuple[Path, Path]):
    files[1].write_text(SAFETY, encoding="utf-8")
    robot = start()
    press = pressed(robot, graph)
    files[1].write_text(OTHERS, encoding="utf-8")
    reply = graph.ask(LoadRules, f"{NODE}/load_rules", path="")
    assert (reply.success, reply.code) == (False, Code.ACTIVE_SAFETY_RULE)
    assert "--release quiet" in reply.message
    assert robot.core() == SAFE
    press(0.0)
    assert stays_pressed(robot, graph), "it is latched"
    by_hand = {"component": "counter", "core": USUAL, "requested_by": "operator"}
    reply = graph.ask(ReplaceCore, f"{NODE}/replace_core", over="rules", **by_hand)
    assert (reply.success, reply.code) == (False, Code.HELD_BY_RULE)
    assert "--over-rules quiet" in reply.message
    assert graph.ask(LoadRules, f"{NODE}/load_rules", path="", release=["quiet"]).success
    robot.await_core(USUAL)


def test_a_latched_rule_ends_by_a_reset_once_its_cause_is_gone(
    start: Start, graph: Any, files: tuple[Path, Path]
):
    files[1].write_text(SAFETY, encoding="utf-8")
    robot = start()
    press = pressed(robot, graph)
    graph.spin_until(lambda: robot.states[-1].active_rules == ["quiet"], "~/state to name the rule")
    (held,) = robot.states[-1].held
    assert (held.target, held.element, held.holder) == ("counter", "core", "rule quiet")
    assert (USUAL in held.base, SAFE in held.wanted) == (True, True)
    assert graph.ask(ListRules, f"{NODE}/list_rules").held == [held]
    assert graph.ask(ListComponents, f"{NODE}/list_components").held == [held]
    status = rule_health(graph)
    graph.spin_until(lambda: status().values, "the rule in /diagnostics")
    shown = {each.key: each.value for each in status().values}
    assert shown["core of counter: wanted"] == held.wanted
    assert (shown["core of counter: holder"], shown["core of counter: base"]) == ("rule quiet", held.base)
    refused = graph.ask(ResetRule, f"{NODE}/reset_rule", rule="quiet")
    assert (refused.success, refused.code) == (False, Code.CONDITION_NOT_FALSE)
    press(0.0)
    robot.await_said("condition_false")
    assert graph.ask(ResetRule, f"{NODE}/reset_rule", rule="quiet").success
    robot.await_core(USUAL)


def test_a_stop_that_is_pressed_while_rules_are_loaded_is_not_lost(
    start: Start, graph: Any, files: tuple[Path, Path]
):
    files[1].write_text(STOP, encoding="utf-8")
    robot = start()
    press = pressed(robot, graph)
    for offset_s in (0.0, 0.005, 0.01, 0.02, 0.03):
        press(0.0)
        robot.await_core(USUAL)
        reply = graph.ask_later(LoadRules, f"{NODE}/load_rules", path="")
        time.sleep(offset_s)
        press(1.0)
        graph.spin_until(reply.done, "the reply")
        robot.await_core(SAFE)


def test_leaves_alone_what_an_operator_did(start: Start, graph: Any, files: tuple[Path, Path]):
    """The condition is false all along; the rules are loaded anew. What the rule would do is another's."""
    rules = files[1]  # no busy computer keeps the voice from speaking for so long
    rules.write_text(RULES.replace(f"longer_than_s: {SILENCE_S}", "longer_than_s: 100.0"), encoding="utf-8")
    robot = start()
    robot.await_said("armed")
    by_hand = {"component": "counter", "core": SAFE, "requested_by": "operator", "cause": "by hand"}
    assert graph.ask(ReplaceCore, f"{NODE}/replace_core", **by_hand).success
    robot.await_core(SAFE)
    (authors,) = (part.authors for part in robot.states[-1].components if part.name == "counter")
    assert authors == ["core=operator: by hand"]
    components = graph.ask(ListComponents, f"{NODE}/list_components").components
    (listed,) = (part for part in components if part.name == "counter")
    assert listed.authors == authors
    assert graph.ask(LoadRules, f"{NODE}/load_rules", path="").success
    robot.await_said("armed", 2)
    until_s = time.monotonic() + 4 * UNDO_S
    graph.spin_until(lambda: time.monotonic() > until_s, "the time after which it would undo that")
    assert "adopted" not in robot.said()
    assert "undo" not in robot.said()
    assert robot.core() == SAFE


@pytest.mark.parametrize(
    "content",
    [
        "machine git.example.org login robot password hunter2",
        "DB_PASSWORD=hunter2\n",
        "hunter2\n",
        "password: hunter2\n",
        "rules: hunter2\n",
        "-----BEGIN KEY-----\n\thunter2: [\n",
    ],
)
def test_a_reply_shows_nothing_of_a_file_that_holds_no_rules(
    start: Start, graph: Any, tmp_path: Path, content: str
):
    """Who asks may be an account that must not read it."""
    start()
    other = tmp_path / "other"
    other.write_text(content, encoding="utf-8")
    reply = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(other))
    assert (reply.success, reply.code) == (False, Code.INVALID)
    assert reply.message.startswith(f"{other}:")
    assert "its content is not shown" in reply.message
    assert not any(word in reply.message for word in ("hunter2", "password", "machine", "KEY"))


@pytest.mark.parametrize("is_there", [True, False])
def test_a_request_names_rules_below_one_folder_only(
    start: Start, graph: Any, tmp_path: Path, *, is_there: bool
):
    """Also by a link; and whether another file is there is not said."""
    below = tmp_path / "below"
    below.mkdir()
    start("-p", f"rules_folder:={below}")
    if is_there:
        (tmp_path / "outside.yaml").write_text(RULES, encoding="utf-8")
    (below / "link.yaml").symlink_to(tmp_path / "outside.yaml")
    (below / "inside.yaml").write_text(RULES, encoding="utf-8")
    for path in (tmp_path / "outside.yaml", "../outside.yaml", "link.yaml"):
        reply = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(path))
        assert (reply.success, reply.code) == (False, Code.INVALID)
        assert reply.message == (
            f"rules file '{path}': expected a file below {below} (the executor's parameter rules_folder); "
            "copy it there"
        )
    for path in ("inside.yaml", str(below / "inside.yaml")):
        assert graph.ask(LoadRules, f"{NODE}/load_rules", path=path).success


def test_rules_are_loaded_anew_whole_or_not_at_all(start: Start, graph: Any, files: tuple[Path, Path]):
    robot = start()
    robot.await_said("armed")
    rules = files[1]
    for text, place, words in (
        (RULES.replace("silence", "silense"), ":4:", "did you mean silence?"),
        (RULES.replace(SAFE, "executor_tests/NoSuch"), ":5:", "is not installed"),
        (RULES.replace("target: counter", "target: countre", 1), ":5:", "did you mean counter?"),
        ("rules: [", ":1:", ""),
    ):
        rules.write_text(text, encoding="utf-8")
        reply = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(rules))
        assert (reply.success, reply.code) == (False, Code.INVALID)
        assert f"{rules}{place}" in reply.message
        assert words in reply.message
        listed = graph.ask(ListRules, f"{NODE}/list_rules")
        assert [(each.name, each.armed, each.ready) for each in listed.rules] == [("quiet", True, True)]
    second = RULES.partition("rules:\n")[2].replace("quiet", "quieter").replace(str(SILENCE_S), "5.0")
    rules.write_text(RULES + second, encoding="utf-8")
    reply = graph.ask(LoadRules, f"{NODE}/load_rules", path=str(rules))
    assert reply.success, reply.message
    graph.spin_until(lambda: list(robot.states[-1].rules) == ["quiet", "quieter"], "both in ~/state")
    listed = graph.ask(ListRules, f"{NODE}/list_rules")
    assert [each.name for each in listed.rules] == ["quiet", "quieter"]
    assert 0 <= listed.rules[1].next_in_s <= 5.0 or not listed.rules[1].next
    robot.voice.off()
    robot.await_core(SAFE)


def test_the_command_lists_and_loads(start: Start, files: tuple[Path, Path], domain: int):
    robot = start()
    robot.await_said("armed")

    def mauve(*words: str) -> tuple[int, str, str]:
        command = [sys.executable, "-m", "mauve_rt.cli", "rules", *words]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(domain), "COLUMNS": "200"}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    status, out, error = mauve("list", NODE)
    assert (status, error) == (0, "")
    line = next(line.strip() for line in out.splitlines() if line.startswith(" quiet"))
    # A busy machine may have kept the voice from speaking for so long that the rule has acted.
    standing = r"(watching +(do in [\d.]+ s|-)|in effect +(undo in [\d.]+ s|-))"
    assert re.fullmatch(rf"quiet +yes +(true|false) for [\d.]+ s +{standing} +\d+ KiB", line), line
    status, out, _ = mauve("list", NODE, "--json")
    (rule,) = json.loads(out)["rules"]
    assert (rule["name"], rule["where"], rule["ready"]) == ("quiet", "executor", True)
    files[1].write_text(RULES.replace("quiet", "calm"), encoding="utf-8")
    assert mauve("load", NODE) == (0, "rules at work: 1\n", "")
    status, out, _ = mauve("list", NODE)
    assert "calm" in out
    files[1].write_text(RULES.replace("silence", "silense"), encoding="utf-8")
    status, _, error = mauve("load", NODE, str(files[1]))
    assert status == 1
    assert f"{files[1]}:4:" in error
    assert "did you mean silence?" in error


def rule_health(graph: Any) -> Callable[[], Any]:
    """The newest status of the rule in /diagnostics."""
    health = graph.hear(DiagnosticArray, "/diagnostics")

    def status() -> Any:
        found = [each for array in health for each in array.status if each.name == f"{NODE}: rule quiet"]
        return found[-1] if found else DiagnosticStatus()

    return status


def test_what_cannot_be_made_ready_is_an_error_at_once(start: Start, graph: Any):
    robot = start()
    robot.await_said("armed")
    status = rule_health(graph)
    graph.spin_until(lambda: status().message == "watching", "a rule that watches")
    assert status().level == DiagnosticStatus.OK
    # Another shell, which the safe core is not for.
    parts = [("shell", "TwinShell"), ("core", "Twin"), ("fsm", "TwinFsm")]
    steps = [
        ReconfigurationStep(kind=f"replace_{kind}", target="counter", name=f"executor_tests/{name}")
        for kind, name in parts
    ]
    reply = graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=steps)
    assert reply.success, reply.message
    graph.spin_until(lambda: status().level == DiagnosticStatus.ERROR, "the error, long before it is needed")
    assert status().message.startswith("cannot act: ")
    assert SAFE in status().message
    (listed,) = graph.ask(ListRules, f"{NODE}/list_rules").rules
    assert not listed.ready
    assert SAFE in listed.problem


def test_a_rule_whose_component_does_not_run_is_an_error(start: Start, graph: Any):
    robot = start()
    robot.await_said("armed")
    status = rule_health(graph)
    assert graph.ask(Stop, f"{NODE}/stop", component="counter").success
    graph.spin_until(lambda: status().level == DiagnosticStatus.ERROR, "the error")
    assert status().message == "cannot act: component counter is STOPPED"
    (listed,) = graph.ask(ListRules, f"{NODE}/list_rules").rules
    assert listed.problem == "component counter is STOPPED"
    assert graph.ask(StartComponent, f"{NODE}/start", component="counter").success
    graph.spin_until(lambda: status().level == DiagnosticStatus.OK, "a rule that watches")


def test_bad_rules_configure_nothing(
    files: tuple[Path, Path], start_executor: Callable[..., Any], plugin_prefix: Path
):
    architecture, rules = files
    rules.write_text(RULES.replace("target: counter", "target: countre", 1), encoding="utf-8")
    process = start_executor("-p", f"architecture:={architecture}", "-p", f"rules:={rules}")
    assert process.wait() == 2
    assert f"{rules}:5:" in process.output
    assert "did you mean counter?" in process.output
