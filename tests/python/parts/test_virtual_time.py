"""Components in Python in virtual time (rule 13)."""

import pytest
from geometry_msgs.msg import PoseStamped
from python_parts import ActFsm, CountCore, CountShell, HearCore, HearShell, Stage

from mauve_rt.api import MauveError, SharedData, Simulation, Transaction, s_to_ns

MS = 1_000_000


@pytest.fixture
def pair(built: Stage) -> Stage:
    built.add("count", CountShell, CountCore)
    built.add("hear", HearShell, HearCore)
    built.share("pose", SharedData(PoseStamped), "count.out.write", "hear.heard.read")
    built.architecture.configure()
    return built


def test_rule_13_every_instant_is_run_and_the_trace_is_the_same_every_time():
    traces = []
    for _ in range(2):
        with Stage() as stage:
            stage.add("count", CountShell, CountCore)
            stage.architecture.configure()
            simulation = Simulation()
            host = simulation.add(stage.architecture)
            simulation.deploy()
            simulation.run_until(simulation.epoch_ns() + s_to_ns(2))
            assert stage.architecture.component("count").core.count == 1001, "t = 0, 2 ms, ... 2 s"
            traces.append(host.drain_trace().records)
            simulation.shutdown()
    assert traces[0] == traces[1] != b""


class CostlyFsm(ActFsm):
    """Acts for 5 ms of virtual time, every 2 ms; its bound and its worst case are no time that it takes."""

    def define(self) -> None:
        times = {"max_execution_ns": 7 * MS, "simulated_execution_ns": 5 * MS, "wcet_ns": 1 * MS}
        act = self.execution("Act", "act", **times)
        pause = self.wait("Pause", 2 * MS)
        self.set_initial(act)
        self.next(act, pause)
        self.next(pause, act)


@pytest.mark.parametrize(
    ("states", "skipped"),
    [
        ({}, True),
        ({"Act": {"simulated_execution_ns": 0}}, False),
        ({"Act": {"simulated_execution_ns": 5 * MS, "max_execution_ns": 8 * MS}}, True),
        ({"Act": {"max_execution_ns": None}}, True),
        ({"Act": {"wcet_ns": 6 * MS}}, True),
        ({"Act": {"wcet_ns": 6 * MS, "simulated_execution_ns": 0}}, False),
    ],
)
def test_an_execution_takes_what_is_declared_and_its_bound_is_none(
    built: Stage, states: dict[str, dict[str, int | None]], *, skipped: bool
):
    built.architecture.add_component("c", CountShell, CountCore, CostlyFsm, states=states)
    built.architecture.configure()
    simulation = Simulation()
    simulation.add(built.architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + 100 * MS)
    (told,) = built.architecture.components()
    assert (told.skipped > 0) == skipped
    assert told.state == "RUNNING", "no bound was exceeded"
    (act,) = (state for state in told.states if not state.is_wait)
    wanted = states.get("Act", {})
    assert act.max_execution_ns == (wanted.get("max_execution_ns") or 7 * MS)
    assert act.simulated_execution_ns == wanted.get("simulated_execution_ns", 5 * MS)
    assert act.wcet_ns == wanted.get("wcet_ns", 1 * MS)
    simulation.shutdown()


@pytest.mark.parametrize(
    ("simulated_ms", "fault"),
    [(1, ""), (2, "state Act used 2 ms of CPU time, and its wcet_ns is 1 ms (in state Act, at ")],
)
def test_an_enforced_worst_case_faults_what_takes_longer(built: Stage, simulated_ms: int, fault: str):
    states = {"Act": {"simulated_execution_ns": simulated_ms * MS}}
    built.architecture.add_component("c", CountShell, CountCore, CostlyFsm, states=states, enforce_wcet=True)
    built.architecture.configure()
    simulation = Simulation()
    simulation.add(built.architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + 100 * MS)
    (told,) = built.architecture.components()
    assert (told.state, told.fault[: len(fault) or None]) == ("FAULTED" if fault else "RUNNING", fault)
    assert {state.name for state in told.states if state.wcet_enforced} == {"Act"}
    simulation.shutdown()


@pytest.mark.parametrize(
    ("wcet_ns", "expected"),
    [
        (
            8 * MS,
            "state Act, wcet_ns: .*at most max_execution_ns, which is 7000000 ns, found 8000000",
        ),
        (0, "state Act, wcet_ns: a state's time is out of range; expected 1 to"),
    ],
)
def test_a_worst_case_that_cannot_be_is_refused(built: Stage, wcet_ns: int, expected: str):
    def configure() -> None:
        states = {"Act": {"wcet_ns": wcet_ns}}
        built.architecture.add_component("c", CountShell, CountCore, CostlyFsm, states=states)
        built.architecture.configure()

    with pytest.raises(MauveError, match=expected):
        configure()


def test_rule_13_transactions_and_callbacks_act_at_their_instants(pair: Stage):
    simulation = Simulation()
    host = simulation.add(pair.architecture)
    simulation.deploy()
    epoch_ns = simulation.epoch_ns()
    seen: list[int] = []
    steps = Transaction().set_property("count", "step", 10)
    simulation.at(epoch_ns + 9 * MS, lambda: host.commit(steps))
    simulation.every(epoch_ns, 5 * MS, lambda: seen.append(simulation.now_ns() - epoch_ns))
    simulation.run_until(epoch_ns + 12 * MS)
    assert seen == [0, 5 * MS, 10 * MS]
    assert pair.architecture.component("count").core.count == 5 + 2 * 10, "0 to 8 ms by 1, 10 and 12 by 10"
    heard = pair.architecture.component("hear").core.samples
    assert [(int(s.value.pose.position.x), s.time_ns - epoch_ns) for s in heard] == [
        (1, 0), (2, 2 * MS), (3, 4 * MS), (4, 6 * MS), (5, 8 * MS), (15, 10 * MS), (25, 12 * MS)
    ]  # fmt: skip
    host.stop("count")
    assert pair.architecture.component("count").state == "STOPPED"
    with pytest.raises(MauveError, match="nobody"):
        host.get_time("nobody")


def test_what_a_callback_raises_is_raised_by_run_until(pair: Stage):
    simulation = Simulation()
    simulation.add(pair.architecture)
    simulation.deploy()
    simulation.at(simulation.epoch_ns(), lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        simulation.run_until(simulation.epoch_ns() + 10 * MS)
    simulation.run_until(simulation.epoch_ns() + 10 * MS)
    assert pair.architecture.component("count").core.count == 6


def test_what_a_core_raises_is_a_fault_in_virtual_time_too(built: Stage):
    class Breaks(CountCore):
        def act(self) -> None:
            super().act()
            if self.count == 3:
                raise RuntimeError("worn out")

    component = built.add("count", CountShell, Breaks, ActFsm)
    built.architecture.configure()
    simulation = Simulation()
    simulation.add(built.architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + 20 * MS)
    assert component.state == "FAULTED"
    assert "worn out" in component.describe().fault
    assert component.core.count == 3
