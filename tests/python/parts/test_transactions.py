"""Transactions from Python: parts in Python come and go, or nothing changes."""

from typing import Any

import pytest
from geometry_msgs.msg import PoseStamped
from python_parts import ActFsm, CountCore, CountShell, HearCore, HearShell, IdleCore, Stage

from mauve_rt.api import (
    Core,
    Fsm,
    MauveError,
    Resource,
    SharedData,
    Shell,
    Transaction,
    call_port,
    ms_to_ns,
    read_port,
    service,
    write_port,
)

MS = 1_000_000


@pytest.fixture
def counting(built: Stage) -> Stage:
    built.add("count", CountShell, CountCore)
    built.share("pose", SharedData(PoseStamped), "count.out.write")
    built.deploy()
    return built


def test_a_component_in_python_is_added_wired_and_removed(counting: Stage):
    stage, deployer = counting, counting.deployer
    before = stage.architecture.describe()
    report = deployer.commit(
        Transaction()
        .add_component("hear", HearShell, HearCore, ActFsm, priority=30)
        .connect("hear", "heard", "pose", "read")
        .start("hear")
    )
    assert [step.component for step in report.steps] == ["hear"] * 3
    assert report.revision > 0
    hear = stage.architecture.component("hear")
    stage.until(lambda: len(hear.core.samples) > 3)
    assert stage.architecture.describe() != before
    assert "hear" in str(stage.architecture.describe())
    deployer.commit(Transaction().remove_component("hear"))
    assert stage.architecture.describe() == before
    with pytest.raises(MauveError, match="no such component"):
        hear.describe()


def test_core_fsm_and_shell_are_replaced_together(counting: Stage):
    class NewShell(Shell):
        out = write_port(PoseStamped, optional=True)

    class NewCore(Core[NewShell]):
        count = 0

        def act(self) -> None:
            self.count += 1
            self.shell.out.write(PoseStamped())

    class SlowFsm(Fsm[NewShell, NewCore]):
        def define(self) -> None:
            act, pause = self.execution("Act", NewCore.act), self.wait("Slow", ms_to_ns(5))
            self.set_initial(act)
            self.next(act, pause)
            self.next(pause, act)

    component = counting.architecture.component("count")
    steps = Transaction().replace_shell("count", NewShell).replace_core("count", NewCore)
    counting.deployer.commit(steps.replace_fsm("count", SlowFsm))
    counting.until(lambda: component.core.count > 3)
    assert component.shell is component.core.shell
    described = component.describe()
    assert described.period_ns == 5 * MS
    assert [(port.name, port.resource) for port in described.ports] == [("out", "pose")]
    assert (counting.deployer.get_time("count") - counting.deployer.epoch_ns) % (5 * MS) == 0


class Refuses(CountCore):
    def configure(self) -> None:
        raise OSError("no such device")


class OddShell(Shell):
    odd = read_port("package/Odd")


@pytest.mark.parametrize(
    ("steps", "step", "words"),
    [
        (Transaction().set_property("count", "step", 2).replace_core("count", Refuses), 2, "no such device"),
        (Transaction().set_property("count", "step", 2).replace_shell("count", OddShell), 2, "package/Odd"),
        (Transaction().stop("count").replace_core("count", IdleCore).start("nobody"), 3, "nobody"),
        (Transaction().add_component("two", CountShell, CountCore, "test/Fsm"), 1, "test/Fsm"),
    ],
)
def test_a_transaction_that_fails_changes_nothing(counting: Stage, steps: Any, step: int, words: str):
    before = counting.architecture.describe()
    core = counting.architecture.component("count").core
    with pytest.raises(MauveError, match=words) as refused:
        counting.deployer.commit(steps)
    assert refused.value.step == step
    assert counting.architecture.describe() == before
    assert counting.architecture.component("count").core is core
    count = core.count
    counting.until(lambda: core.count > count)


def test_a_dry_run_prepares_and_changes_nothing(counting: Stage):
    made: list[str] = []

    class Noted(CountCore):
        def configure(self) -> None:
            super().configure()
            made.append("configured")

        def cleanup(self) -> None:
            made.append("cleaned up")

    steps = Transaction().replace_core("count", Noted)
    before, revision = counting.architecture.describe(), counting.architecture.revision()
    counting.deployer.commit(steps, dry_run=True)
    assert made == ["configured", "cleaned up"]
    assert counting.architecture.describe() == before
    counting.deployer.commit(steps, expected_revision=revision)
    assert type(counting.architecture.component("count").core) is Noted
    with pytest.raises(MauveError):
        counting.deployer.commit(steps, expected_revision=revision)


def test_a_configure_that_fails_changes_nothing(counting: Stage):
    class Picky(CountCore):
        fails = False

        def configure(self) -> None:
            if Picky.fails:
                raise RuntimeError("the calibration file is gone")
            super().configure()

    counting.deployer.commit(Transaction().replace_core("count", Picky))
    counting.deployer.stop("count")
    component = counting.architecture.component("count")
    core = component.core
    Picky.fails = True
    with pytest.raises(MauveError, match="the calibration file is gone"):
        counting.deployer.commit(Transaction().configure("count").start("count"))
    assert (component.state, component.core) == ("STOPPED", core)
    counting.deployer.start("count")
    count = core.count
    counting.until(lambda: core.count > count)
    counting.deployer.stop("count")
    Picky.fails = False
    counting.deployer.commit(Transaction().configure("count").start("count"))
    assert component.core is not core
    counting.until(lambda: component.core.count > 1)


def test_a_resource_in_python_comes_and_goes(counting: Stage):
    class Bell(Resource):
        rung = 0

        @service
        def ring(self) -> int:
            self.rung += 1
            return self.rung

    class RingShell(Shell):
        ring = call_port(Bell.ring)

    class RingCore(Core[RingShell]):
        heard = 0

        def act(self) -> None:
            self.heard = self.shell.ring()

    bell = Bell()
    steps = Transaction().add_resource("bell", bell).add_component("ring", RingShell, RingCore, ActFsm)
    counting.deployer.commit(steps.connect("ring", "ring", "bell", "ring").start("ring"))
    counting.until(lambda: bell.rung > 3)
    with pytest.raises(MauveError, match="bell"):
        counting.deployer.commit(Transaction().remove_resource("bell"))
    counting.deployer.commit(Transaction().remove_component("ring").remove_resource("bell"))
    assert [item.name for item in counting.architecture.resources()] == ["pose"]


def test_a_fallback_core_in_python_takes_over_after_a_fault(built: Stage):
    class Breaks(CountCore):
        def act(self) -> None:
            raise RuntimeError("worn out")

    component = built.architecture.add_component("count", CountShell, Breaks, ActFsm, fallback=CountCore)
    built.deploy()
    built.until(lambda: type(component.core) is CountCore and component.core.count > 3)
    assert component.state == "RUNNING"


def test_an_fsm_in_python_waits_for_events(built: Stage):
    class EventFsm(Fsm[HearShell, HearCore]):
        def define(self) -> None:
            act = self.execution("Act", HearCore.act)
            heard = self.wait_event("Heard", self.shell.heard, ms_to_ns(10_000), 1000)
            self.set_initial(heard)
            self.next(heard, act)
            self.next(act, heard)

    built.add("count", CountShell, CountCore)
    hear = built.add("hear", HearShell, HearCore, EventFsm)
    built.share("pose", SharedData(PoseStamped), "count.out.write", "hear.heard.read")
    built.deploy()
    built.until(lambda: len(hear.core.samples) > 5)
    assert hear.describe().period_ns == 0, "sporadic"
    assert all((sample.time_ns - built.deployer.epoch_ns) % (2 * MS) == 0 for sample in hear.core.samples)
