"""A stop, a deactivation and the end of the process wait for nobody's preparation, adoption or commit."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from preparations import NODE, Preparation, declare
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float64

from mauve_msgs.msg import ArchitectureState, ComponentInfo, ReconfigurationStep
from mauve_msgs.srv import ListComponents, Reconfigure, ReplaceCore, Stop
from mauve_rt.control.requests import Code

PATIENT = "executor_tests/Patient"
PY_PATIENT = "executor_tests/PyPatient"
CLINGING = "executor_tests/Clinging"
PY_AGREEING = "executor_tests/PyAgreeing"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
TRANSITIONS = {
    "deactivate": Transition.TRANSITION_DEACTIVATE,
    "activate": Transition.TRANSITION_ACTIVATE,
    "cleanup": Transition.TRANSITION_CLEANUP,
    "shutdown": Transition.TRANSITION_ACTIVE_SHUTDOWN,
}


class Stage:
    """An executor whose counter takes misbehaving cores."""

    def __init__(self, graph: Any, folder: Path, executor: Any, *, counts: int = 3) -> None:
        self.graph, self.folder, self.executor = graph, folder, executor
        self.counts = graph.hear(Float64, "/robot_1/count")
        graph.spin_until(lambda: len(self.counts) >= counts, "counts")

    def begin(self, core: str) -> Preparation:
        return Preparation(self.graph, self.folder, core)

    def change(self, transition: str) -> bool:
        wanted = Transition(id=TRANSITIONS[transition])
        return bool(self.graph.ask(ChangeState, f"{NODE}/change_state", transition=wanted).success)

    def state(self) -> str:
        return str(self.graph.ask(GetState, f"{NODE}/get_state").current_state.label)

    def part(self, name: str) -> Any:
        listed = self.graph.ask(ListComponents, f"{NODE}/list_components").components
        return next(part for part in listed if part.name == name)

    def await_safe(self) -> None:
        self.graph.spin_until(lambda: self.counts[-1].data == 0.0, "the type's zero, written at the stop")


@pytest.fixture
def stage(architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path) -> Stage:
    declare(architecture, PATIENT, PY_PATIENT, CLINGING, "executor_tests/PyAsking")
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("[executor_tests/Backwards]", f"[executor_tests/Backwards, {PY_AGREEING}]", 1)
    architecture.write_text(text, encoding="utf-8")
    return Stage(graph, tmp_path, start_executor("-p", f"architecture:={architecture}"))


@pytest.mark.parametrize("core", [PATIENT, PY_PATIENT])
def test_deactivate_waits_for_no_preparation(stage: Stage, core: str) -> None:
    states = stage.graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
    change = stage.begin(core)
    assert stage.change("deactivate")
    stage.await_safe()
    assert {stage.part(name).state for name in ("counter", "guard", "sleepy")} == {ComponentInfo.STOPPED}
    for transition in ("cleanup", "activate"):
        assert not stage.change(transition)
        told = f"a change is still being prepared: replace_core counter {core}"
        stage.graph.spin_until(lambda: bool(states) and told in states[-1].error, "why not")  # noqa: B023
    assert not change.reply.done()
    refused = change.finish()
    assert (refused.success, refused.code) == (False, Code.NOT_ACTIVE)
    assert "not active" in refused.message
    assert stage.part("counter").core == "executor_tests/Counter"
    stage.graph.spin_until(lambda: stage.change("activate"), "another activation")
    stage.counts.clear()
    stage.graph.spin_until(lambda: len(stage.counts) > 2, "counts")


@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "shutdown"])
@pytest.mark.parametrize("core", [PATIENT, PY_PATIENT, CLINGING])
def test_the_end_waits_for_no_change(stage: Stage, how: str, core: str) -> None:
    change = stage.begin(core)
    if how == "shutdown":
        stage.change(how)
        stage.await_safe()
    status, _ = stage.executor.end(signal.SIGTERM if how == "shutdown" else signal.Signals[how])
    assert (status, "Thread 0x" in stage.executor.output) == (0, False), stage.executor.output
    stage.await_safe()
    stage.graph.spin_until(change.reply.done, "the answer to who waits for the change")
    reply = change.reply.result()
    assert (reply.success, reply.code in (Code.NOT_ACTIVE, Code.WRONG_REVISION)) == (False, True), reply
    assert (bool(reply.instance_id), reply.revision > 0) == (True, True)


def test_a_stop_calls_off_a_commit_that_waits_for_another_component(stage: Stage) -> None:
    voice = stage.graph.voice(Float64, "/robot_1/set")
    held = {"component": "counter", "core": "executor_tests/Held"}
    assert stage.graph.ask(ReplaceCore, f"{NODE}/replace_core", **held).success
    stage.graph.spin_until(lambda: stage.part("counter").current_state == "Count", "a state that lasts")
    agreed = stage.folder / "agreed"
    label = ReconfigurationStep(kind="set_property", target="sleepy", name="label", value=f"'{agreed}'")
    assert stage.graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[label]).success
    steps = [
        ReconfigurationStep(kind="set_property", target="counter", name="step", value="2.0"),
        ReconfigurationStep(kind="replace_core", target="sleepy", name=PY_AGREEING),
    ]
    change = stage.graph.ask_later(
        Reconfigure, f"{NODE}/reconfigure", steps=steps, commit_timeout_s=10.0, request_id="both"
    )
    stage.graph.spin_until(agreed.exists, "sleepy's agreement, while the counter executes")
    assert stage.graph.ask(Stop, f"{NODE}/stop", component="sleepy").success
    stage.graph.spin_until(change.done, "its end")
    assert change.result().code == Code.WRONG_REVISION, change.result()
    assert "was started or stopped" in change.result().message
    assert stage.part("counter").current_state == "Count", "which nobody has ended"
    assert (stage.part("sleepy").core, "step=1.0" in stage.part("counter").properties) == (
        "executor_tests/Counter",
        True,
    )
    voice.publish(Float64(data=1.0))


@pytest.mark.parametrize("comes", [False, True])
def test_no_component_waits_for_one_that_still_executes(
    architecture: Path, start_executor: Callable[..., Any], graph: Any, tmp_path: Path, *, comes: bool
) -> None:
    text = architecture.read_text(encoding="utf-8").replace("period_ms: 5000", "period_ms: 20")
    text = text.replace("core: executor_tests/Counter,", "core: executor_tests/Held,", 1)
    architecture.write_text(text, encoding="utf-8")
    stage = Stage(graph, tmp_path, start_executor("-p", f"architecture:={architecture}"), counts=0)
    graph.spin_until(lambda: stage.part("counter").current_state == "Count", "a state that lasts")
    steps = [
        ReconfigurationStep(kind="set_property", target="counter", name="step", value="2.0"),
        ReconfigurationStep(kind="replace_core", target="sleepy", name="executor_tests/Backwards"),
    ]
    fields = {"steps": steps, "commit_timeout_s": 10.0 if comes else 0.5}
    change = graph.ask_later(Reconfigure, f"{NODE}/reconfigure", **fields)
    first = stage.part("sleepy").releases
    graph.spin_until(lambda: stage.part("sleepy").releases > first + 10, "sleepy's releases")
    if not comes:
        graph.spin_until(change.done, "the refusal")
        assert change.result().code == Code.TIMEOUT
        assert stage.part("sleepy").core == "executor_tests/Counter", "nothing is changed"
        return
    assert not change.done(), "the counter has not agreed"
    graph.voice(Float64, "/robot_1/set").publish(Float64(data=1.0))
    graph.spin_until(change.done, "the change")
    assert change.result().success, change.result().message
    assert stage.part("sleepy").core == "executor_tests/Backwards"


def test_a_part_may_ask_its_own_executor_while_it_is_configured(stage: Stage) -> None:
    label = ReconfigurationStep(kind="set_property", target="counter", name="label")
    for asked in ("stop sleepy", "replace_core sleepy"):
        label.value = f"'{asked}'"
        assert stage.graph.ask(Reconfigure, f"{NODE}/reconfigure", steps=[label]).success
        core = {"component": "counter", "core": "executor_tests/PyAsking"}
        assert stage.graph.ask(ReplaceCore, f"{NODE}/replace_core", **core).success
    sleepy = stage.part("sleepy")
    assert (sleepy.state, sleepy.core) == (ComponentInfo.STOPPED, "executor_tests/Counter")
    stage.executor.await_output("a request was refused: another change has been under way")
