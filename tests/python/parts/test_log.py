"""log() of parts written in Python, on threads and in virtual time."""

from collections.abc import Iterator
from typing import Any

import pytest
from python_parts import ActFsm, Stage

from mauve_rt.api import Core, MauveError, Resource, Shell, Simulation, call_port, ms_to_ns, service


class Lamp(Resource):
    def configure(self) -> None:
        self.log().info("lamp of {} W", 5)

    @service("test/Switch")
    def switch(self, on: bool) -> None:  # noqa: FBT001 - a service's argument
        self.log().error("switched {}", on)


class LogShell(Shell):
    switch = call_port("test/Switch")


class LogCore(Core[LogShell]):
    def configure(self) -> None:
        self.runs = 0
        self.log().info("ready")

    def act(self) -> None:
        self.runs += 1
        if self.runs > 2:
            return
        self.log().debug("not kept")
        self.log().warn("run {} of {:.2f} by {}", self.runs, 0.5, self)
        self.shell.log().info("{} {{}}", 2**70)
        self.shell.switch(True)

    def __str__(self) -> str:
        return "the core"


@pytest.fixture(params=["threads", "virtual"])
def run(request: Any, built: Stage) -> Iterator[Any]:
    """Deploy, and act at least twice."""
    simulation = Simulation() if request.param == "virtual" else None

    def act() -> None:
        built.architecture.configure()
        core = built.architecture.component("c")
        if simulation is None:
            built.deploy()
            built.until(lambda: core.core.runs > 2)
            return
        simulation.add(built.architecture)
        simulation.deploy()
        simulation.run_until(simulation.epoch_ns() + ms_to_ns(10))

    yield act
    if simulation is not None:
        simulation.shutdown()


def add_logging(stage: Stage, **settings: Any) -> None:
    stage.architecture.add_component("c", LogShell, LogCore, ActFsm, **settings)
    stage.share("lamp", Lamp(), "c.switch.switch")


def told(stage: Stage) -> list[str]:
    entries = stage.architecture.take_log()
    assert not entries.lost
    return [f"{e.level} {e.component}/{e.source}/{e.state}: {e.text}" for e in entries.lines]


def test_lines_say_who_wrote_them_and_have_their_arguments(built: Stage, run: Any):
    add_logging(built)
    run()
    each = [
        "warn c//Act: run {} of 0.50 by the core",
        f"info c//Act: {2**70} {{}}",
        "error c/lamp/Act: switched true",
    ]
    assert told(built) == [
        "info /lamp/: lamp of 5 W",
        "info c//: ready",
        *(line.replace("run {}", f"run {n}") for n in (1, 2) for line in each),
    ]


def test_a_level_is_set_at_first_and_while_it_runs(built: Stage, run: Any):
    add_logging(built, log_level="debug")
    built.architecture.set_log_level("lamp", "fatal")
    run()
    lines = told(built)
    assert "debug c//Act: not kept" in lines
    assert not [line for line in lines if "lamp" in line]
    assert built.architecture.log_level("c") == "debug"
    assert built.architecture.log_level("lamp") == "fatal"
    with pytest.raises(MauveError, match="expected debug, info, warn, error, fatal"):
        built.architecture.set_log_level("c", "loud")
    with pytest.raises(MauveError, match="nobody"):
        built.architecture.set_log_level("nobody", "info")


def test_a_wrong_number_of_arguments_is_seen_in_the_line(built: Stage):
    class Careless(LogCore):
        def configure(self) -> None:
            super().configure()
            note = self.log()
            note.warn("{} and {}", 1)
            note.warn("{}", 1, 2)
            note.warn("{:>8} {:.1f}", "a", 2)
            note.warn("{ } }")
            note.warn("{} {} {} {} {} {} {} {} {}", *range(9))
            note.warn("{} {}", "x" * 100, None)

    built.architecture.add_component("c", LogShell, Careless, ActFsm)
    built.share("lamp", Lamp(), "c.switch.switch")
    built.architecture.configure()
    texts = [entry.text for entry in built.architecture.take_log().lines if entry.level == "warn"]
    assert texts == [
        "1 and {}",
        "1 2",
        "a 2",
        "{ } }",
        "0 1 2 3 4 5 6 7 {}",
        f"{'x' * 31} None",
    ]


def test_the_text_of_an_argument_may_write_a_line_itself(built: Stage, run: Any):
    class Careful(LogCore):
        def act(self) -> None:
            self.runs += 1
            if self.runs == 1:
                self.log().warn("{} at {}", self, 7)

        def __str__(self) -> str:
            self.log().info("asked for its text")
            return "the core"

    built.architecture.add_component("c", LogShell, Careful, ActFsm)
    built.share("lamp", Lamp(), "c.switch.switch")
    run()
    assert told(built)[2:] == ["info c//Act: asked for its text", "warn c//Act: the core at 7"]


def test_a_part_of_no_architecture_writes_nowhere():
    shell = LogShell()
    shell.log().error("into the void")
    Lamp().log().error("into the void")
    assert not shell.log().is_on("fatal")


def test_a_log_kept_longer_than_its_component_writes_nowhere(built: Stage):
    add_logging(built)
    built.architecture.configure()
    kept = built.architecture.component("c").core.log()
    assert kept.is_on("info")
    built.architecture.cleanup()
    built.architecture = None  # type: ignore[assignment]
    kept.error("too late")
