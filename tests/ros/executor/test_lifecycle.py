"""Transitions that fail, and ends at awkward moments."""

import contextlib
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy, QoSProfile

from mauve_msgs.msg import ArchitectureState
from mauve_msgs.srv import ListComponents
from mauve_rt.control.runtime import Runtime
from mauve_rt.errors import PluginError
from mauve_rt.model import ArchitectureModel, load_architecture
from mauve_rt.node.executor.node import ExecutorNode

NODE = "/robot_1/executor"
NUMBER = b"\0\1\0\0" + bytes(8)  # a Float64 in CDR
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@pytest.mark.parametrize(
    ("moment", "number"), [("inactive", signal.SIGINT), ("deactivating", signal.SIGTERM)]
)
def test_signal_between_and_during_transitions(
    moment: str, number: signal.Signals, architecture: Path, start_executor: Callable[..., Any], graph: Any
) -> None:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("core: executor_tests/Counter,", "core: executor_tests/Slow,", 1)
    architecture.write_text(text, encoding="utf-8")
    executor = start_executor("-p", f"architecture:={architecture}", "-p", "autostart:=false")

    def change(transition: int) -> bool:
        wanted = Transition(id=transition)
        return bool(graph.ask(ChangeState, f"{NODE}/change_state", transition=wanted).success)

    def executes() -> bool:
        return bool(graph.ask(ListComponents, f"{NODE}/list_components").components[0].releases > 0)

    assert not change(Transition.TRANSITION_ACTIVATE), "it is not configured, and says so"
    assert change(Transition.TRANSITION_CONFIGURE)
    if moment == "deactivating":
        assert change(Transition.TRANSITION_ACTIVATE)
        graph.spin_until(executes, "a state that takes its time")
        deactivate = Transition(id=Transition.TRANSITION_DEACTIVATE)
        graph.ask_later(ChangeState, f"{NODE}/change_state", transition=deactivate)
    status, _ = executor.end(number)
    assert (status, "Traceback" in executor.output) == (0, False), executor.output


# Nodes in the process of the tests come last: what rclpy keeps of them for a while has their names.


@pytest.fixture
def ros(domain: int) -> Iterator[None]:
    rclpy.init(args=[], domain_id=domain)
    yield
    rclpy.try_shutdown()


def test_failures_and_errors_are_told_and_leave_nothing_behind(
    architecture: Path, graph: Any, ros: None
) -> None:
    troubles: list[Exception] = [PermissionError("the disk is on fire")]

    def load() -> ArchitectureModel:
        if troubles:
            raise troubles.pop()
        return load_architecture(architecture)

    with contextlib.closing(ExecutorNode(Runtime(load), namespace="/robot_1")) as node:
        heard = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)

        def state(words: str) -> str:
            graph.spin_until(lambda: bool(heard) and words in heard[-1].error, f"'{words}' in ~/state")
            heard.clear()
            return str(node._state_machine.current_state[1])

        # What nobody expected: through the error state, where all is released.
        assert node.trigger_configure() == TransitionCallbackReturn.ERROR
        assert state("PermissionError: the disk is on fire") == "unconfigured"
        # What a user can correct.
        good = architecture.read_text(encoding="utf-8")
        architecture.write_text(good.replace("priority: 40", "priority: 400"), encoding="utf-8")
        assert node.trigger_configure() == TransitionCallbackReturn.FAILURE
        assert state("bad priority of component 'counter': expected at most 98") == "unconfigured"
        architecture.write_text(good, encoding="utf-8")
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        assert (state(""), node.has_parameter("counter.step")) == ("inactive", True)
        assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        assert node.trigger_shutdown() == TransitionCallbackReturn.SUCCESS
        assert (state(""), node.has_parameter("counter.step")) == ("finalized", False)


def test_a_cleanup_that_is_refused_closes_nothing(architecture: Path, graph: Any, ros: None) -> None:
    text = architecture.read_text(encoding="utf-8")
    text = text.replace("core: executor_tests/Counter,", "core: executor_tests/Held,", 1)
    architecture.write_text(text, encoding="utf-8")
    runtime = Runtime(lambda: load_architecture(architecture))
    with contextlib.closing(ExecutorNode(runtime, namespace="/robot_1")) as node:
        heard = graph.hear(ArchitectureState, f"{NODE}/state", LATCHED)
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        graph.spin_until(lambda: runtime.components()[0].releases > 0, "a state that executes")
        assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
        assert node.trigger_cleanup() == TransitionCallbackReturn.FAILURE
        words = "component 'counter' still executes state Count"
        graph.spin_until(lambda: bool(heard) and words in heard[-1].error, "the reason in ~/state")
        assert node._state_machine.current_state[1] == "inactive"
        assert node.has_parameter("counter.step")
        assert graph.node.count_publishers("/robot_1/count") == 1
        assert runtime.host.write_resource("set", NUMBER)  # what the state waits for
        graph.spin_until(lambda: not runtime.busy(), "its end")
        assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS


@pytest.mark.parametrize("ends", [True, False])
def test_a_signal_during_the_activation_is_no_error(
    architecture: Path, ros: None, monkeypatch: pytest.MonkeyPatch, *, ends: bool
) -> None:
    def refuse(_self: Runtime) -> None:
        raise PluginError("the process ends")  # any error of the kernel

    monkeypatch.setattr(Runtime, "activate", refuse)
    monkeypatch.setattr("mauve_rt.node.executor.node.process_ends", lambda: ends)
    runtime = Runtime(lambda: load_architecture(architecture))
    with contextlib.closing(ExecutorNode(runtime, namespace="/robot_1")) as node:
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        expected = TransitionCallbackReturn.SUCCESS if ends else TransitionCallbackReturn.FAILURE
        assert node.trigger_activate() == expected
        assert node._state.error == ("" if ends else "the process ends")
