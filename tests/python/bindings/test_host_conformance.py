"""What every host does alike, on threads and in virtual time: each test runs on both."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from python_parts import ActFsm, CountCore, CountShell, Stage
from running_host import Running

from mauve_rt._kernel import Deployer, Host, MauveError, SimulatedHost, Simulation, Transaction
from mauve_rt.trace.format.records import RECORD

MS = 1_000_000


@pytest.fixture(params=["threads", "virtual"])
def running(request: pytest.FixtureRequest) -> Iterator[Running]:
    with Stage() as stage:
        made = Running(stage, simulated=request.param == "virtual")
        for name in ("first", "second"):
            stage.add(name, CountShell, CountCore)
        yield made
        made.host.shutdown()


def refusal(call: Callable[[], object]) -> str:
    with pytest.raises(MauveError) as caught:
        call()
    return str(caught.value.code)


class QuickCore(CountCore):
    """Another core of the same kind."""


def test_both_are_hosts(running: Running):
    running.deploy()
    assert isinstance(running.host, Host)
    assert isinstance(running.host, Deployer | SimulatedHost)
    assert running.host.is_deployed()
    assert running.host.epoch_ns > 0
    assert str(running.host.describe()) == str(running.architecture.describe())
    simulated = isinstance(running.host, SimulatedHost)
    assert not (simulated and running.host.realtime_status().granted)


def test_stop_and_start(running: Running):
    running.deploy()
    running.run_for(20 * MS)
    running.host.stop("first")
    assert running.state("first") == "STOPPED"
    assert refusal(lambda: running.host.stop("first")) == "not_running"
    running.host.start("first")
    assert refusal(lambda: running.host.start("first")) == "already_running"
    assert refusal(lambda: running.host.get_time("nobody")) == "unknown_component"
    before = running.releases("first")
    running.run_for(50 * MS)
    assert running.releases("first") > before
    assert (running.host.get_time("first") - running.host.epoch_ns) % (2 * MS) == 0


def test_of_a_start_and_stops_at_one_revision_one_is_done(running: Running):
    running.deploy()
    running.run_for(20 * MS)
    revision = running.architecture.revision()
    running.host.stop("first", expected_revision=revision)
    for _ in range(2):  # a refusal changes nothing
        assert refusal(lambda: running.host.stop("second", expected_revision=revision)) == "wrong_revision"
        assert refusal(lambda: running.host.start("first", expected_revision=revision)) == "wrong_revision"
    assert (running.state("first"), running.state("second")) == ("STOPPED", "RUNNING")
    running.host.start("first", expected_revision=running.architecture.revision())
    assert running.state("first") == "RUNNING"


def test_a_transaction_and_what_it_reports(running: Running):
    running.deploy()
    running.run_for(20 * MS)
    steps = Transaction().set_property("first", "step", 3).replace_core("second", QuickCore)
    tried = running.host.commit(steps, dry_run=True)
    assert [step.step.split()[0] for step in tried.steps] == ["set_property", "replace_core"]
    assert not isinstance(running.architecture.component("second").core, QuickCore)
    report = running.host.make(steps, commit_timeout_ns=10_000 * MS).report()
    assert isinstance(running.architecture.component("second").core, QuickCore)
    assert report.revision > 0
    assert refusal(lambda: running.host.commit(steps, expected_revision=1)) == "wrong_revision"
    assert refusal(lambda: running.host.set_property("first", "nothing", 1)) == "unknown_property"


def test_the_trace_names_components_that_were_removed(running: Running):
    running.deploy()
    running.run_for(20 * MS)
    running.host.commit(Transaction().remove_component("first"))
    running.run_for(20 * MS)
    drain = running.host.drain_trace()
    records = np.frombuffer(drain.records, RECORD)
    assert running.host.trace_components() == ["first", "second"]
    assert set(records["component"].tolist()) == {0, 1}
    assert len(drain.written) == 2
    assert running.host.trace_names()


def test_an_architecture_has_one_host(running: Running):
    running.deploy()
    assert refusal(running.host.deploy) == "already_running"
    assert refusal(Deployer(running.architecture).deploy) == "already_running"
    assert refusal(lambda: Simulation().add(running.architecture)) == "already_running"


def test_a_hook_that_asks_for_a_change_is_refused(running: Running):
    codes: list[str] = []

    class Nested(CountCore):
        def configure(self) -> None:
            codes.append(refusal(lambda: running.host.set_property("first", "step", 2)))
            codes.append(refusal(lambda: running.architecture.set_property("first", "step", 2)))

    running.deploy()
    running.run_for(20 * MS)
    running.host.replace_core("second", Nested)
    assert codes == ["would_deadlock", "would_deadlock"]
    running.architecture.component("first").swap_core(QuickCore)


def test_changes_by_the_architecture_itself(running: Running):
    running.architecture.commit(Transaction().set_property("first", "step", 4))
    running.deploy()
    running.run_for(20 * MS)
    late = running.architecture.add_component("late", CountShell, CountCore, ActFsm)
    assert late.state == "STOPPED"
    running.host.start("late")
    running.run_for(50 * MS)
    assert running.releases("late") > 0


def test_waits_return_when_woken(running: Running):
    running.deploy()
    running.run_for(5 * MS)
    running.host.wait_change(0)
    running.host.set_property("first", "step", 2)
    assert running.host.wait_change(60_000 * MS)
    running.host.wake()
    assert running.host.wait_published(60_000 * MS) == []


def test_an_open_change_is_told_in_each_of_its_phases(running: Running):
    seen = {}

    def look(when: str) -> None:
        seen[when] = running.host.open_changes()

    class LookingCore(CountCore):
        """Asks for the open changes in each hook of a change."""

        def configure(self) -> None:
            super().configure()
            look("configure")

        def adopt(self, old: object) -> None:
            super().adopt(old)
            look("adopt")

        def take(self, old: object) -> None:
            super().take(old)
            look("take")

    running.deploy()
    running.run_for(20 * MS)
    assert running.host.open_changes() == []
    change = Transaction().replace_core("second", LookingCore).by("the operator")
    running.host.commit(change, commit_timeout_ns=10_000 * MS)
    running.run_until(lambda: "take" in seen)
    phases = {when: [each.phase for each in found] for when, found in seen.items()}
    assert phases == {"configure": ["preparing"], "adopt": ["waiting"], "take": ["made"]}
    told = seen["take"][0]
    assert (told.author, [step.split()[0] for step in told.steps]) == ("the operator", ["replace_core"])
    assert told.instant_ns > 0
    assert told.begun_ns > 0
    assert [late.name for late in told.late] == ["second"]
    running.run_until(lambda: running.host.describe() and running.host.open_changes() == [])
    running.run_until(lambda: running.host.disposing() == ("", 0))
    assert refusal(lambda: running.host.abandon("second")) == "not_running"
