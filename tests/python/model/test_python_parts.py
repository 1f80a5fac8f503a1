"""Shells, fsms and resources written in Python, named in an architecture file as those in C++ are."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from page_blocks import blocks
from pages import PAGES
from std_msgs.msg import Float64
from waiting import wait_until

from mauve_rt import _kernel
from mauve_rt.api import (
    Architecture,
    Deployer,
    Host,
    Simulation,
    ms_to_ns,
    open_architecture,
    read_resource,
    s_to_ns,
)
from mauve_rt.errors import ArchitectureFileError, MauveError

ARCHITECTURE = """\
mauve: 1
components:
  ladder: {shell: executor_tests/LadderShell, core: executor_tests/Ladder, fsm: executor_tests/LadderFsm,
           alternatives: [executor_tests/DownLadder, executor_tests/RestlessFsm], properties: {step: 2.0}}
resources:
  meter: {kind: executor_tests/Meter, length: 5}
  height: {kind: shared_data, type: std_msgs/msg/Float64, topic: {name: height, direction: publish}}
connections:
  - [ladder.note, meter.note]
  - [ladder.height, height.write]
"""
INSTALLED = Path(_kernel.__file__).resolve().parents[4]
PERIOD_NS = ms_to_ns(10)

pytestmark = pytest.mark.usefixtures("plugin_prefix")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "robot.yaml"
    path.write_text(ARCHITECTURE, encoding="utf-8")
    return path


@pytest.fixture
def architecture(file: Path) -> Architecture:
    return open_architecture(file)


class OnThreads:
    """A component on its thread."""

    def __init__(self, architecture: Architecture) -> None:
        self.host: Host = Deployer(architecture)
        self.host.deploy()

    def until_above(self, height: float) -> None:
        wait_until(lambda: height_of(self.host) > height)

    def until_below(self, height: float) -> None:
        wait_until(lambda: height_of(self.host) < height)

    def close(self) -> None:
        self.host.shutdown()


class InVirtualTime(OnThreads):
    """The same without waiting."""

    def __init__(self, architecture: Architecture) -> None:
        self._simulation = Simulation()
        self.host = self._simulation.add(architecture)
        self._simulation.deploy()

    def _step(self) -> None:
        self._simulation.run_until(self._simulation.now_ns() + PERIOD_NS)

    def until_above(self, height: float) -> None:
        while height_of(self.host) <= height:
            self._step()

    def until_below(self, height: float) -> None:
        while height_of(self.host) >= height:
            self._step()

    def close(self) -> None:
        self._simulation.shutdown()


def height_of(host: Host) -> float:
    return read_resource(host, "height", Float64).value.data


@pytest.fixture(params=[OnThreads, InVirtualTime])
def run(request: pytest.FixtureRequest, architecture: Architecture) -> Iterator[OnThreads]:
    stage = request.param(architecture)
    yield stage
    stage.close()


def test_a_whole_component_of_a_file_runs_and_is_changed_in_flight(
    run: OnThreads, architecture: Architecture
) -> None:
    run.until_above(20.0)
    up = architecture.component("ladder").core
    assert (type(up).__name__, up.height % 2.0) == ("Ladder", 0.0), "steps of the file's property"
    report = run.host.replace_core("ladder", "executor_tests/DownLadder")
    assert report.missed_releases == 0
    assert architecture.component("ladder").core.height <= up.height
    run.until_below(10.0)
    run.host.set_property("ladder", "step", -3.0)
    run.until_above(20.0)
    (ladder,) = architecture.components()
    assert (ladder.shell, ladder.core, ladder.fsm) == tuple(
        f"executor_tests/{name}" for name in ("LadderShell", "DownLadder", "LadderFsm")
    )


def test_a_resource_of_a_file_has_its_parameter(architecture: Architecture) -> None:
    (meter,) = (each for each in architecture.resources() if each.name == "meter")
    assert meter.kind == "executor_tests/Meter"
    simulation = Simulation()
    simulation.add(architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + s_to_ns(1))
    heights = [2.0 * step for step in range(1, 102)]
    assert architecture.component("ladder").core.height == heights[-1], "t = 0, 10 ms, ... 1 s"
    simulation.shutdown()


@pytest.mark.parametrize(
    ("place", "kind", "part", "base"),
    [
        ("3:19", "shell", "shell: executor_tests/LadderShell", "Shell"),
        ("3:81", "fsm", "fsm: executor_tests/LadderFsm", "Fsm"),
        ("6:17", "resource", "kind: executor_tests/Meter", "Resource"),
    ],
)
def test_a_class_of_another_base_is_told_with_its_place(
    file: Path, place: str, kind: str, part: str, base: str
) -> None:
    key = part.partition(":")[0]
    file.write_text(ARCHITECTURE.replace(part, f"{key}: executor_tests/No{base}", 1), encoding="utf-8")
    with pytest.raises(ArchitectureFileError) as caught:
        open_architecture(file)
    assert str(caught.value) == (
        f"{file}:{place}: {kind} 'executor_tests/No{base}': executor_tests_whole:NoPart: "
        f"expected a class derived from mauve_rt.api.{base}, found one derived from object"
    )


@pytest.mark.parametrize(
    ("parameter", "message"),
    [
        ("length: 0", "6:47: bad length of resource 'meter': expected at least 1, found 0"),
        ("size: 5", "6:39: unknown key 'size' of resource 'meter'"),
    ],
)
def test_a_parameter_of_a_resource_is_checked(file: Path, parameter: str, message: str) -> None:
    file.write_text(ARCHITECTURE.replace("length: 5", parameter), encoding="utf-8")
    with pytest.raises(ArchitectureFileError) as caught:
        open_architecture(file)
    assert message in str(caught.value)


def test_an_fsm_in_python_needs_a_core_in_python(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        "mauve: 1\ncomponents:\n  counter: {shell: executor_tests/CounterShell, core: executor_tests/Counter,"
        " fsm: executor_tests/PyCounterFsm}\n",
        encoding="utf-8",
    )
    with pytest.raises(ArchitectureFileError, match="finds the core's methods by name"):
        open_architecture(path)


def test_a_resource_is_read_by_its_message(architecture: Architecture) -> None:
    host = Deployer(architecture)
    sample = read_resource(host, "height", Float64)
    assert (sample.value, sample.status) == (Float64(), "none")
    with pytest.raises(MauveError, match="heigt"):
        read_resource(host, "heigt", Float64)
    with pytest.raises(TypeError, match="expected a class of ROS messages"):
        read_resource(host, "height", float)


def test_the_rover_of_the_examples_is_tested_as_the_page_says(monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = (
        block.text
        for block in blocks(PAGES["docs/howto/write_a_core.md"])
        if "open_architecture(" in block.text
    )
    monkeypatch.chdir(INSTALLED.parent)
    exec(compile(code, "write_a_core.md", "exec"), {})  # noqa: S102 - a block of our own page


def test_the_rover_of_the_examples_takes_another_core() -> None:
    architecture = open_architecture(INSTALLED / "share/mauve_examples/architecture/rover.yaml")
    simulation = Simulation()
    host = simulation.add(architecture)
    simulation.deploy()
    simulation.run_until(simulation.epoch_ns() + s_to_ns(1))
    assert host.replace_core("rover", "mauve_examples/SlipperyRover").missed_releases == 0
    assert type(architecture.component("rover").core).__name__ == "SlipperyCore"
    simulation.shutdown()
