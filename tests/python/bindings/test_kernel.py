"""The kernel seen from Python: parts by name, commands, errors, data in serialized form, the trace."""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from python_parts import ActFsm
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64

from mauve_rt._kernel import (
    NOT_MEASURED,
    Architecture,
    ComponentDescription,
    Deployer,
    MauveError,
    PluginRegistry,
    Transaction,
    monotonic_ns,
)
from mauve_rt.api import Core, SharedData, Shell, write_port
from mauve_rt.model.plugins import PluginIndex
from mauve_rt.trace.format.records import RECORD, Kind

SHELL, FSM = "mauve_examples/MetronomeShell", "mauve_examples/MetronomeFsm"
METRONOME, ACCELERANDO = "mauve_examples/Metronome", "mauve_examples/Accelerando"
FLOAT = "std_msgs/msg/Float64"
MS = 1_000_000


def library() -> Path:
    plugin = PluginIndex.installed().find("shell", SHELL)
    assert plugin is not None
    return plugin.library


@pytest.fixture
def registry() -> PluginRegistry:
    made = PluginRegistry()
    made.load_library(str(library()))
    return made


@pytest.fixture
def architecture(registry: PluginRegistry) -> Architecture:
    """Two metronomes on one CPU; the second may not be changed."""
    made = Architecture(registry)
    made.add_resource("beat", kind="shared_data", type=FLOAT)
    for name, priority in (("metronome", 60), ("protected", 50)):
        made.add_component(
            name,
            shell=SHELL,
            core=METRONOME,
            fsm=FSM,
            priority=priority,
            cpus=[0],
            alternatives=[ACCELERANDO],
            reconfigurable=name == "metronome",
        )
        made.set_property(name, "ticks_per_beat", 5)
    made.connect("metronome", "beat", "beat", "write")
    made.publish("beat")
    return made


@pytest.fixture
def deployer(architecture: Architecture) -> Iterator[Deployer]:
    architecture.add_resource("protected_beat", kind="shared_data", type=FLOAT)
    architecture.connect("protected", "beat", "protected_beat", "write")
    architecture.configure()
    made = Deployer(architecture)
    made.deploy()
    yield made
    made.shutdown()


def describe(architecture: Architecture, name: str = "metronome") -> ComponentDescription:
    return next(component for component in architecture.components() if component.name == name)


def refusal(call: Callable[[], object]) -> MauveError:
    with pytest.raises(MauveError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return caught.value


def beats(deployer: Deployer, count: int) -> list[float]:
    """What the next so many beats say; gives up after 10 s."""
    heard: list[float] = []
    until = monotonic_ns() + 10_000 * MS
    while len(heard) < count:
        assert monotonic_ns() < until, f"heard only {heard}"
        heard += [deserialize_message(data, Float64).data for _, data, _ in deployer.wait_published(100 * MS)]
    return heard


# ---- parts by name


def test_a_library_s_parts_are_known_by_name(registry: PluginRegistry):
    assert registry.names("shell") == [
        f"mauve_examples/{name}Shell" for name in ("AngleController", "Metronome", "Pendulum")
    ]
    assert {ACCELERANDO, METRONOME} < {*registry.names("core")}
    assert registry.names("type") == ["mauve_msgs/msg/ActionGoal", FLOAT]
    assert registry.core_shell(ACCELERANDO) == registry.fsm_shell(FSM) == SHELL
    registry.load_library(str(library()))  # once more does nothing


def test_a_shell_is_described_with_its_ports_and_properties(registry: PluginRegistry):
    shell = registry.describe_shell(SHELL)
    ports = [(port.name, port.kind, port.type, port.resource) for port in shell.ports]
    assert ports == [("beat", "write", FLOAT, "")]
    period = shell.properties[0]
    assert (period.name, period.type, period.value, period.unit) == ("period_us", "int", 1000, "us")
    assert (period.minimum, period.maximum, shell.properties[1].maximum) == (100.0, 1e6, None)
    assert period.description


def test_a_resource_is_described_with_its_services(registry: PluginRegistry):
    resource = registry.describe_resource("shared_data", FLOAT)
    services = {(service.name, service.kind, service.type) for service in resource.services}
    assert services == {("read", "read", FLOAT), ("write", "write", FLOAT)}


@pytest.mark.parametrize(
    ("call", "code", "element"),
    [
        (lambda r: r.load_library("/nowhere/libnothing.so"), "plugin", "/nowhere/libnothing.so"),
        (lambda r: r.describe_shell("a/B"), "unknown_shell", "shell a/B"),
        (lambda r: r.core_shell("a/B"), "unknown_core", "core a/B"),
        (lambda r: r.fsm_shell("a/B"), "unknown_fsm", "fsm a/B"),
        (lambda r: r.describe_resource("a/B", ""), "unknown_resource", "kind a/B"),
        (lambda r: r.describe_resource("shared_data", "a/msg/B"), "unknown_type", "type a/msg/B"),
    ],
)
def test_what_is_not_there_is_refused_with_code_element_and_remedy(
    registry: PluginRegistry, call: Callable[[PluginRegistry], object], code: str, element: str
):
    error = refusal(lambda: call(registry))
    assert (error.code, error.element) == (code, element)
    assert error.remedy
    assert error.remedy in str(error)


# ---- an architecture before deployment


@pytest.mark.parametrize(
    ("call", "code"),
    [
        (lambda a: a.set_property("nobody", "period_us", 1), "unknown_component"),
        (lambda a: a.set_property("metronome", "period", 1), "unknown_property"),
        (lambda a: a.set_property("metronome", "period_us", 99), "out_of_range"),
        (lambda a: a.set_property("metronome", "period_us", "often"), "type_mismatch"),
        (lambda a: a.connect("protected", "bar", "beat", "write"), "unknown_port"),
        (lambda a: a.connect("protected", "beat", "beat", "shout"), "unknown_service"),
        (lambda a: a.connect("protected", "beat", "beat", "read"), "type_mismatch"),
        (lambda a: a.connect("protected", "beat", "nothing", "write"), "unknown_resource"),
        (lambda a: a.connect("metronome", "beat", "beat", "write"), "duplicate_name"),
        (lambda a: a.add_resource("beat", kind="shared_data", type=FLOAT), "duplicate_name"),
        (lambda a: a.add_resource("ring", kind="ring_buffer", type=FLOAT), "invalid_argument"),
        (lambda a: a.add_component("c", shell=SHELL, core=METRONOME, fsm=FSM, priority=99), "out_of_range"),
        (
            lambda a: a.add_component("c", shell=SHELL, core=METRONOME, fsm=FSM, overrun="hurry"),
            "invalid_argument",
        ),
    ],
)
def test_a_mistake_is_refused_with_its_code(
    architecture: Architecture, call: Callable[[Architecture], object], code: str
):
    assert refusal(lambda: call(architecture)).code == code


def test_an_error_says_where_what_was_expected_and_what_was_found(architecture: Architecture):
    error = refusal(lambda: architecture.set_property("metronome", "period", 1))
    assert (error.component, error.element, error.found) == ("metronome", "property period", "period")
    assert "period_us" in error.expected
    for field in (error.component, error.expected, error.found):
        assert field in str(error)


def test_deploying_before_configure_is_refused(architecture: Architecture):
    assert refusal(Deployer(architecture).deploy).code == "not_configured"


# ---- commands


def test_deployed_components_run_on_one_grid(deployer: Deployer, architecture: Architecture):
    beats(deployer, 2)
    for component in architecture.components():
        assert component.state == "RUNNING"
        assert component.period_ns == MS
        assert component.policy in ("SCHED_FIFO", "SCHED_OTHER")
        assert component.cpus == [0]
        assert component.releases > 0
        assert (deployer.get_time(component.name) - deployer.epoch_ns) % MS == 0
    status = deployer.realtime_status()
    assert status.granted == (not status.missing)


def test_stop_writes_the_output_and_start_returns_to_the_grid(deployer: Deployer, architecture: Architecture):
    beats(deployer, 1)
    deployer.stop("metronome")
    assert describe(architecture).state == "STOPPED"
    assert deserialize_message(deployer.read_resource("beat")[0], Float64).data == 0.0
    assert refusal(lambda: deployer.stop("metronome")).code == "not_running"
    deployer.start("metronome")
    beats(deployer, 2)
    assert (deployer.get_time("metronome") - deployer.epoch_ns) % MS == 0
    assert refusal(lambda: deployer.start("metronome")).code == "already_running"


def test_a_core_is_replaced_in_flight_and_goes_on_counting(deployer: Deployer, architecture: Architecture):
    heard = beats(deployer, 3)
    report = deployer.replace_core("metronome", ACCELERANDO)
    assert (report.step, report.component) == (f"replace_core metronome {ACCELERANDO}", "metronome")
    assert (report.from_core, report.to_core) == (METRONOME, ACCELERANDO)
    assert report.blackout_ns > 0
    assert report.phase_nominal_ns == 0
    assert describe(architecture).core == ACCELERANDO
    later = beats(deployer, 3)
    assert later == sorted(later)
    assert later[0] >= heard[-1], "take() carried the count over"


def test_the_report_of_a_change_can_be_asked_for_later(deployer: Deployer, architecture: Architecture):
    committed = deployer.make(Transaction().replace_core("metronome", ACCELERANDO))
    assert describe(architecture).core == ACCELERANDO
    known = committed.report().steps[0]
    assert (known.to_core, known.phase_nominal_ns) == (ACCELERANDO, 0)
    report = committed.report(100_000_000_000)
    assert report.is_complete
    assert report.steps[0].blackout_ns == known.blackout_ns
    assert report.steps[0].phase_actual_ns != NOT_MEASURED
    assert committed.report().steps[0].phase_actual_ns == report.steps[0].phase_actual_ns
    # What comes of the components meanwhile is nobody's concern.
    parting = deployer.make(Transaction().replace_core("metronome", METRONOME))
    deployer.commit(Transaction().remove_component("metronome"))
    assert parting.report().steps[0].to_core == METRONOME
    deployer.shutdown()
    del parting, committed


def test_a_core_that_may_not_be_put_in_is_refused(deployer: Deployer, architecture: Architecture):
    assert refusal(lambda: deployer.replace_core("metronome", "a/B")).code == "unknown_core"
    assert refusal(lambda: deployer.replace_core("nobody", METRONOME)).code == "unknown_component"
    assert refusal(lambda: deployer.replace_core("protected", ACCELERANDO)).code == "not_reconfigurable"
    assert {component.core for component in architecture.components()} == {METRONOME}


def test_a_property_set_in_flight_is_in_force_and_shown(deployer: Deployer, architecture: Architecture):
    beats(deployer, 1)
    report = deployer.set_property("metronome", "ticks_per_beat", 50)
    assert report.step.startswith("set_property metronome.ticks_per_beat")
    assert [item.value for item in describe(architecture).properties] == [1000, 50]
    assert refusal(lambda: deployer.set_property("metronome", "ticks_per_beat", 0)).code == "out_of_range"
    deployer.wait_published(0)
    samples = [deployer.wait_published(2000 * MS)[-1] for _ in range(3)]
    assert samples[2][2] - samples[1][2] >= 50 * MS, "the writer's times are those of the grid"


def test_shutdown_ends_the_threads_and_deploys_again(deployer: Deployer, architecture: Architecture):
    first = deployer.epoch_ns
    deployer.shutdown()
    assert {component.state for component in architecture.components()} == {"STOPPED"}
    assert refusal(lambda: deployer.start("metronome")).code == "not_configured"
    deployer.deploy()
    assert deployer.epoch_ns > first
    beats(deployer, 1)


# ---- data


def test_what_a_component_writes_is_handed_out_with_its_time(deployer: Deployer):
    resource, data, time_ns = deployer.wait_published(2000 * MS)[0]
    assert resource == "beat"
    assert data[:4] == b"\0\1\0\0", "the header of little-endian CDR"
    assert deserialize_message(data, Float64).data >= 1.0
    assert (time_ns - deployer.epoch_ns) % MS == 0, "the component's logical clock"


def test_a_resource_is_written_and_read_in_serialized_form(deployer: Deployer):
    deployer.stop("metronome")
    _, before, _ = deployer.read_resource("beat")
    wrote_ns = monotonic_ns()
    assert deployer.write_resource("beat", serialize_message(Float64(data=2.5)))
    data, sequence, time_ns = deployer.read_resource("beat")
    assert deserialize_message(data, Float64).data == 2.5
    assert sequence == before + 1
    assert wrote_ns <= time_ns <= monotonic_ns(), "a writer that is no component stamps the real clock"
    assert not deployer.write_resource("beat", data[:7]), "malformed"
    assert deployer.read_resource("beat")[1] == sequence
    assert refusal(lambda: deployer.read_resource("nothing")).code == "unknown_resource"


def test_waits_end_at_their_timeout_and_at_a_wake(deployer: Deployer):
    deployer.stop("metronome")
    while deployer.wait_published(0) or deployer.wait_change(0):
        pass
    before_ns = monotonic_ns()
    assert deployer.wait_published(20 * MS) == []
    assert not deployer.wait_change(20 * MS)
    assert monotonic_ns() - before_ns >= 40 * MS
    outcomes: list[object] = []
    waiting = threading.Thread(target=lambda: outcomes.append(deployer.wait_published(3_600_000 * MS)))
    waiting.start()  # without giving the interpreter's lock back it would keep us from going on
    deployer.wake()
    waiting.join()
    assert outcomes == [[]]


def test_a_change_of_state_is_noticed(deployer: Deployer):
    while deployer.wait_change(0):
        pass
    deployer.stop("metronome")
    assert deployer.wait_change(10_000 * MS)


# ---- the trace


def test_a_drain_yields_the_records_of_every_component(deployer: Deployer):
    beats(deployer, 3)
    deployer.replace_core("metronome", ACCELERANDO)
    deployer.stop("metronome")
    drain = deployer.drain_trace()
    assert deployer.trace_components() == ["metronome", "protected"]
    records = np.frombuffer(drain.records, RECORD)
    for index in range(2):
        rows = records[records["component"] == index]
        assert list(rows["sequence"]) == list(range(len(rows)))
        assert list(rows["kind"][:2]) == [Kind.DEPLOYMENT, Kind.START]
        assert (rows["a"][0], rows["b"][0], rows["c"][0]) == (deployer.epoch_ns, 0, MS)
        release = rows[rows["kind"] == Kind.RELEASE]
        assert np.all((release["a"] - deployer.epoch_ns) % MS == 0)
        assert np.all(release["b"] >= release["a"])
        assert drain.written[index] >= len(rows)
        assert drain.dropped[index] == 0
    assert drain.written[0] == np.count_nonzero(records["component"] == 0), "it is stopped"
    metronome = records[records["component"] == 0]
    names = deployer.trace_names()
    assert {names[i] for i in metronome["name"][metronome["kind"] == Kind.STATE_BEGIN]} == {"Tick", "Beat"}
    parked, armed = (metronome[metronome["kind"] == kind][0] for kind in (Kind.PARKED, Kind.ARMED))
    assert parked["a"] == armed["a"], "the pending instant was kept"
    assert metronome["kind"][-1] == Kind.STOP
    assert deployer.drain_trace().monotonic_ns >= drain.monotonic_ns >= int(metronome["time_ns"][-1])


def wait_free(architecture: Architecture, resource: str) -> set[str]:
    [found] = [each for each in architecture.resources() if each.name == resource]
    return {service.name for service in found.services if service.is_wait_free}


def test_a_second_writer_of_a_ring_gives_it_a_lock(architecture: Architecture):
    architecture.add_resource("ring", kind="ring_buffer", type=FLOAT, capacity=4)
    assert wait_free(architecture, "ring") == set(), "nobody is connected"
    architecture.commit(
        Transaction().disconnect("metronome", "beat").connect("metronome", "beat", "ring", "write")
    )
    assert wait_free(architecture, "ring") == {"write"}
    architecture.connect("protected", "beat", "ring", "write")
    assert wait_free(architecture, "ring") == set()
    architecture.commit(
        Transaction().disconnect("metronome", "beat").connect("metronome", "beat", "beat", "write")
    )
    assert wait_free(architecture, "ring") == {"write"}
    assert wait_free(architecture, "beat") == {"read", "write"}


def test_a_port_tells_what_a_stop_writes(architecture: Architecture):
    zero = bytes(serialize_message(Float64()))
    first = architecture.components()[0].ports
    assert [(port.name, port.resource, port.stop_message) for port in first] == [("beat", "beat", zero)]
    architecture.commit(Transaction().disconnect("metronome", "beat"))
    assert [port.stop_message for port in architecture.components()[0].ports] == [b""]


class Talker(Shell):
    said = write_port(Float64)
    kept = write_port(Float64, on_stop="hold")


class Silent(Core[Talker]):
    def act(self) -> None:
        """Write nothing."""


def test_a_port_of_python_tells_it_too():
    architecture = Architecture(PluginRegistry())
    for name in ("said", "kept"):
        architecture.add_resource(name, SharedData(Float64))
    architecture.add_component("talker", shell=Talker, core=Silent, fsm=ActFsm)
    for name in ("said", "kept"):
        architecture.connect("talker", name, name, "write")
    ports = {port.name: port.stop_message for port in architecture.components()[0].ports}
    assert ports == {"said": bytes(serialize_message(Float64())), "kept": b""}


def test_a_type_that_only_python_knows_has_a_lock():
    architecture = Architecture(PluginRegistry())
    architecture.add_resource("only", SharedData(Float64))
    assert wait_free(architecture, "only") == set()
