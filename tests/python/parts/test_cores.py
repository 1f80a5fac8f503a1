"""Cores written in Python: put in the place of one in C++ and taken out, live; what they raise is a fault."""

import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from geometry_msgs.msg import Point
from rclpy.serialization import deserialize_message
from std_msgs.msg import Float64

from mauve_examples.tutorials.python_cores import Metronome as PythonMetronome
from mauve_rt._kernel import (
    Architecture,
    ComponentDescription,
    Deployer,
    MauveError,
    PluginRegistry,
    monotonic_ns,
)
from mauve_rt.model import load_architecture
from mauve_rt.model.build import build
from mauve_rt.model.plugins import PluginIndex, PluginLoader
from mauve_rt.parts.cores import Core, Shell, core_factory

SHELL, FSM = "mauve_examples/MetronomeShell", "mauve_examples/MetronomeFsm"
METRONOME, PYTHON = "mauve_examples/Metronome", "mauve_examples/PythonMetronome"
MS = 1_000_000


@dataclass
class Stage:
    """A metronome that takes every core of this file, and a neighbour; deployed."""

    architecture: Architecture
    deployer: Deployer

    def replace(self, core: str) -> MauveError | None:
        """Replaces the metronome's core; the refusal, if it is refused."""
        try:
            report = self.deployer.replace_core("metronome", core)
        except MauveError as error:
            return error
        assert report.phase_nominal_ns == 0
        assert report.blackout_ns > 0
        return None

    def describe(self, name: str = "metronome") -> ComponentDescription:
        return next(item for item in self.architecture.components() if item.name == name)

    def beats(self, count: int) -> list[float]:
        """What the next so many beats say."""
        heard: list[float] = []
        self.until(lambda: heard.extend(self.heard()) or len(heard) >= count)
        return heard

    def heard(self) -> list[float]:
        published = self.deployer.wait_published(10 * MS)
        return [deserialize_message(data, Float64).data for _, data, _ in published]

    def until(self, condition: Callable[[], object]) -> None:
        end_ns = monotonic_ns() + 10_000 * MS
        while not condition():
            assert monotonic_ns() < end_ns, f"waited in vain; {self.describe().state} {self.describe().fault}"


class Counting(PythonMetronome):
    """Says who called it, where, and what it saw."""

    def __init__(self, shell: Shell) -> None:
        super().__init__(shell)
        self.threads: dict[str, int] = {}
        self.predecessors: list[object] = []
        self.clocks: list[int] = []

    def configure(self) -> None:
        super().configure()
        self.threads["configure"] = threading.get_ident()

    def adopt(self, old: object) -> None:
        super().adopt(old)
        self.predecessors.append(old)
        self.threads["adopt"] = threading.get_ident()

    def tick(self) -> None:
        super().tick()
        self.clocks.append(self.shell.clock_ns)
        self.threads["tick"] = threading.get_ident()

    def cleanup(self) -> None:
        self.threads["cleanup"] = threading.get_ident()


class FailsInTick(PythonMetronome):
    def tick(self) -> None:
        self.ticks = 1 // (self.beats - self.beats)


class WritesAPoint(PythonMetronome):
    def beat(self) -> None:
        self.shell.beat.write(Point())


class AsksForMore(PythonMetronome):
    def tick(self) -> None:
        self.shell.loudness.read()


class RefusesToConfigure(PythonMetronome):
    def configure(self) -> bool:
        return False


class FailsInConfigure(PythonMetronome):
    def configure(self) -> None:
        raise RuntimeError("no drum")


class RefusesToAdopt(PythonMetronome):
    def adopt(self, _old: object) -> bool:
        return False


class FailsInAdopt(PythonMetronome):
    def adopt(self, _old: object) -> None:
        raise RuntimeError("off beat")


class HasNoBeat(Core):
    def tick(self) -> None:
        """Only that."""

    def is_beat_due(self) -> bool:
        return False


class CannotBeMade(PythonMetronome):
    def __init__(self, _shell: Shell) -> None:
        raise RuntimeError("out of stock")


CORES = (
    Counting,
    FailsInTick,
    WritesAPoint,
    AsksForMore,
    RefusesToConfigure,
    FailsInConfigure,
    RefusesToAdopt,
    FailsInAdopt,
    HasNoBeat,
    CannotBeMade,
)


@pytest.fixture
def made() -> list[Counting]:
    """The cores that remember, in the order they were made."""
    return []


@pytest.fixture
def stage(made: list[Counting]) -> Iterator[Stage]:
    registry = PluginRegistry()
    loader = PluginLoader(registry, PluginIndex.installed())
    for kind, name in (("core", METRONOME), ("core", PYTHON), ("fsm", FSM), ("type", "std_msgs/msg/Float64")):
        loader.require(kind, name)

    def factory(core_class: type[Core]) -> Callable[[object], object]:
        def make(view: object) -> object:
            core = core_factory(core_class)(view)
            if isinstance(core, Counting):
                made.append(core)
            return core

        return make

    for core_class in CORES:
        registry.add_python_core(f"test/{core_class.__name__}", SHELL, factory(core_class))
    architecture = Architecture(registry)
    architecture.add_resource("beat", kind="shared_data", type="std_msgs/msg/Float64")
    names = [METRONOME, PYTHON, *(f"test/{core_class.__name__}" for core_class in CORES)]
    for name in ("metronome", "neighbour"):
        architecture.add_component(name, shell=SHELL, core=METRONOME, fsm=FSM, cpus=[0], alternatives=names)
        architecture.set_property(name, "ticks_per_beat", 3)
        architecture.set_property(name, "period_us", 2000)
    architecture.connect("metronome", "beat", "beat", "write")
    architecture.add_resource("other_beat", kind="shared_data", type="std_msgs/msg/Float64")
    architecture.connect("neighbour", "beat", "other_beat", "write")
    architecture.publish("beat")
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.deploy()
    yield Stage(architecture, deployer)
    deployer.shutdown()


def test_it_takes_the_place_of_a_core_in_cpp_and_gives_it_back(stage: Stage):
    stage.beats(5)
    assert stage.replace(PYTHON) is None
    assert stage.describe().core == PYTHON
    stage.heard()
    anew = stage.beats(3)
    assert anew == sorted(anew), "it counts on"
    assert stage.replace(METRONOME) is None
    assert stage.describe().core == METRONOME
    stage.beats(3)
    assert stage.describe().state == "RUNNING"


def test_its_hooks_run_on_ordinary_threads_its_actions_on_the_component_s(stage: Stage, made: list[Counting]):
    stage.replace("test/Counting")
    stage.until(lambda: "tick" in made[0].threads)
    stage.replace(METRONOME)
    threads = made[0].threads
    assert threads["configure"] not in (threads["tick"], threading.get_ident()), "it may hang"
    assert threads["tick"] == threads["adopt"] != threading.get_ident()
    assert threads["cleanup"] not in (threads["tick"], threading.get_ident()), "a thread that holds no change"


def test_it_sees_its_predecessor_when_that_is_python_too(stage: Stage, made: list[Counting]):
    stage.replace("test/Counting")
    stage.until(lambda: made[0].beats >= 2)
    stage.replace("test/Counting")
    first, second = made
    assert first.predecessors == [None], "the one before was in C++"
    assert second.predecessors == [first]
    assert second.beats >= first.beats >= 2


def test_it_sees_clock_period_and_properties_in_force(stage: Stage, made: list[Counting]):
    stage.replace("test/Counting")
    stage.until(lambda: len(made[0].clocks) >= 5)
    assert all((clock - stage.deployer.epoch_ns) % (2 * MS) == 0 for clock in made[0].clocks)
    assert made[0].shell.period_ns == 2 * MS
    stage.deployer.set_property("metronome", "ticks_per_beat", 7)
    assert made[0].shell.ticks_per_beat.value == 7


@pytest.mark.parametrize(
    ("core", "words"),
    [
        ("FailsInTick", ["ZeroDivisionError", "test_cores.py", ": tick"]),
        ("WritesAPoint", ["TypeError", "port 'beat' takes std_msgs/msg/Float64, not Point"]),
        ("AsksForMore", ["AttributeError", "no port or property 'loudness'", "period_us"]),
    ],
)
def test_what_it_raises_is_a_fault_of_its_component_alone(stage: Stage, core: str, words: list[str]):
    stage.beats(1)
    assert stage.replace(f"test/{core}") is None
    stage.until(lambda: stage.describe().state == "FAULTED")
    fault = stage.describe().fault
    for word in words:
        assert word in fault
    output = deserialize_message(stage.deployer.read_resource("beat")[0], Float64)
    assert output.data == 0.0, "its output is safe"
    releases = stage.describe("neighbour").releases
    stage.until(lambda: stage.describe("neighbour").releases > releases)
    with pytest.raises(MauveError, match="FAULTED"):
        stage.deployer.start("metronome")
    stage.deployer.replace_core("metronome", METRONOME)
    assert stage.describe().state == "STOPPED", "it is repaired"
    stage.deployer.start("metronome")
    stage.beats(1)


@pytest.mark.parametrize(
    ("core", "code", "words"),
    [
        ("RefusesToConfigure", "prepare_failed", "configure"),
        ("FailsInConfigure", "prepare_failed", "no drum"),
        ("HasNoBeat", "prepare_failed", "beat"),
        ("CannotBeMade", "prepare_failed", "out of stock"),
        ("RefusesToAdopt", "adopt_refused", "adopt"),
        ("FailsInAdopt", "adopt_refused", "off beat"),
    ],
)
def test_one_that_cannot_take_over_leaves_the_old_one_running(stage: Stage, core: str, code: str, words: str):
    heard = stage.beats(2)
    error = stage.replace(f"test/{core}")
    assert error is not None
    assert error.code == code
    assert words in str(error)
    assert error.component == "metronome"
    assert stage.describe().core == METRONOME
    later = stage.beats(2)
    assert later[-1] > heard[-1], "nothing was lost"


def test_shutting_down_ends_a_component_in_python(stage: Stage, made: list[Counting]):
    stage.replace("test/Counting")
    stage.until(lambda: "tick" in made[0].threads)
    stage.deployer.shutdown()
    assert stage.describe().state == "STOPPED"
    ticks = len(made[0].clocks)
    stage.deployer.deploy()
    stage.until(lambda: len(made[0].clocks) > ticks)


def test_the_tutorial_s_architecture_file_takes_it():
    plugin = PluginIndex.installed().find("core", PYTHON)
    assert plugin is not None
    assert plugin.is_python
    file = plugin.prefix / "share" / "mauve_examples" / "architecture" / "metronome.yaml"
    registry = PluginRegistry()
    architecture = build(load_architecture(file), registry)
    architecture.configure()
    deployer = Deployer(architecture)
    deployer.deploy()
    try:
        assert deployer.replace_core("metronome", PYTHON).to_core == PYTHON
        assert deployer.wait_published(10_000 * MS)
    finally:
        deployer.shutdown()
