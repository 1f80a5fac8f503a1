"""Architectures in virtual time from Python: callbacks, commands, data and the trace."""

from collections.abc import Callable

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64

from mauve_rt._kernel import Architecture, Host, MauveError, PluginRegistry, Simulation
from mauve_rt.model.plugins import PluginIndex
from mauve_rt.trace.format.records import RECORD, Kind

SHELL, FSM = "mauve_examples/MetronomeShell", "mauve_examples/MetronomeFsm"
METRONOME, ACCELERANDO = "mauve_examples/Metronome", "mauve_examples/Accelerando"
MS, S = 1_000_000, 1_000_000_000


def metronome() -> Architecture:
    plugin = PluginIndex.installed().find("shell", SHELL)
    assert plugin is not None
    registry = PluginRegistry()
    registry.load_library(str(plugin.library))
    made = Architecture(registry)
    made.add_component("m", shell=SHELL, core=METRONOME, fsm=FSM, priority=40, alternatives=[ACCELERANDO])
    made.set_property("m", "period_us", 100_000)
    made.set_property("m", "ticks_per_beat", 2)
    made.add_resource("beat", kind="shared_data", type="std_msgs/msg/Float64")
    made.connect("m", "beat", "beat", "write")
    made.publish("beat")
    made.configure()
    return made


@pytest.fixture
def architecture() -> Architecture:
    return metronome()


@pytest.fixture
def simulation() -> Simulation:
    return Simulation()


@pytest.fixture
def host(simulation: Simulation, architecture: Architecture) -> Host:
    added = simulation.add(architecture)
    simulation.deploy()
    return added


def instants_of(host: Host, kind: Kind) -> list[int]:
    records = np.frombuffer(host.drain_trace().records, RECORD)
    return [int(record["time_ns"]) for record in records if record["kind"] == kind]


def test_releases_come_on_the_grid_to_the_nanosecond(simulation: Simulation, host: Host):
    simulation.run_until(simulation.epoch_ns() + 5 * S)
    assert simulation.now_ns() == simulation.epoch_ns() + 5 * S
    releases = instants_of(host, Kind.RELEASE)
    assert releases == [simulation.epoch_ns() + beat * 100 * MS for beat in range(51)]


@pytest.mark.usefixtures("host")
def test_callbacks_come_in_the_order_of_their_instants(simulation: Simulation):
    seen: list[tuple[str, int]] = []

    def teller(name: str) -> Callable[[], None]:
        return lambda: seen.append((name, simulation.now_ns() - simulation.epoch_ns()))

    simulation.every(simulation.epoch_ns() + 10 * MS, 20 * MS, teller("every"))
    simulation.at(simulation.epoch_ns() + 30 * MS, teller("at"))
    simulation.run_until(simulation.epoch_ns() + 50 * MS)
    assert seen == [("every", 10 * MS), ("at", 30 * MS), ("every", 30 * MS), ("every", 50 * MS)]


@pytest.mark.usefixtures("host")
def test_an_error_of_a_callback_reaches_the_caller_and_time_goes_on(simulation: Simulation):
    def fail() -> None:
        raise ValueError("on purpose")

    simulation.at(simulation.epoch_ns(), fail)
    with pytest.raises(ValueError, match="on purpose"):
        simulation.run_until(simulation.epoch_ns() + S)
    assert simulation.now_ns() == simulation.epoch_ns()
    simulation.run_until(simulation.epoch_ns() + S)
    assert simulation.now_ns() == simulation.epoch_ns() + S


def test_a_core_is_replaced_in_no_time(simulation: Simulation, host: Host, architecture: Architecture):
    simulation.run_until(simulation.epoch_ns() + S)
    report = host.replace_core("m", ACCELERANDO)
    assert (report.from_core, report.to_core) == (METRONOME, ACCELERANDO)
    assert (report.blackout_ns, report.prepare_ns, report.missed_releases) == (0, 0, 0)
    assert architecture.components()[0].core == ACCELERANDO


def test_a_component_stops_and_starts(simulation: Simulation, host: Host, architecture: Architecture):
    simulation.run_until(simulation.epoch_ns() + S)
    host.stop("m")
    assert architecture.components()[0].state == "STOPPED"
    instants_of(host, Kind.RELEASE)
    simulation.run_until(simulation.epoch_ns() + 2 * S)
    assert instants_of(host, Kind.RELEASE) == []
    host.start("m")
    simulation.run_until(simulation.epoch_ns() + 3 * S)
    assert instants_of(host, Kind.RELEASE)


def test_data_carries_virtual_time(simulation: Simulation, host: Host):
    simulation.run_until(simulation.epoch_ns() + 10 * S)
    assert host.wait_published(0)
    assert host.write_resource("beat", serialize_message(Float64(data=0.25)))
    [(resource, data, time_ns)] = host.wait_published(0)
    assert (resource, time_ns) == ("beat", simulation.now_ns())
    assert deserialize_message(data, Float64).data == 0.25
    assert host.read_resource("beat")[2] == simulation.now_ns()


def test_two_runs_leave_the_same_trace_byte_by_byte():
    def run() -> bytes:
        architecture = metronome()
        simulation = Simulation()
        host = simulation.add(architecture)
        simulation.deploy()
        instant_ns = simulation.epoch_ns() + 2 * S

        def swap() -> None:
            assert simulation.now_ns() == instant_ns
            host.replace_core("m", ACCELERANDO)

        simulation.at(instant_ns, swap)
        simulation.run_until(simulation.epoch_ns() + 5 * S)
        drain = host.drain_trace()
        assert (drain.monotonic_ns, drain.realtime_ns) == (simulation.now_ns(), simulation.now_ns())
        simulation.shutdown()
        return drain.records

    assert run() == run()


@pytest.mark.usefixtures("host")
def test_what_cannot_be_is_refused(simulation: Simulation, architecture: Architecture):
    with pytest.raises(MauveError) as deployed:
        simulation.add(metronome())
    assert deployed.value.code == "already_running"
    with pytest.raises(MauveError) as idle:
        simulation.every(0, 0, lambda: None)
    assert idle.value.code == "invalid_argument"
    with pytest.raises(MauveError) as shared:
        Simulation().add(architecture)
    assert shared.value.code == "already_running"
