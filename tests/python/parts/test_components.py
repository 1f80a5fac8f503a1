"""Whole components in Python, alone and beside ones in C++."""

import gc
import subprocess
import sys
import textwrap
import threading
import weakref
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose2D, PoseStamped
from python_parts import POSE, ActFsm, CountCore, CountShell, EmptyShell, HearCore, HearShell, IdleCore, Stage
from rclpy.serialization import deserialize_message, serialize_message

from mauve_examples.tutorials.python_component import RoverCore, SlipperyCore, make_architecture
from mauve_msgs.action import DriveTo
from mauve_rt.api import (
    Architecture,
    Core,
    Deployer,
    EventCounter,
    Fsm,
    LatestValue,
    MauveError,
    PluginRegistry,
    Resource,
    RingBuffer,
    SharedData,
    Shell,
    Transaction,
    call_port,
    event_port,
    ms_to_ns,
    property,  # noqa: A004
    read_port,
    service,
    write_port,
)
from mauve_rt.model.plugins import PluginIndex, PluginLoader

MS = 1_000_000


def add_pair(stage: Stage) -> None:
    """A component that counts and one that hears it, both in Python, by a message C++ does not know."""
    stage.add("count", CountShell, CountCore)
    stage.add("hear", HearShell, HearCore)
    stage.share("pose", SharedData(PoseStamped), "count.out.write", "hear.heard.read")


# ---- beside C++


@pytest.fixture
def rover() -> Any:
    stage = Stage()
    stage.architecture = make_architecture(stage.registry)
    with stage:
        yield stage


def test_python_and_cpp_exchange_data_both_ways(rover: Stage):
    rover.deploy()
    core = rover.architecture.component("rover").core
    rover.until(lambda: core.x > 0.2)  # Control in C++ read target and pose, and the rover its command
    shell = rover.architecture.component("rover").shell
    assert shell.period_ns == 10 * MS
    assert rover.describe("control").releases > 0
    pose, sequence, time_ns = rover.deployer.read_resource("pose")
    assert deserialize_message(pose, Pose2D).x <= core.x
    assert sequence > 0
    assert (time_ns - rover.deployer.epoch_ns) % (10 * MS) == 0, "the writer's logical clock"


def test_a_core_in_python_is_replaced_live_beside_cpp(rover: Stage):
    deployer = rover.deploy()
    component = rover.architecture.component("rover")
    rover.until(lambda: component.core.x > 0.05)
    before = component.core.x
    for core_class in (SlipperyCore, RoverCore) * 3:
        report = deployer.replace_core("rover", core_class)
        assert report.phase_nominal_ns == 0
        assert report.to_core == f"mauve_examples/{core_class.__name__}"
        assert type(component.core) is core_class
    assert component.core.x >= before, "it goes on where it was"
    rover.until(component.core.is_there)
    assert {item.state for item in rover.architecture.components()} == {"RUNNING"}


def test_a_component_in_python_runs_at_a_kilohertz(built: Stage):
    class FastFsm(ActFsm):
        def define(self) -> None:
            act, pause = self.execution("Act", IdleCore.act), self.wait("Pause", MS)
            self.set_initial(act)
            self.next(act, pause)
            self.next(pause, act)

    built.add("fast", EmptyShell, IdleCore, FastFsm)
    built.deploy()
    built.until(lambda: built.describe("fast").releases > 200)
    assert built.describe("fast").period_ns == MS


def test_a_core_in_python_on_an_fsm_in_cpp_and_not_the_reverse(built: Stage):
    loader = PluginLoader(built.registry, PluginIndex.installed())
    for kind, name in (("core", "Metronome"), ("fsm", "MetronomeFsm"), ("core", "PythonMetronome")):
        loader.require(kind, f"mauve_examples/{name}")
    shell = "mauve_examples/MetronomeShell"
    built.add("good", shell, "mauve_examples/PythonMetronome", "mauve_examples/MetronomeFsm")
    built.add("bad", shell, "mauve_examples/Metronome", ActFsm)
    built.architecture.add_resource("beat", kind="shared_data", type="std_msgs/msg/Float64")
    for name in ("good", "bad"):
        built.architecture.connect(name, "beat", "beat", "write")
    built.architecture.component("good").configure()
    with pytest.raises(MauveError, match="an fsm in Python finds the core's methods by name") as refused:
        built.architecture.component("bad").configure()
    assert refused.value.code == "type_mismatch"
    assert refused.value.component == "bad"
    assert built.describe("bad").state == "UNCONFIGURED"


def test_classes_can_be_registered_by_name(built: Stage):
    built.registry.shell("test/CountShell", CountShell)
    built.registry.core("test/CountCore", CountCore, "test/CountShell")
    built.registry.fsm("test/ActFsm", ActFsm, "test/CountShell")
    component = built.architecture.add_component(  # noqa: S604 - no program's shell
        "count",
        shell="test/CountShell",
        core="test/CountCore",
        fsm="test/ActFsm",
    )
    described = built.registry.describe_shell("test/CountShell")
    assert [(port.name, port.kind, port.type) for port in described.ports] == [("out", "write", POSE)]
    assert [(item.name, item.type, item.maximum) for item in described.properties] == [("step", "int", 10)]
    assert component.describe().core == "test/CountCore"
    component.configure()
    assert component.core.count == 0


# ---- messages that no library registered


class DriveShell(Shell):
    goal = read_port(DriveTo.Goal)
    feedback = write_port("mauve_msgs/action/DriveTo_Feedback")


class DriveCore(Core[DriveShell]):
    def configure(self) -> None:
        self.goals: list[Any] = []

    def act(self) -> None:
        self.goals.append(self.shell.goal.read().value)
        self.shell.feedback.write(DriveTo.Feedback(distance_m=self.goals[-1].tolerance_m))


class AskToDriveShell(Shell):
    goal = write_port(DriveTo.Goal)
    feedback = read_port(DriveTo.Feedback)


class AskToDriveCore(Core[AskToDriveShell]):
    def configure(self) -> None:
        self.distances: list[float] = []

    def act(self) -> None:
        self.shell.goal.write(DriveTo.Goal(tolerance_m=0.25))
        self.distances.append(self.shell.feedback.read().value.distance_m)


def test_ports_in_python_have_the_parts_of_an_action_as_types(built: Stage):
    built.add("drive", DriveShell, DriveCore)
    built.add("ask", AskToDriveShell, AskToDriveCore)
    built.share("goal", SharedData(DriveTo.Goal), "ask.goal.write", "drive.goal.read")
    built.share("feedback", SharedData(DriveTo.Feedback), "drive.feedback.write", "ask.feedback.read")
    built.deploy()
    ask = built.architecture.component("ask").core
    built.until(lambda: 0.25 in ask.distances)
    types = {(port.name, port.type) for port in built.describe("drive").ports}
    assert types == {(part, f"mauve_msgs/action/DriveTo_{part.title()}") for part in ("goal", "feedback")}


def test_unregistered_messages_travel_between_components_in_python(built: Stage):
    add_pair(built)
    deployer = built.deploy()
    hear = built.architecture.component("hear").core
    built.until(lambda: len(hear.samples) >= 20)
    samples = list(hear.samples)  # the component goes on
    heard = [int(sample.value.pose.position.x) for sample in samples]
    assert heard == sorted(heard)
    assert all(sample.value.header.frame_id == f"count {n}" for sample, n in zip(samples, heard, strict=True))
    assert all((sample.time_ns - deployer.epoch_ns) % (2 * MS) == 0 for sample in samples)
    deployer.stop("count")
    count = len(hear.samples)
    built.until(lambda: hear.samples[-1].value.header.frame_id == "")
    assert len(hear.samples) <= count + 1, "its output went to zero once"


def test_unregistered_messages_have_a_face_to_topics(built: Stage):
    add_pair(built)
    built.architecture.publish("pose")
    deployer = built.deploy()
    built.until(lambda: deployer.wait_published(10 * MS))
    deployer.stop("count")
    assert deployer.write_resource("pose", serialize_message(PoseStamped()))
    data, _, _ = deployer.read_resource("pose")
    assert deserialize_message(data, PoseStamped) == PoseStamped()
    long = PoseStamped()
    long.header.frame_id = "x" * 70_000
    assert not deployer.write_resource("pose", serialize_message(long)), "longer than its max_bytes"


@pytest.mark.parametrize(("overwrite", "kept"), [(False, ["1", "2"]), (True, ["2", "3"])])
def test_rings_of_unregistered_messages_are_bounded(built: Stage, *, overwrite: bool, kept: list[str]):
    class Burst(CountCore):
        def act(self) -> None:
            if self.count == 0:
                self.taken = []
                for word in "123":
                    pose = PoseStamped()
                    pose.header.frame_id = word
                    self.taken.append(self.shell.out.write(pose))
            self.count = 1

    class Late(HearCore):
        def act(self) -> None:
            if self.shell.clock_ns - start_ns > 40 * MS:
                super().act()

    built.add("burst", CountShell, Burst)
    built.add("late", HearShell, Late)
    ring = RingBuffer(PoseStamped, 2, overwrite=overwrite)
    built.share("ring", ring, "burst.out.write", "late.heard.read")
    start_ns = 1 << 62
    start_ns = built.deploy().epoch_ns
    late, burst = (built.architecture.component(name).core for name in ("late", "burst"))
    built.until(lambda: len(late.samples) == 2)
    assert [sample.value.header.frame_id for sample in late.samples] == kept
    assert burst.taken == [True, True, overwrite]


def test_one_name_in_two_representations_is_refused(built: Stage):
    class PointShell(Shell):
        point = write_port(Point)

    built.add("early", PointShell, IdleCore)  # before C++ registers the type
    PluginLoader(built.registry, PluginIndex.installed()).require("type", "geometry_msgs/msg/Point")
    built.add("late", PointShell, IdleCore)
    built.architecture.add_resource("point", SharedData(Point))
    built.architecture.connect("late", "point", "point", "write")
    with pytest.raises(MauveError, match="in different ways") as refused:
        built.architecture.connect("early", "point", "point", "write")
    assert refused.value.code == "type_mismatch"
    assert "serialized" in refused.value.expected
    assert "C++" in refused.value.found


def test_a_type_that_nobody_knows_is_refused(built: Stage):
    class OddShell(Shell):
        odd = read_port("package/Odd")

    with pytest.raises(MauveError, match="package/Odd") as refused:
        built.add("odd", OddShell, IdleCore)
    assert refused.value.code == "unknown_type"


# ---- what a shell has


class AskShell(Shell):
    """One port of each kind."""

    heard = read_port(Point)
    said = write_port(Point)
    rung = event_port()
    asked = call_port("package/Ask")


@pytest.mark.parametrize("left_out", ["heard", "said", "rung", "asked"])
def test_required_ports_are_connected_before_configure(built: Stage, left_out: str):
    class Oracle(Resource):
        @service("package/Ask")
        def ask(self) -> int:
            return 1

    built.add("asker", AskShell, IdleCore)
    places = {"heard": "point.read", "said": "point.write", "rung": "bell.raise", "asked": "oracle.ask"}
    for name, resource in (("point", SharedData(Point)), ("bell", EventCounter()), ("oracle", Oracle)):
        built.architecture.add_resource(name, resource)
    for port, place in places.items():
        if port != left_out:
            built.architecture.connect("asker", port, *place.split("."))
    with pytest.raises(MauveError, match="a required port is not connected") as refused:
        built.architecture.configure()
    assert (refused.value.code, refused.value.component) == ("not_connected", "asker")
    assert refused.value.element == f"port {left_out}"
    built.architecture.connect("asker", left_out, *places[left_out].split("."))
    deployer = built.deploy()
    with pytest.raises(MauveError, match="a required port is not connected") as refused:
        deployer.commit(Transaction().disconnect("asker", left_out))
    assert (refused.value.code, refused.value.element) == ("not_connected", f"port {left_out}")


def test_unconnected_ports_and_defaults(built: Stage):
    class LoneShell(Shell):
        heard = read_port(Point, default=Point(x=7.0), optional=True)
        plain = read_port(Point, optional=True)
        said = write_port(Point, optional=True)
        rung = event_port(optional=True)

    class LoneCore(Core[LoneShell]):
        seen: tuple[Any, ...] = ()

        def act(self) -> None:
            self.shell.rung.raise_()
            samples = (self.shell.heard.read(), self.shell.plain.read())
            self.seen = (*samples, self.shell.said.write(Point()))

    component = built.add("lone", LoneShell, LoneCore)
    built.deploy()
    built.until(lambda: component.core.seen)
    heard, plain, wrote = component.core.seen
    assert (heard.value.x, heard.status, heard.age_ns(1)) == (7.0, "none", 0)
    assert (plain.value.x, plain.status, wrote) == (0.0, "none", True)


def test_every_component_has_members_of_its_own(built: Stage):
    class Both(CountShell):
        def __init__(self) -> None:
            self.limit = property(2.5, unit="m")  # declared by the object

    one, two = built.add("one", Both, CountCore), built.add("two", Both, CountCore)
    one.set_property("step", 3)
    one.set_property("limit", 4)
    assert (one.shell.step.value, two.shell.step.value) == (3, 1)
    assert (one.shell.limit.value, two.shell.limit.value) == (4.0, 2.5)
    with pytest.raises(MauveError, match=r"at least 1 and at most 10"):
        two.set_property("step", 11)
    with pytest.raises(RuntimeError, match="belongs to no component"):
        _ = CountShell.step.value


def test_what_is_set_while_it_runs_is_seen_by_python(built: Stage):
    add_pair(built)
    deployer = built.deploy()
    deployer.set_property("count", "step", 7)
    assert built.architecture.component("count").shell.step.value == 7


# ---- Listing 3 of the paper


def test_listing_3(built: Stage):
    class LocalCore(CountCore):
        pass

    add_pair(built)
    deployer = built.deploy()
    count = built.architecture.component("count")
    built.until(lambda: deployer.get_time("count") > 0)
    clock = deployer.get_time("count")
    deployer.stop("count")
    assert count.state == "STOPPED"
    count.cleanup_core()
    count.replace_core(LocalCore)
    count.configure_core()
    deployer.start("count", clock + ms_to_ns(50))
    built.until(lambda: count.core.count > 3)
    assert type(count.core) is LocalCore
    assert (deployer.get_time("count") - deployer.epoch_ns) % (2 * MS) == 0
    with pytest.raises(MauveError, match="stopped component"):
        count.cleanup_core()


# ---- the ends of things


def test_nothing_is_left_of_what_is_gone():
    registry = PluginRegistry()
    architecture = Architecture(registry)
    component = architecture.add_component("count", CountShell, CountCore, ActFsm)
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.deploy()
    for _ in range(5):
        deployer.replace_core("count", CountCore)
    core, shell = component.core, component.shell
    deployer.shutdown()
    kept = [weakref.ref(core), weakref.ref(shell), weakref.ref(core.act)]
    del component, deployer, architecture, registry
    gc.collect()
    with pytest.raises(MauveError, match="is gone"):
        shell.out.write(PoseStamped())
    with pytest.raises(MauveError, match="is gone"):
        _ = shell.clock_ns
    del core, shell
    gc.collect()
    assert [reference() for reference in kept] == [None] * 3


def test_replaced_cores_are_let_go(built: Stage):
    made: list[weakref.ref[Any]] = []

    class Remembered(CountCore):
        def configure(self) -> None:
            super().configure()
            made.append(weakref.ref(self))

    built.add("count", CountShell, Remembered)
    deployer = built.deploy()
    for _ in range(10):
        deployer.replace_core("count", Remembered)
    gc.collect()
    assert [reference() is not None for reference in made] == [False] * 10 + [True]


def test_a_component_waiting_for_the_interpreter_can_be_stopped(built: Stage):
    add_pair(built)
    deployer = built.deploy()
    done = threading.Event()

    def keep_busy() -> None:
        while not done.is_set():
            sum(range(10_000))

    busy = [threading.Thread(target=keep_busy) for _ in range(3)]
    for thread in busy:
        thread.start()
    try:
        for _ in range(20):
            deployer.stop("count", 10_000 * MS)
            deployer.start("count")
    finally:
        done.set()
        for thread in busy:
            thread.join()
    assert sys.getswitchinterval() <= 1e-4


@pytest.mark.parametrize("ending", ["", "del architecture, deployer", "sys.exit(0)", "deployer.shutdown()"])
def test_a_process_ends_with_components_in_python_still_running(ending: str):
    program = f"""
        import sys, time
        from mauve_rt.api import *
        from mauve_rt.api import property
        class S(Shell): pass
        class C(Core[S]):
            def act(self): sum(range(1000))
        class F(Fsm[S, C]):
            def define(self):
                act, pause = self.execution("Act", C.act), self.wait("Pause", ms_to_ns(1))
                self.set_initial(act); self.next(act, pause); self.next(pause, act)
        architecture = Architecture(PluginRegistry())
        for i in range(4): architecture.add_component(f"c{{i}}", S, C, F)
        architecture.configure()
        deployer = Deployer(architecture)
        deployer.deploy()
        while any(c.releases < 10 for c in architecture.components()): time.sleep(0.001)
        {ending}
    """
    ended = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)], capture_output=True, text=True, check=False
    )
    assert (ended.returncode, ended.stderr) == (0, "")


def test_a_part_of_the_wrong_kind_is_refused(built: Stage):
    for parts in (
        (CountCore, CountCore, ActFsm),
        (CountShell, CountShell, ActFsm),
        (CountShell, CountCore, 3),
    ):
        with pytest.raises(TypeError, match="expected a registered name or a class"):
            built.architecture.add_component("count", *parts)
    assert built.architecture.components() == []
    assert issubclass(ActFsm, Fsm)


def test_events_are_counted(built: Stage):
    class BellShell(Shell):
        bell = event_port()

    class BellCore(Core[BellShell]):
        rung = 0

        def act(self) -> None:
            self.rung += 1
            self.shell.bell.raise_()

    component = built.add("bell", BellShell, BellCore)
    built.share("count", EventCounter(), "bell.bell.raise")
    deployer = built.deploy()
    built.until(lambda: component.core.rung >= 5)
    deployer.stop("bell")
    _, counted, time_ns = deployer.read_resource("count")
    assert counted == component.core.rung
    assert (time_ns - deployer.epoch_ns) % (2 * MS) == 0


def test_a_latest_value_has_one_writer_and_a_type_that_cpp_knows(built: Stage):
    class PoseShell(Shell):
        pose = write_port(Pose2D)

    with pytest.raises(MauveError, match="only known to Python") as refused:
        built.architecture.add_resource("none", LatestValue(PoseStamped))
    assert refused.value.code == "unknown_type"
    PluginLoader(built.registry, PluginIndex.installed()).require("type", "geometry_msgs/msg/Pose2D")
    built.architecture.add_resource("pose", LatestValue(Pose2D))
    for name in ("one", "two"):
        built.add(name, PoseShell, IdleCore)
    built.architecture.connect("one", "pose", "pose", "write")
    with pytest.raises(MauveError, match="at most 1 port"):
        built.architecture.connect("two", "pose", "pose", "write")
