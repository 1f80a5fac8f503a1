"""Failures of changes that users of other frameworks reported, re-enacted.

docs/concepts/failures_of_peers.md tells of each. Each test runs on threads and in virtual time, but for those
about a time that only threads take.
"""

import itertools
import threading

import numpy as np
import pytest
from controller_chains import (
    Controller,
    ControllerShell,
    Execution,
    Noted,
    Planner,
    PlannerShell,
    chain,
    check_that_no_release_is_lost,
    of,
    value_of,
)
from python_parts import ActFsm, EmptyShell, Stage
from running_host import Running
from std_msgs.msg import Float64

from mauve_rt.api import Fsm, MauveError, SharedData, Shell, Transaction, ms_to_ns, read_port, write_port
from mauve_rt.trace.format.records import RECORD, Kind

MS = 1_000_000


# ---- ros-controls/ros2_control #2452: controllers are activated in the real-time loop, which overruns


def test_a_loop_runs_on_while_a_new_part_takes_long_to_come_and_an_old_one_to_go(
    built: Stage, log: list[Execution]
):
    """On threads alone: in virtual time nothing passes while parts are prepared."""
    threads: list[int] = []

    def executed_on(core: str) -> None:
        """Returns when the core was executed ten times more."""
        threads.append(threading.get_ident())
        before = len(of(log, core))
        built.until(lambda: len(of(log, core)) >= before + 10)

    class Slow(Controller):
        def configure(self) -> None:
            executed_on("Old")

    class Old(Controller):
        def cleanup(self) -> None:
            executed_on("Slow")

    class Broadcaster(Noted):
        def configure(self) -> None:
            executed_on("Old")

    chain(built, ("planner", Planner), ("drive", Old))
    deployer = built.deploy()
    built.until(lambda: of(log, "Old"))
    report = deployer.commit(
        Transaction()
        .replace_core("drive", Slow)
        .add_component("broadcaster", EmptyShell, Broadcaster, ActFsm)
        .start("broadcaster"),
        phase_timeout_ns=60_000 * MS,
    )
    built.until(lambda: of(log, "Broadcaster"))
    assert len(threads) == 3, "configured twice, cleaned up once"
    assert threads[0] == threads[1], "configured on one thread"
    assert threading.get_ident() not in threads, "configured and cleaned up by threads that hold no change"
    assert {step.component for step in report.steps} == {"drive", "broadcaster"}
    assert [(step.missed_releases, step.phase_nominal_ns) for step in report.steps] == [(0, 0)] * 3


# ---- ros-controls/ros2_control #2808: a service that lists the controllers hangs the control loop


def test_a_loop_does_not_wait_for_those_who_list_it_nor_they_for_the_loop(built: Stage, log: list[Execution]):
    """On threads alone: in virtual time one thing happens after another."""
    go_on = threading.Event()

    class Long(Noted):
        def act(self) -> None:
            self.note(0.0)
            assert go_on.wait(60.0)

    chain(built, ("planner", Planner))
    built.add("long", EmptyShell, Long)
    deployer = built.deploy()
    built.until(lambda: of(log, "Long"))
    before = len(of(log, "Planner"))

    states: set[str] = set()

    def list_often() -> None:
        for _ in range(1000):
            states.update(part.state for part in built.architecture.components())
            built.architecture.describe()

    listing = [threading.Thread(target=list_often) for _ in range(2)]
    try:
        for thread in listing:
            thread.start()
        for thread in listing:
            thread.join()
        assert states == {"RUNNING"}
        assert len(of(log, "Long")) == 1, "each list was answered while a component executes"
        built.until(lambda: len(of(log, "Planner")) > before + 10)
    finally:
        go_on.set()
    records = np.frombuffer(deployer.drain_trace().records, RECORD)
    assert Kind.CONTENDED not in records["kind"], "no component found a lock held"


# ---- ros-controls/ros2_control #2669: one of a chain is not activated, the others follow a zero


class TorqueDrive(Controller):
    """What the drive would run after the change."""


class FailsInConfigure(Planner):
    def configure(self) -> None:
        raise OSError("no torque sensor")


class RefusesToAdopt(Planner):
    def adopt(self, _old: Planner) -> bool:
        return False


@pytest.mark.parametrize(
    ("core", "code"), [(FailsInConfigure, "prepare_failed"), (RefusesToAdopt, "adopt_refused")]
)
def test_a_chain_of_which_one_part_fails_is_not_changed_at_all(
    running: Running, log: list[Execution], core: type[Planner], code: str
):
    chain(running.stage, ("planner", Planner), ("drive", Controller))
    running.stage.architecture.add_resource("wrist", SharedData(Float64))
    running.deploy()
    running.run_until(lambda: value_of(running, "drive") == Planner.value)
    before, begin = running.host.describe(), len(log)
    steps = Transaction().replace_core("drive", TorqueDrive).replace_core("planner", core)
    steps.add_component("wrist", ControllerShell, TorqueDrive, ActFsm)
    steps.connect("wrist", "reference", "planner", "read").connect("wrist", "command", "wrist", "write")
    with pytest.raises(MauveError) as refused:
        running.host.commit(steps.start("wrist"))
    assert (refused.value.code, refused.value.step, refused.value.component) == (code, 2, "planner")
    assert running.host.describe() == before
    executed = len(log)
    running.run_until(lambda: len(log) > executed + 20)
    assert {(execution.core, execution.value) for execution in log[begin:]} == {
        ("Planner", Planner.value),
        ("Controller", Planner.value),
    }
    check_that_no_release_is_lost(running, of(log, "Controller"), "drive")


# ---- ros-controls/ros2_control #2226: while its predecessor goes, a controller that stays reads NaN


class Teleop(Planner):
    value = 2.0


class HoldingShell(Shell):
    reference = write_port(Float64, on_stop="hold")


@pytest.mark.parametrize("stop_at", [0, 1, 2], ids=["stop first", "stop between", "stop last"])
def test_a_controller_that_stays_reads_one_reference_and_then_the_other(
    running: Running, log: list[Execution], stop_at: int
):
    """The drive follows a planner; from one instant on it follows the teleoperation, and the planner stops.

    The place of the stop among the steps is of no importance.
    """
    chain(running.stage, ("planner", Planner), ("drive", Controller))
    running.stage.add("teleop", HoldingShell, Teleop)
    running.stage.share("teleop", SharedData(Float64), "teleop.reference.write")
    running.deploy()
    running.run_until(lambda: value_of(running, "drive") == Planner.value)
    begin = len(log)
    steps = Transaction()
    rewire = [("disconnect", "drive", "reference"), ("connect", "drive", "reference", "teleop", "read")]
    for step, *arguments in [*rewire[:stop_at], ("stop", "planner"), *rewire[stop_at:]]:
        getattr(steps, step)(*arguments)
    report = running.host.commit(steps)
    running.run_until(lambda: value_of(running, "drive") == Teleop.value)
    assert running.state("planner") == "STOPPED"
    assert value_of(running, "planner") == 0.0
    executions = of(log[begin:], "Controller")
    after = {execution.value for execution in executions if execution.clock_ns >= report.instant_ns}
    before = {execution.value for execution in executions if execution.clock_ns < report.instant_ns}
    assert after == {Teleop.value}
    # A drive that is late on threads may read what the planner left: the declared zero, and never NaN.
    assert before <= ({Planner.value} if running.simulated else {Planner.value, 0.0})
    check_that_no_release_is_lost(running, of(log, "Controller"), "drive")


@pytest.fixture
def unchained(running: Running) -> Running:
    """The drive, which executes before the planner in each instant, follows the teleoperation."""
    stage = running.stage
    for name, shell, core in (
        ("drive", ControllerShell, Controller),
        ("planner", PlannerShell, Planner),
        ("teleop", HoldingShell, Teleop),
    ):
        stage.add(name, shell, core)
    stage.share("planner", SharedData(Float64), "planner.reference.write")
    stage.share("teleop", SharedData(Float64), "teleop.reference.write", "drive.reference.read")
    stage.share("drive", SharedData(Float64), "drive.command.write")
    running.deploy()
    running.run_until(lambda: value_of(running, "drive") == Teleop.value)
    running.host.commit(Transaction().stop("planner"))
    return running


def test_a_controller_follows_a_planner_that_has_written_since_its_start(
    unchained: Running, log: list[Execution]
):
    """Two transactions: the planner starts, and when it has written, the drive reads it."""
    running, begin = unchained, len(log)
    running.host.commit(Transaction().start("planner"))
    running.run_until(lambda: value_of(running, "planner") == Planner.value)
    chain_it = Transaction().disconnect("drive", "reference")
    running.host.commit(chain_it.connect("drive", "reference", "planner", "read"))
    running.run_until(lambda: value_of(running, "drive") == Planner.value)
    assert {execution.value for execution in of(log[begin:], "Controller")} <= {Teleop.value, Planner.value}


# ---- ros-controls/ros2_controllers #1231: activated again, a controller sends a command of before


class JointShell(Shell):
    position = read_port(Float64)
    speed = read_port(Float64, optional=True)
    measured = write_port(Float64)


class Joint(Noted):
    """Goes where a new position says, or one step on for each new speed."""

    def configure(self) -> None:
        self.at = 0.0

    def act(self) -> None:
        position, speed = self.shell.position.read(), self.shell.speed.read()
        if position.is_new:
            self.at = position.value.data
        if speed.is_new:
            self.at += speed.value.data
        self.shell.measured.write(Float64(data=self.at))
        self.note(self.at)


class TrajectoryShell(Shell):
    measured = read_port(Float64)
    position = write_port(Float64, on_stop="hold")


class Trajectory(Noted):
    """Holds the joint where it is when the component starts."""

    def configure(self) -> None:
        self.target = 0.0

    def begin(self) -> None:
        self.target = self.shell.measured.read().value.data

    def act(self) -> None:
        self.shell.position.write(Float64(data=self.target))
        self.note(self.target)


class BeginFsm(Fsm[TrajectoryShell, Trajectory]):
    """Begins anew with each start, in the instant of the first command."""

    def define(self) -> None:
        begin, act = self.execution("Begin", Trajectory.begin), self.execution("Act", Trajectory.act)
        pause = self.wait("Pause", ms_to_ns(2))
        self.set_initial(begin)
        self.next(begin, act)
        self.next(act, pause)
        self.next(pause, act)


class JogShell(Shell):
    speed = write_port(Float64)


class Jog(Noted):
    def act(self) -> None:
        self.shell.speed.write(Float64(data=1.0))
        self.note(1.0)


def test_a_controller_that_starts_again_begins_where_the_joint_is(running: Running, log: list[Execution]):
    stage = running.stage
    stage.add("trajectory", TrajectoryShell, Trajectory, BeginFsm)
    stage.add("joint", JointShell, Joint)
    stage.share("position", SharedData(Float64), "trajectory.position.write", "joint.position.read")
    stage.share("speed", SharedData(Float64), "joint.speed.read")
    stage.share("measured", SharedData(Float64), "joint.measured.write", "trajectory.measured.read")
    running.deploy()
    running.run_until(lambda: len(of(log, "Trajectory")) > 5)
    assert {execution.value for execution in of(log, "Trajectory")} == {0.0}

    jog = Transaction().stop("trajectory").add_component("jog", JogShell, Jog, ActFsm)
    running.host.commit(jog.connect("jog", "speed", "speed", "write").start("jog"))
    running.run_until(lambda: len(of(log, "Joint")) and of(log, "Joint")[-1].value > 10)
    before = len(of(log, "Trajectory"))
    running.host.commit(Transaction().stop("jog").start("trajectory"))
    running.run_until(lambda: len(of(log, "Trajectory")) > before + 5)

    targets = {execution.value for execution in of(log, "Trajectory")[before:]}
    assert len(targets) == 1
    (target,) = targets
    if running.simulated:
        assert target == max(execution.value for execution in of(log, "Joint"))
    assert target > 10, "where the joint was measured, and not the 0 of the first start"
    assert of(log, "Joint")[-1].value == target
    check_that_no_release_is_lost(running, of(log, "Joint"), "joint")


class ArmShell(Shell):
    command = write_port(Float64, on_stop="hold")


class Moves(Noted):
    """One step further at each instant."""

    step = 1.0

    def configure(self) -> None:
        self.at = 0.0

    def take(self, old: "Moves") -> None:
        self.at = old.at

    def act(self) -> None:
        self.at += self.step
        self.shell.command.write(Float64(data=self.at))
        self.note(self.at)


class Holds(Moves):
    """Stays where it is."""

    step = 0.0


def test_a_start_keeps_the_data_of_the_core_and_a_step_configure_clears_them(
    running: Running, log: list[Execution]
):
    running.stage.add("arm", ArmShell, Moves)
    running.stage.share("command", SharedData(Float64), "arm.command.write")
    running.deploy()
    running.run_until(lambda: len(log) > 5)
    running.host.commit(Transaction().stop("arm"))
    last, executed = log[-1].value, len(log)
    running.host.commit(Transaction().start("arm"))
    running.run_until(lambda: len(log) > executed + 5)
    assert log[executed].value == last + Moves.step
    running.host.commit(Transaction().stop("arm"))
    executed = len(log)
    running.host.commit(Transaction().configure("arm").start("arm"))
    running.run_until(lambda: len(log) > executed)
    assert log[executed].value == Moves.step


# ---- ros-controls/ros2_controllers #1594: a joint that another controller has moved shakes on activation


def test_a_core_that_takes_over_goes_on_with_the_command_of_the_one_before(
    running: Running, log: list[Execution]
):
    running.stage.add("arm", ArmShell, Moves)
    running.stage.share("command", SharedData(Float64), "arm.command.write")
    running.deploy()
    for core in (Holds, Moves):
        executed = len(log)
        running.run_until(lambda executed=executed: len(log) > executed + 5)
        report = running.host.replace_core("arm", core)
        assert report.missed_releases == 0
    executed = len(log)
    running.run_until(lambda: len(log) > executed + 5)
    assert [core for core, _ in itertools.groupby(log, lambda one: one.core)] == ["Moves", "Holds", "Moves"]
    commands = [0.0, *(execution.value for execution in log)]
    steps = [after - before for before, after in itertools.pairwise(commands)]
    assert steps == [0.0 if execution.core == "Holds" else 1.0 for execution in log], "no jump"
    check_that_no_release_is_lost(running, log, "arm")
