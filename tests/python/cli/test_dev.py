"""The parts of `mauve dev` that need no executor: sources, commands, the cycle, outputs and the screen."""

import io
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from mauve_msgs.msg import ComponentInfo, PortInfo, Value
from mauve_rt.cli.dev_command import Command
from mauve_rt.cli.dev_cycle import Development, Plan
from mauve_rt.cli.dev_outputs import OutputSamples, OutputStep, output_names
from mauve_rt.cli.dev_reload import Answer, Verdict
from mauve_rt.cli.dev_sources import POLL_S, Save, Sources
from mauve_rt.cli.dev_verb import press
from mauve_rt.cli.dev_view import dev_view
from mauve_rt.errors import ParameterError

PATIENCE_S = 60.0


class Clock:
    """Time that a test moves."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


# Sources


def scanned(sources: Sources, clock: Clock) -> Save | None:
    """As the next scan finds them."""
    clock.now_s += POLL_S
    return sources.look()


def settled(sources: Sources, clock: Clock) -> list[str]:
    """Names of the files of one save; the first scan after it reports nothing yet."""
    assert scanned(sources, clock) is None
    save = scanned(sources, clock)
    assert scanned(sources, clock) is None, "a save is reported once"
    return [path.name for path in save.files] if save is not None else []


def write(path: Path, text: str = "x") -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.mark.parametrize(
    "name",
    [
        "a.cpp",
        "a.hpp",
        "a.h",
        "a.cc",
        "a.cxx",
        "a.hh",
        "a.ipp",
        "a.py",
        "CMakeLists.txt",
        "x.cmake",
        "package.xml",
    ],
)
def test_sources_are_watched(name: str, tmp_path: Path, clock: Clock) -> None:
    write(tmp_path / "core" / name)
    sources = Sources([tmp_path], clock=clock)
    assert sources.count == 1
    assert scanned(sources, clock) is None
    write(tmp_path / "core" / name, "new text")
    assert settled(sources, clock) == [name]


@pytest.mark.parametrize(
    "name",
    ["build/a.cpp", "install/a.py", "log/a.txt", ".git/a.h", "__pycache__/a.py", ".a.py", "a.o", "out/a.cpp"],
)
def test_what_a_build_writes_is_not_watched(name: str, tmp_path: Path, clock: Clock) -> None:
    write(tmp_path / "out" / "CMakeCache.txt")
    sources = Sources([tmp_path], clock=clock)
    write(tmp_path / name)
    assert scanned(sources, clock) is None
    assert settled(sources, clock) == []


def test_a_file_that_is_renamed_into_place_added_or_removed(tmp_path: Path, clock: Clock) -> None:
    write(tmp_path / "core.cpp", "old")
    sources = Sources([tmp_path], clock=clock)
    stamp = (tmp_path / "core.cpp").stat()
    write(tmp_path / "core.swp", "new")
    os.utime(tmp_path / "core.swp", ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    (tmp_path / "core.swp").replace(tmp_path / "core.cpp")
    assert settled(sources, clock) == ["core.cpp"], "another inode, of the same time and size"
    write(tmp_path / "new_folder" / "new.py")
    assert settled(sources, clock) == ["new.py"]
    (tmp_path / "core.cpp").unlink()
    assert settled(sources, clock) == ["core.cpp"]


def test_several_writes_are_one_save(tmp_path: Path, clock: Clock) -> None:
    sources = Sources([tmp_path], clock=clock)
    for name in ("a.cpp", "b.cpp", "c.cpp"):
        write(tmp_path / name)
        assert scanned(sources, clock) is None, "a file was written since the last scan"
    save = scanned(sources, clock)
    assert save is not None
    assert [path.name for path in save.files] == ["a.cpp", "b.cpp", "c.cpp"]


def test_a_package_that_is_a_link_is_watched_once_also_in_a_cycle(tmp_path: Path, clock: Clock) -> None:
    write(tmp_path / "elsewhere" / "core.cpp")
    source = tmp_path / "src"
    source.mkdir()
    for name in ("package", "same_package"):
        (source / name).symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere" / "up").symlink_to(source)
    sources = Sources([source], clock=clock)
    assert sources.count == 1
    write(tmp_path / "elsewhere" / "core.cpp", "new text")
    assert settled(sources, clock) == ["core.cpp"]


def test_a_path_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match=r"nowhere: expected a file or folder, found nothing"):
        Sources([tmp_path / "nowhere"])


# Commands


def ended(command: Command) -> int:
    deadline = time.monotonic() + PATIENCE_S
    while (status := command.poll()) is None:
        assert time.monotonic() < deadline, "the command never ended"
        time.sleep(0.01)
    return status


def test_a_command_keeps_the_end_of_its_output() -> None:
    command = Command("for i in $(seq 2000); do echo line $i; done; printf '\\033[31merror\\n' >&2; exit 4")
    assert ended(command) == 4
    assert command.last_lines(3) == ["line 1999", "line 2000", " [31merror"]


def test_a_command_that_is_stopped_takes_its_processes_along(tmp_path: Path) -> None:
    command = Command(f"sleep 1000 & echo $! > {tmp_path}/pid; wait")
    deadline = time.monotonic() + PATIENCE_S
    while not ((tmp_path / "pid").exists() and (tmp_path / "pid").read_text("ascii").strip()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    command.stop()
    child = Path("/proc") / (tmp_path / "pid").read_text("ascii").strip() / "stat"
    while child.exists() and child.read_text("ascii").rpartition(")")[2].split()[0] != "Z":
        assert time.monotonic() < deadline, "the child runs on"
        time.sleep(0.01)


# The cycle


@dataclass
class FakeCommand:
    """Ends when a test says so."""

    line: str
    status: int | None = None
    is_stopped: bool = False

    def poll(self) -> int | None:
        return self.status

    def last_lines(self, _count: int) -> list[str]:
        return [f"output of {self.line}"]

    def stop(self) -> None:
        self.is_stopped = True


@dataclass
class FakeRun:
    """As ReloadRun."""

    request: Any
    answer: Answer | None = None
    release_s: float | None = None
    steps: Sequence[OutputStep] = ()
    is_settled: bool = False
    decided: Verdict = field(default_factory=lambda: Verdict("running", left_s=4.0))

    def look(self) -> None:
        """Tests set what it knows."""

    def verdict(self) -> Verdict:
        return self.decided

    def accept(self, release_s: float | None = None) -> None:
        """As an executor that puts the new code in force."""
        self.answer = Answer(success=True, message="generation 2", is_changed=True)
        self.release_s, self.is_settled = release_s, True
        self.steps = [OutputStep("loop.sum:data", 3.0, 1003.0)]


@dataclass
class FakeExecutor:
    """As DevExecutor."""

    is_there: bool = True
    instance_id: str = "one"
    runs: list[FakeRun] = field(default_factory=list)

    def look(self) -> None:
        """Tests set what it knows."""

    def reload(self, *, back: bool) -> FakeRun:
        self.runs.append(FakeRun(SimpleNamespace(back=back)))
        return self.runs[-1]


class World:
    """A development, its commands, and the lines that it tells."""

    def __init__(self, plan: Plan) -> None:
        self.clock, self.executor = Clock(), FakeExecutor()
        self.commands: list[FakeCommand] = []
        self.lines: list[str] = []

        def run(line: str) -> Any:
            self.commands.append(FakeCommand(line))
            return self.commands[-1]

        self.development = Development(plan, self.executor, tell=self.lines.append, run=run, clock=self.clock)

    def save(self) -> None:
        self.development.save(Save((Path("core.cpp"),), self.clock.now_s))
        self.look()

    def end_command(self, status: int) -> None:
        self.clock.now_s += 2.0
        self.commands[-1].status = status
        self.look()

    def look(self) -> None:
        self.development.look()

    @property
    def outcomes(self) -> list[str]:
        return [cycle.outcome for cycle in self.development.cycles]


@pytest.fixture
def world() -> World:
    return World(Plan("make", "ctest", probation_s=10.0))


def on_probation(world: World) -> FakeRun:
    """A cycle whose code runs on probation."""
    world.save()
    world.end_command(0)
    world.end_command(0)
    run = world.executor.runs[-1]
    run.accept(release_s=world.clock.now_s + 0.5)
    world.look()
    return run


def test_from_a_save_to_a_verdict(world: World) -> None:
    world.look()
    world.save()
    assert world.development.state.startswith("building")
    world.end_command(0)
    assert world.development.state.startswith("testing")
    world.end_command(0)
    assert world.development.state.startswith("reloading")
    [run] = world.executor.runs
    assert not run.request.back
    run.accept(release_s=104.5)
    world.look()
    assert world.development.state == "on probation, 4.0 s left"
    run.decided = Verdict("passed")
    world.look()
    assert world.development.state == "watching"
    assert not world.development.is_busy
    [cycle] = world.development.cycles
    assert (cycle.outcome, cycle.is_good) == ("passed", True)
    assert (cycle.build_s, cycle.test_s, cycle.total_s) == (2.0, 2.0, 4.5)
    assert [command.line for command in world.commands] == ["make", "ctest"]
    assert "cycle 1: output loop.sum:data 3 -> 1003, step 1000" in world.lines
    assert world.lines[-1] == "cycle 1: passed"


@pytest.mark.parametrize(("statuses", "what"), [([1], "build failed"), ([0, 2], "test failed")])
def test_code_that_fails_is_not_loaded(statuses: list[int], what: str, world: World) -> None:
    world.save()
    for status in statuses:
        world.end_command(status)
    assert world.outcomes == [what]
    assert not world.executor.runs
    assert not world.development.cycles[0].is_good
    assert world.lines[-1] == f"cycle 1: | output of {world.commands[-1].line}"


@pytest.mark.parametrize(
    ("answer", "outcome", "is_good"),
    [
        (Answer(success=False, message="INVALID (3): crashed", is_changed=False), "refused", False),
        (Answer(success=True, message="no code was rebuilt", is_changed=False), "nothing changed", True),
    ],
)
def test_a_reload_that_changes_nothing(answer: Answer, outcome: str, *, is_good: bool, world: World) -> None:
    world.save()
    world.end_command(0)
    world.end_command(0)
    world.executor.runs[0].answer = answer
    world.look()
    [cycle] = world.development.cycles
    assert (cycle.outcome, cycle.message, cycle.is_good) == (outcome, answer.message, is_good)
    assert not world.development.is_busy


@pytest.mark.parametrize(
    ("verdict", "outcome", "is_good"),
    [
        (Verdict("reverted", "loop: output loop.sum.data is nan"), "reverted", False),
        (Verdict("inconclusive", "loop: no release"), "inconclusive", False),
        (Verdict("none"), "in force", True),
    ],
)
def test_the_verdict_is_the_outcome(verdict: Verdict, outcome: str, *, is_good: bool, world: World) -> None:
    on_probation(world).decided = verdict
    world.look()
    [cycle] = world.development.cycles
    assert (cycle.outcome, cycle.is_good) == (outcome, is_good)
    assert verdict.reason in cycle.message


def test_without_a_probation_the_first_release_ends_the_cycle() -> None:
    world = World(Plan("make"))
    world.save()
    world.end_command(0)
    world.executor.runs[0].accept()
    world.look()
    assert world.outcomes == ["in force"]


def test_a_save_during_a_build_or_a_test_starts_again(world: World) -> None:
    world.save()
    world.save()
    assert world.commands[0].is_stopped
    world.end_command(0)
    world.save()
    assert world.commands[2].is_stopped, "the test"
    assert world.outcomes == ["superseded", "superseded", ""]
    assert [command.line for command in world.commands] == ["make", "make", "ctest", "make"]
    assert not world.executor.runs


def test_a_save_during_a_reload_waits_for_the_reply(world: World) -> None:
    world.save()
    world.end_command(0)
    world.end_command(0)
    world.save()
    assert len(world.commands) == 2
    world.executor.runs[0].accept()
    world.look()
    assert len(world.commands) == 3
    assert world.development.state.startswith("building"), "the first code is on probation"
    world.end_command(0)
    world.end_command(0)
    world.executor.runs[1].accept()
    world.look()
    assert world.outcomes == ["superseded", ""]


def test_keys(world: World) -> None:
    on_probation(world)
    assert press("b", world.development)
    assert [run.request.back for run in world.executor.runs] == [False, True]
    assert press("b", world.development), "once more: after the reply"
    world.executor.runs[1].accept()
    world.look()
    assert [run.request.back for run in world.executor.runs] == [False, True, True]
    assert world.outcomes == ["superseded", "went back", ""]
    world.executor.runs[2].answer = Answer(success=False, message="there is no way back", is_changed=False)
    world.look()
    assert press("r", world.development)
    assert world.commands[-1].line == "make"
    assert press("b", world.development)
    assert world.commands[-1].is_stopped
    assert world.outcomes[3] == "stopped"
    assert press("x", world.development)
    assert not press("q", world.development)


def test_an_executor_that_ends_is_told_and_the_cycle_goes_on(world: World) -> None:
    world.look()
    world.executor.is_there = False
    world.save()
    world.end_command(0)
    world.end_command(0)
    assert world.outcomes == ["not loaded"]
    world.executor.is_there, world.executor.instance_id = True, "two"
    on_probation(world)
    world.executor.instance_id = "three"
    world.look()
    assert world.outcomes == ["not loaded", "lost"]
    world.save()
    world.end_command(0)
    world.end_command(0)
    world.executor.is_there = False
    world.look()
    assert world.outcomes == ["not loaded", "lost", "lost"]
    told = [line for line in world.lines if line.startswith("the executor")]
    assert told == [
        "the executor answers",
        "the executor does not answer",
        "the executor is back",
        "the executor does not answer",
    ]


# Outputs


def component(name: str, package: str) -> ComponentInfo:
    ports = [
        PortInfo(name="out", kind=PortInfo.WRITE, resource="sum"),
        PortInfo(name="free", kind=PortInfo.WRITE),
        PortInfo(name="in", kind=PortInfo.READ, resource="sum"),
    ]
    parts = {"shell": f"{package}/Shell", "core": f"{package}/Core", "fsm": "p/Fsm"}
    return ComponentInfo(name=name, ports=ports, **parts)


def test_outputs_are_the_connected_write_ports_of_the_targets() -> None:
    listed = [component("a", "arm"), component("b", "base")]
    assert output_names(listed, []) == ["a.out", "b.out"]
    assert output_names(listed, ["b"]) == ["b.out"]
    assert output_names(listed, ["arm"]) == ["a.out"]


def value(time_ns: int, number: float, *, with_definition: bool = False) -> Value:
    import struct  # noqa: PLC0415

    data = b"\0\1\0\0" + struct.pack("<d", number)
    definition = "float64 data\n" if with_definition else ""
    facts = {"name": "a.out", "type": "std_msgs/msg/Float64", "status": Value.WRITTEN}
    return Value(**facts, data=list(data), definition=definition, time_ns=time_ns, writes=1)


def test_the_step_is_between_the_last_value_before_and_the_first_since() -> None:
    samples = OutputSamples()
    samples.take([value(10, 1.0)])
    assert samples.lacks_definitions
    samples.take([value(10, 1.0, with_definition=True)])
    for time_ns, number in ((20, 2.0), (20, 2.0), (30, 12.0), (40, 22.0)):
        assert not samples.are_after({"a": 30}) or time_ns == 40
        samples.take([value(time_ns, number)])
    assert samples.are_after({"a": 30})
    assert not samples.are_after({"a": 50})
    [step] = samples.steps({"a": 30, "b": 30})
    assert (step.name, step.before, step.after, step.step) == ("a.out:data", 2.0, 12.0, 10.0)
    [step] = samples.steps({"a": 50})
    assert (step.before, step.after, step.step) == (22.0, None, None)
    assert samples.steps({}) == []


def test_an_element_of_an_array_has_a_step_too() -> None:
    import struct  # noqa: PLC0415

    samples = OutputSamples()
    for time_ns, first in ((10, 1.0), (20, 3.0)):
        data = b"\0\1\0\0" + struct.pack("<ddI4xd", first, 5.0, 1, first * 2)
        definition = "float64[2] torque\nfloat64[] gains\n"
        facts = {"name": "a.out", "type": "t/msg/Torques", "status": Value.WRITTEN}
        samples.take([Value(**facts, data=list(data), definition=definition, time_ns=time_ns, writes=1)])
    steps = {step.name: (step.before, step.after) for step in samples.steps({"a": 20})}
    assert steps == {
        "a.out:torque[0]": (1.0, 3.0),
        "a.out:torque[1]": (5.0, 5.0),
        "a.out:gains[0]": (2.0, 6.0),
    }


# The screen


def shown(world: World) -> str:
    out = io.StringIO()
    console = Console(file=out, width=80, highlight=False)
    console.print(
        dev_view("/robot_1/executor", is_there=world.executor.is_there, development=world.development)
    )
    lines = [line.rstrip() for line in out.getvalue().splitlines() if line.strip()]
    assert max(map(len, lines)) <= 80
    return "\n".join(" ".join(line.split()) for line in lines)


def test_the_screen_shows_state_cycles_steps_and_errors(world: World) -> None:
    assert "watching" in shown(world)
    run = on_probation(world)
    text = shown(world)
    assert "on probation, 4.0 s left" in text
    assert "loop.sum:data 3 1003 1000" in text
    assert "1 saved core.cpp 2.00 s 2.00 s 0.00 s 4.50 s ..." in text
    run.decided = Verdict("reverted", "loop: output [sum]: data is nan")
    world.look()
    assert "watching reverted: loop: output [sum]: data is nan" in shown(world)
    world.save()
    assert "building 0.0 s output of make" in shown(world)
    world.end_command(1)
    text = shown(world)
    assert "watching build failed: exit status 1; the old code runs on" in text
    assert "\noutput of make\n" in text
    assert text.endswith("b back to the code before r build and reload now q quit")
    world.executor.is_there = False
    assert "does not answer" in shown(world)


def test_of_many_outputs_the_largest_steps_are_shown(world: World) -> None:
    run = on_probation(world)
    run.steps = [OutputStep(f"c.out:f{number}", 0.0, float(number)) for number in range(30)]
    world.development.cycles[0].steps = run.steps
    text = shown(world)
    assert "c.out:f29" in text
    assert "c.out:f17" not in text
    assert "18 more with smaller steps" in text
