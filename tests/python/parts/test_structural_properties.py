"""Structural properties in Python: what define() or configure() reads changes with the part that reads it."""

import pytest
from python_parts import ActFsm, CountCore, CountShell, Stage

from mauve_rt.api import Core, Fsm, MauveError, Simulation, Transaction, ms_to_ns, property  # noqa: A004

MS = 1_000_000


class PacedShell(CountShell):
    period_ms = property(2, unit="ms", structural="fsm")
    size = property(3, structural=["core"])


class PacedCore(CountCore):
    def configure(self) -> None:
        super().configure()
        self.size = self.shell.size.value
        self.instants: list[int] = []

    def act(self) -> None:
        self.instants.append(self.shell.clock_ns)


class PacedFsm(Fsm[PacedShell, Core[PacedShell]]):
    def define(self) -> None:
        act = self.execution("Act", "act")
        pause = self.wait("Pause", ms_to_ns(self.shell.period_ms.value))
        self.set_initial(act)
        self.next(act, pause)
        self.next(pause, act)


@pytest.fixture
def paced(built: Stage) -> Stage:
    built.add("paced", PacedShell, PacedCore, PacedFsm)
    return built


def _refused(caught: pytest.ExceptionInfo[MauveError], part: str) -> None:
    assert caught.value.code == "structural_property"
    assert caught.value.component == "paced"
    assert f"replace the {part} beside it" in caught.value.remedy


def test_the_declaration_tells_who_reads_it(paced: Stage):
    described = {item.name: item.structural for item in paced.describe("paced").properties}
    assert described == {"step": [], "period_ms": ["fsm"], "size": ["core"]}


def test_there_are_three_parts(built: Stage):
    class OddShell(CountShell):
        size = property(3, structural="engine")  # type: ignore[arg-type]

    with pytest.raises(MauveError, match="expected shell, core or fsm, found engine"):
        built.add("odd", OddShell, CountCore, ActFsm)


def test_threads(paced: Stage):
    deployer = paced.deploy()
    for prepare in (lambda: None, lambda: deployer.stop("paced")):
        prepare()
        with pytest.raises(MauveError) as caught:
            deployer.set_property("paced", "period_ms", 5)
        _refused(caught, "fsm")
        deployer.set_property("paced", "step", 5)
    change = Transaction().replace_fsm("paced", PacedFsm).replace_core("paced", PacedCore)
    deployer.commit(change.set_property("paced", "period_ms", 5).set_property("paced", "size", 9))
    assert paced.describe("paced").period_ns == 5 * MS
    assert paced.architecture.component("paced").core.size == 9
    deployer.start("paced")
    core = paced.architecture.component("paced").core
    paced.until(lambda: len(core.instants) > 3)
    assert {later - former for former, later in zip(core.instants, core.instants[1:], strict=False)} <= {
        count * 5 * MS for count in range(1, 1000)
    }


def test_virtual_time(paced: Stage):
    paced.architecture.configure()
    simulation = Simulation()
    host = simulation.add(paced.architecture)
    simulation.deploy()
    epoch_ns = simulation.epoch_ns()
    simulation.run_until(epoch_ns + 3 * MS)
    with pytest.raises(MauveError) as caught:
        host.set_property("paced", "size", 9)
    _refused(caught, "core")
    steps = Transaction().set_property("paced", "period_ms", 5).replace_fsm("paced", PacedFsm)
    host.commit(steps)
    simulation.run_until(epoch_ns + 15 * MS)
    instants = paced.architecture.component("paced").core.instants
    assert [instant - epoch_ns for instant in instants] == [0, 2 * MS, 5 * MS, 10 * MS, 15 * MS]
