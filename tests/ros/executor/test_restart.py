"""What rules and persons decided outlasts the executor's process, however it ends."""

import os
import random
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64

from mauve_msgs.msg import ArchitectureState, ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import (
    ListComponents,
    LoadRules,
    Reconfigure,
    ReleaseRules,
    ReplaceCore,
    ResetRule,
)
from mauve_rt.control.requests import Code

STOPPED, RUNNING = ComponentInfo.STOPPED, ComponentInfo.RUNNING
KILLS = int(os.environ.get("MAUVE_RESTART_KILLS", "6"))
LONGEST_S = 3.0  # from the start of an executor to its kill: it runs by then
NODE = "/robot_1/executor"
USUAL, SAFE = "executor_tests/Counter", "executor_tests/Backwards"
ROBOT = f"""\
mauve: 1
executor: {{namespace: /robot_1}}
components:
  counter: {{shell: executor_tests/CounterShell, core: {USUAL}, fsm: executor_tests/CounterFsm,
            alternatives: [{SAFE}], properties: {{period_ms: 20}}}}
  other: {{shell: executor_tests/CounterShell, core: {USUAL}, fsm: executor_tests/CounterFsm,
          alternatives: [{SAFE}], properties: {{period_ms: 20}}}}
resources:
  count: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {{name: count, direction: publish}}}}
  pressed: {{kind: shared_data, type: std_msgs/msg/Float64, topic: {{name: pressed, direction: subscribe}}}}
connections:
  - [counter.count, count.write]
"""
RULES = """\
mauve: 1
rules:
  - name: e_stop
    safety: true
    latch: true
    otherwise: stop
    when: {value: {topic: pressed, field: data, above: 0.5}}
    do: [{kind: stop, target: counter}]
    undo: {}
"""
OTHERS = RULES.replace("e_stop", "another").replace("target: counter", "target: other")
LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Robot:
    """One executor after another, of one name and state folder, as others see them."""

    def __init__(self, graph: Any, start_executor: Callable[..., Any], folder: Path) -> None:
        self.graph, self.folder = graph, folder
        self._start = start_executor
        self.file = folder / "state" / "robot_1__executor.state"
        self.architecture, self.rules = folder / "robot.yaml", folder / "rules.yaml"
        self.architecture.write_text(ROBOT, encoding="utf-8")
        self.rules.write_text(RULES, encoding="utf-8")
        self.states = self._hear(ArchitectureState, f"{NODE}/state", LATCHED)
        self.counts = self._hear(Float64, "/robot_1/count")
        self.health = self._hear(DiagnosticArray, "/diagnostics")
        self._button = graph.node.create_publisher(Float64, "/robot_1/pressed", 10)
        self.process: Any = None

    def _hear(self, message_type: Any, topic: str, qos: Any = 100) -> list[Any]:
        """As Graph.hear(), before there is a publisher."""
        heard: list[Any] = []
        self.graph.node.create_subscription(message_type, topic, heard.append, qos)
        return heard

    def begin(self, *arguments: str, **options: Any) -> None:
        """Another process; it may not be ready yet."""
        words = ["-p", f"architecture:={self.architecture}", "-p", f"rules:={self.rules}"]
        words += ["-p", f"state_folder:={self.file.parent}", *arguments]
        self.process = self._start(*words, **options)

    def start(self, *arguments: str, **options: Any) -> None:
        self.begin(*arguments, **options)
        known = {state.instance_id for state in self.states}
        self.graph.spin_until(lambda: self._newest_id() not in {*known, ""}, "the executor's ~/state")
        self.process.await_output("activated")

    def _newest_id(self) -> str:
        active = [state.instance_id for state in self.states if state.deployment_epoch_ns]
        return active[-1] if active else ""

    def kill(self) -> None:
        self.process.process.kill()
        self.process.wait()
        self.spin(0.3)  # what it published may be on its way
        self.counts.clear()

    def spin(self, for_s: float) -> None:
        until_s = time.monotonic() + for_s
        self.graph.spin_until(lambda: time.monotonic() >= until_s, "the end of a pause")

    def restart(self, *arguments: str, **options: Any) -> None:
        self.kill()
        self.start(*arguments, **options)

    def press(self, value: float = 1.0) -> None:
        self.graph.spin_until(self._button.get_subscription_count, "the executor to listen")
        self._button.publish(Float64(data=value))

    def component(self, name: str = "counter") -> Any:
        listed = self.graph.ask(ListComponents, f"{NODE}/list_components").components
        return next(each for each in listed if each.name == name)

    def await_state(self, state: int, name: str = "counter") -> None:
        self.graph.spin_until(lambda: self.component(name).state == state, f"{name} in state {state}")

    def latch(self) -> None:
        """Press until the rule has stopped the component, and the file says so."""

        def is_kept() -> bool:
            self.press()
            time.sleep(0.02)
            return self.file.exists() and 'rule "e_stop"' in self.file.read_text(encoding="utf-8")

        self.graph.spin_until(is_kept, "the rule in the state file")
        self.await_state(STOPPED)

    def stands_still(self) -> bool:
        """Nothing was executed since the restart, and nothing published."""
        self.spin(0.2)
        listed = self.component()
        return (listed.state, int(listed.releases), self.counts) == (STOPPED, 0, [])

    def ask_reset(self, rule: str = "e_stop") -> Any:
        return self.graph.ask(ResetRule, f"{NODE}/reset_rule", rule=rule)

    def reset(self, rule: str = "e_stop") -> None:
        """Once the cause is gone."""

        def is_reset() -> bool:
            self.press(0.0)
            time.sleep(0.02)
            return bool(self.ask_reset(rule).success)

        self.graph.spin_until(is_reset, "the reset")
        self.await_forgotten(rule)

    def await_forgotten(self, rule: str = "e_stop") -> None:
        """A kill before it would lose the reset."""
        self.graph.spin_until(
            lambda: f'"{rule}"' not in self.file.read_text(encoding="utf-8"), "a state file without the rule"
        )

    def await_error(self, words: str) -> None:
        """In /diagnostics, of the state folder."""

        def is_said() -> bool:
            return any(
                status.name == f"{NODE}: state folder"
                and status.level == DiagnosticStatus.ERROR
                and words in status.message
                for array in self.health
                for status in array.status
            )

        self.graph.spin_until(is_said, words)


@pytest.fixture
def robot(graph: Any, start_executor: Callable[..., Any], tmp_path: Path, plugin_prefix: Path) -> Robot:
    return Robot(graph, start_executor, tmp_path)


def test_a_latched_stop_outlasts_a_kill_until_its_reset(robot: Robot):
    robot.start()
    robot.latch()
    robot.restart()
    assert robot.stands_still()
    robot.process.await_output("rule e_stop is active, as before the restart: stop counter")
    assert (refused := robot.ask_reset()).code == Code.CONDITION_NOT_FALSE, "it is unknown"
    assert "not known to be false" in refused.message
    robot.reset()
    robot.await_state(RUNNING)
    robot.graph.spin_until(lambda: bool(robot.counts), "the counter")
    robot.restart()
    robot.await_state(RUNNING)


def test_a_latched_stop_outlasts_kills_at_any_instant(robot: Robot):
    """Also while an executor starts, or writes its file."""
    seed = random.randrange(2**32)  # noqa: S311
    chance = random.Random(seed)  # noqa: S311
    robot.start()
    robot.latch()
    for number in range(KILLS):
        robot.kill()
        robot.begin()
        robot.spin(chance.uniform(0.0, LONGEST_S))
        assert not robot.counts, f"it drove after kill {number + 1}; seed {seed}"
    robot.restart()
    assert robot.stands_still()
    robot.reset()
    robot.await_state(RUNNING)


def test_an_end_in_order_keeps_it_too(robot: Robot):
    robot.start()
    robot.latch()
    assert robot.process.end(signal.SIGTERM)[0] == 0
    robot.spin(0.3)  # as after a kill
    robot.counts.clear()
    robot.start()
    assert robot.stands_still()


def test_a_rule_that_the_file_lacks_stays_until_it_is_released(robot: Robot):
    robot.start()
    robot.latch()
    robot.rules.write_text(OTHERS, encoding="utf-8")
    robot.restart()
    robot.process.await_output("mauve rules release e_stop")
    assert robot.stands_still()
    assert "mauve rules release e_stop" in robot.ask_reset().message
    robot.restart()
    assert robot.stands_still()
    assert robot.graph.ask(ReleaseRules, f"{NODE}/release_rules", rule="e_stop").success
    robot.await_state(RUNNING)


@pytest.mark.parametrize("goes_on", [True, False])
def test_it_goes_on_or_is_let_go_by_rules_that_are_loaded(robot: Robot, *, goes_on: bool):
    robot.start()
    robot.latch()
    robot.rules.write_text(OTHERS, encoding="utf-8")
    robot.restart()
    if goes_on:
        robot.rules.write_text(RULES, encoding="utf-8")
    release = [] if goes_on else ["e_stop"]
    assert robot.graph.ask(LoadRules, f"{NODE}/load_rules", path="", release=release).success
    if goes_on:
        assert robot.stands_still()
        robot.reset()
    robot.await_state(RUNNING)


def state_file(*records: str) -> str:
    """The text of one."""
    text = "".join(f"{line}\n" for line in ("mauve_rt state 1", *records))
    sum_ = 0xCBF29CE484222325
    for byte in text.encode():
        sum_ = (sum_ ^ byte) * 0x100000001B3 % 2**64
    return f"{text}sum {sum_:016x}\n"


def damaged(robot: Robot) -> dict[str, Any]:
    robot.file.write_text(state_file()[:-2], encoding="utf-8")
    return {}


def mounted(robot: Robot, options: str, command: str = ":") -> dict[str, Any]:
    folder = robot.file.parent
    script = f'mount -t tmpfs -o {options} none {folder} && {command}; exec "$@"'
    return {"wrapper": ("unshare", "-m", "sh", "-c", script, "sh")}


def read_only(robot: Robot) -> dict[str, Any]:
    return mounted(robot, "ro,size=64k")


def full(robot: Robot) -> dict[str, Any]:
    return mounted(
        robot, "size=64k", f"dd if=/dev/zero of={robot.file.parent}/all bs=4k count=99 2>/dev/null"
    )


def no_folder(robot: Robot) -> dict[str, Any]:
    robot.file.parent.rmdir()
    robot.file.parent.write_text("a file", encoding="utf-8")
    return {}


@pytest.mark.parametrize("trouble", [damaged, read_only, full, no_folder])
def test_what_cannot_be_known_or_kept_stops_the_components_of_safety_rules(
    robot: Robot, trouble: Callable[[Robot], dict[str, Any]]
):
    if trouble in (read_only, full) and os.geteuid() != 0:
        pytest.skip("only root mounts")
    robot.file.parent.mkdir()
    options = trouble(robot)
    robot.start(**options)
    assert robot.stands_still()
    robot.await_state(RUNNING, "other")
    robot.process.await_output("stopped until mauve rules reset e_stop: counter")
    robot.await_error("stopped until mauve rules reset e_stop: counter")
    robot.restart(**options)
    assert robot.stands_still(), "also a second time"
    assert robot.ask_reset().success
    robot.await_state(RUNNING)
    if trouble is damaged:
        assert len(list(robot.file.parent.glob("*.20*"))) == 1, "it is put aside"
        robot.await_forgotten()
        robot.restart()
        robot.await_state(RUNNING)
    else:
        robot.await_error("the state file cannot be written")


def test_a_fresh_start_puts_the_file_aside(robot: Robot):
    robot.start()
    robot.latch()
    robot.restart("-p", "forget:=true")
    robot.await_state(RUNNING)
    (aside,) = robot.file.parent.glob("*.20*")
    assert 'rule "e_stop"' in aside.read_text(encoding="utf-8")
    robot.restart()
    robot.await_state(RUNNING)


def test_what_a_person_chose_outlasts_it_unless_the_file_says_another_thing(robot: Robot):
    robot.start()
    by = {"requested_by": "operator"}
    assert robot.graph.ask(ReplaceCore, f"{NODE}/replace_core", component="counter", core=SAFE, **by).success
    step = ReconfigurationStep(kind="set_property", target="counter", name="step", value="2.0")
    assert robot.graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[step], **by).success
    robot.graph.spin_until(lambda: "step" in robot.file.read_text(encoding="utf-8"), "the file")
    robot.restart()
    robot.process.await_output("as before the restart, by operator")
    assert robot.component().core == SAFE
    assert "step=2.0" in robot.component().properties
    text = ROBOT.replace("period_ms: 20", "period_ms: 20, step: 4.0", 1)
    robot.architecture.write_text(text, encoding="utf-8")
    robot.restart()
    robot.process.await_output("the architecture file has another value now")
    assert robot.component().core == SAFE
    assert "step=4.0" in robot.component().properties


def test_a_core_in_quarantine_is_not_put_in_by_a_restart(robot: Robot):
    robot.start()
    robot.kill()
    rejected = f'rejected "counter" "core" replace_core "counter" "{USUAL}" none'
    robot.file.write_text(state_file(rejected), encoding="utf-8")
    robot.start()
    robot.process.await_output(f"in quarantine, as before the restart: replace_core counter {USUAL}")
    assert robot.stands_still(), "no other core is known"
    robot.architecture.write_text(
        ROBOT.replace("alternatives", f"fallback: {SAFE}, alternatives", 1), "utf-8"
    )
    robot.restart()
    robot.await_state(RUNNING)
    assert robot.component().core == SAFE
    assert robot.graph.ask(ResetRule, f"{NODE}/reset_rule", component="counter").success
    robot.graph.spin_until(lambda: "rejected" not in robot.file.read_text(encoding="utf-8"), "the file")
    robot.restart()
    assert robot.component().core == USUAL


@pytest.mark.parametrize("rule", ["e_stop", "gone"])
def test_what_a_rule_wants_and_cannot_have_stops_its_components(robot: Robot, rule: str):
    """Its core is not installed any longer. The rules file has the rule, or not."""
    robot.start()
    robot.kill()
    wanted = 'assigns "counter" "core" replace_core "counter" "executor_tests/Gone" none'
    text = state_file(f'rule "{rule}" "" 0 true false true false', wanted)
    robot.file.write_text(text, encoding="utf-8")
    robot.start()
    robot.process.await_output(f"rule {rule} cannot be put in force")
    assert robot.stands_still()
    robot.restart()
    assert robot.stands_still()
    assert not robot.ask_reset(rule).success
    if rule == "e_stop":
        robot.reset()
    else:
        assert robot.graph.ask(ReleaseRules, f"{NODE}/release_rules", rule=rule).success
    robot.await_state(RUNNING)


def test_a_latched_rule_without_a_folder_is_warned_of(robot: Robot):
    robot.start("-p", "state_folder:=''")
    robot.process.await_output("rule e_stop is latched, and state_folder is empty")
