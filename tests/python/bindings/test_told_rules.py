"""A RuleRunner whose caller feeds its conditions, in virtual time."""

from collections.abc import Iterator

import pytest

from mauve_rt._kernel import (
    Architecture,
    Host,
    PluginRegistry,
    RuleActions,
    RuleRunner,
    RuleSpec,
    Simulation,
    WhenSpec,
)
from mauve_rt.errors import MauveError

SILENCE = WhenSpec("silence", parameters={"topic": "link", "longer_than_s": 0.2})
RULE = RuleSpec("lost", SILENCE)


@pytest.fixture
def simulation() -> Iterator[Simulation]:
    simulation = Simulation(trace=False)
    yield simulation
    simulation.shutdown()


@pytest.fixture
def host(simulation: Simulation) -> Host:
    architecture = Architecture(PluginRegistry())
    architecture.configure()
    host = simulation.add(architecture)
    host.deploy()
    return host


def test_a_topic_that_no_resource_is_bound_to_can_be_told(simulation: Simulation, host: Host) -> None:
    runner = RuleRunner(host, [RULE], [RuleActions([])], told=True)
    runner.start()
    begin_ns = simulation.now_ns()
    assert [(signal.kind, signal.target) for signal in runner.signals] == [("message", "link")]
    runner.advance()
    simulation.run_until(begin_ns + 100_000_000)
    runner.tell(0, simulation.now_ns())
    while (due_ns := runner.advance()) < begin_ns + 1_000_000_000:
        simulation.run_until(due_ns)
    found = [told.decision for told in runner.wait_told(0)]
    (holds,) = (each.stamp_ns for each in found if each.decision == "condition_true")
    assert holds - begin_ns == pytest.approx(300_000_000, abs=1000)


def test_only_what_is_told_can_be_told(simulation: Simulation, host: Host) -> None:
    told = RuleRunner(host, [RULE], [RuleActions([])], told=True)
    with pytest.raises(MauveError, match="signal 1"):
        told.tell(1, simulation.now_ns())
    change = RuleSpec("old", WhenSpec("since_change", parameters={"longer_than_s": 1.0}))
    with pytest.raises(MauveError, match="rules that are told"):
        RuleRunner(host, [change], [RuleActions([])]).tell(0, simulation.now_ns())
