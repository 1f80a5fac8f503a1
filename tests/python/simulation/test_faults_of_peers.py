"""Faults that users of other frameworks reported, re-enacted on threads and in virtual time.

docs/concepts/failures_of_peers.md tells of each.
"""

import pytest
from controller_chains import (
    PERIOD_NS,
    Controller,
    ControllerShell,
    Execution,
    Planner,
    chain,
    check_that_no_release_is_lost,
    of,
    value_of,
)
from python_parts import ActFsm
from running_host import Running
from std_msgs.msg import Float64

from mauve_rt._kernel import ActionStep, RuleActions, RuleRunner, RuleSpec, WhenSpec
from mauve_rt.api import MauveError, SharedData
from mauve_rt.control.faults import FaultWatch

# ---- ros-controls/ros2_control #2681: a controller fails in update, and others of its chain go on


class WearsOut(Controller):
    def act(self) -> None:
        super().act()
        if len(of(self.log, type(self).__name__)) == 5:
            raise RuntimeError("worn out")


@pytest.fixture
def broken_chain(running: Running) -> Running:
    """Planner, middle and drive; the middle one has a fault in its fifth execution."""
    chain(running.stage, ("planner", Planner), ("middle", WearsOut), ("drive", Controller))
    running.deploy()
    return running


def test_after_a_fault_those_behind_read_the_declared_output_and_run_on(
    broken_chain: Running, log: list[Execution]
):
    running = broken_chain
    running.run_until(lambda: running.state("middle") == "FAULTED")
    executed = len(log)
    running.run_until(lambda: len(log) > executed + 20)
    assert "RuntimeError: worn out" in running.architecture.component("middle").describe().fault
    assert len(of(log, "WearsOut")) == 5
    assert value_of(running, "middle") == 0.0
    read = [execution.value for execution in of(log, "Controller")]
    assert set(read) <= {0.0, Planner.value}, "what was written, or the declared output"
    assert set(read[-5:]) == {0.0}
    if running.simulated:
        assert read[:5] == [Planner.value] * 4 + [0.0], "at the instant of the fault"
    check_that_no_release_is_lost(running, of(log, "Controller"), "drive")


def test_a_rule_stops_the_whole_chain_after_a_fault_of_one(broken_chain: Running):
    running = broken_chain
    rule = RuleSpec(
        "chain", WhenSpec("fault", parameters={"component": "middle"}), about=["planner", "drive"]
    )
    steps = [ActionStep("stop", "planner"), ActionStep("stop", "drive")]
    runner = RuleRunner(running.host, [rule], [RuleActions(steps)])
    if not running.simulated:
        runner.start()

    def stopped() -> bool:
        if running.simulated:
            runner.advance()
        return running.state("planner") == running.state("drive") == "STOPPED"

    try:
        running.run_until(stopped)
    finally:
        runner.stop()
    assert running.state("middle") == "FAULTED"
    assert [value_of(running, name) for name in ("planner", "middle", "drive")] == [0.0] * 3
    assert [told.decision.decision for told in runner.wait_told(0)] == [
        *("armed", "condition_true", "do", "done")
    ]


# ---- ros-controls/ros2_control #3038: the fallbacks of all in a chain come, not of the failed one alone


class First(Controller):
    def act(self) -> None:
        super().act()
        if len(of(self.log, "First")) == 5:
            raise RuntimeError("worn out")


class FirstSafe(Controller):
    pass


class Second(Controller):
    pass


class SecondSafe(Controller):
    pass


def test_only_the_one_that_failed_falls_back(running: Running, log: list[Execution]):
    """Two controllers read from one hub, and each of them has a fallback."""
    chain(running.stage, ("hub", Planner))
    for name, core, fallback in (("first", First, FirstSafe), ("second", Second, SecondSafe)):
        running.architecture.add_component(name, ControllerShell, core, ActFsm, fallback=fallback)
        running.stage.share(name, SharedData(Float64), f"{name}.command.write")
        running.architecture.connect(name, "reference", "hub", "read")
    running.deploy()
    running.run_until(lambda: of(log, "FirstSafe"))
    executed = len(log)
    running.run_until(lambda: len(log) > executed + 20)
    assert not of(log, "SecondSafe")
    parts = {part.name: part for part in running.architecture.components()}
    assert {name: (part.state, part.fell_back) for name, part in parts.items()} == {
        "hub": ("RUNNING", False),
        "first": ("RUNNING", True),
        "second": ("RUNNING", False),
    }
    assert "RuntimeError: worn out" in parts["first"].fault
    assert parts["second"].fault == parts["hub"].fault == ""
    assert {execution.value for execution in of(log, "FirstSafe")} == {Planner.value}
    if running.simulated:
        assert of(log, "FirstSafe")[0].clock_ns - of(log, "First")[-1].clock_ns == PERIOD_NS
    check_that_no_release_is_lost(running, of(log, "Second"), "second")
    check_that_no_release_is_lost(running, of(log, "Planner"), "hub")


# ---- dora-rs/dora #389: an operator fails after it was reloaded; is it noticed when the old one comes back?


class Edited(Controller):
    """A new version that fails at its third instant."""

    def act(self) -> None:
        if len(of(self.log, "Edited")) == 2:
            raise ZeroDivisionError("division by zero")
        super().act()


@pytest.mark.parametrize("fallback", [None, Controller], ids=["no fallback", "the old core as fallback"])
def test_a_new_core_that_fails_is_reported_and_what_runs_then_is_what_was_declared(
    running: Running, log: list[Execution], fallback: type[Controller] | None
):
    chain(running.stage, ("planner", Planner))
    architecture, watch = running.architecture, FaultWatch()
    drive = architecture.add_component("drive", ControllerShell, Controller, ActFsm, fallback=fallback)
    running.stage.share("drive", SharedData(Float64), "drive.command.write")
    architecture.connect("drive", "reference", "planner", "read")
    running.deploy()
    running.run_until(lambda: of(log, "Controller"))
    assert list(watch.look(architecture.components())) == []
    worked = drive.describe().core
    report = running.host.replace_core("drive", Edited)
    assert report.to_core.endswith("/Edited")

    running.run_until(lambda: drive.describe().fault)
    if fallback is not None:
        running.run_until(lambda: log[-1].core == "Controller")
    described = drive.describe()
    assert "ZeroDivisionError: division by zero" in described.fault
    assert len(of(log, "Edited")) == 2
    (fault,) = watch.look(architecture.components())
    if fallback is None:
        assert (described.state, described.fell_back) == ("FAULTED", False)
        assert described.core.endswith("/Edited"), "it does not run, and nothing runs in its place"
        assert value_of(running, "drive") == 0.0
        assert fault.message == "component 'drive' is faulted"
        with pytest.raises(MauveError, match="FAULTED"):
            running.host.start("drive")
        running.host.replace_core("drive", Controller)
        running.host.start("drive")
    else:
        assert (described.state, described.fell_back) == ("RUNNING", True)
        assert described.core == worked, "the name of what runs, not of what was asked for"
        assert fault.message == f"component 'drive' runs its fallback core {worked} after a fault"
    executed = len(log)
    running.run_until(lambda: len(of(log[executed:], "Controller")) > 5)
    check_that_no_release_is_lost(running, of(log, "Planner"), "planner")
