"""The package reload_tests at work, for tests of reloads and probations; threads or virtual time."""

import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rebuilt_package import RebuiltPackage

from mauve_rt._kernel import ComponentDescription, ProbationRecord, Simulation
from mauve_rt.control.control import Control
from mauve_rt.control.judging import Judge
from mauve_rt.control.requests import Outcome, ReloadOrder, Request, Step
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.simulated_runtime import SimulatedRuntime
from mauve_rt.interfaces.descriptions import component_infos
from mauve_rt.model import load_architecture

MS = 1_000_000
# Virtual time goes first: a case compiles its variants of the package while no thread of a component runs.
WORLDS = ("virtual time", "threads")
FILE = """\
mauve: 1
executor: {EXECUTOR}
components:
  loop: {shell: reload_tests/LoopShell, core: reload_tests/Loop, fsm: reload_tests/LoopFsm,
         alternatives: ALTERNATIVES}
  twin: {shell: reload_tests/LoopShell, core: reload_tests/Loop, fsm: reload_tests/LoopFsm}
  python: {shell: reload_tests/LoopShell, core: reload_tests/PyLoop, fsm: reload_tests/LoopFsm}
resources:
  sum: {kind: shared_data, type: std_msgs/msg/Float64}
  box: {kind: reload_tests/Box}
  others: {kind: ring_buffer, type: std_msgs/msg/Float64, capacity: 2}
connections:
  - [loop.sum, sum.write]
  - [twin.sum, others.write]
  - [python.sum, others.write]
"""


@dataclass
class World:
    """An architecture at work, with a clock that the test lets run."""

    runtime: Runtime
    control: Control
    run: Callable[[int], None]  # so many milliseconds

    def reload(
        self, *targets: str, back: bool = False, dry_run: bool = False, probation: str = ""
    ) -> Outcome:
        order = ReloadOrder(targets=targets, back=back, probation=probation)
        return self._handle(Request(reload=order, dry_run=dry_run))

    def ask(self, *steps: Step) -> Outcome:
        return self._handle(Request(steps=steps))

    def _handle(self, request: Request) -> Outcome:
        outcome = self.control.handle(request)
        self.run(5)
        while outcome.pending is not None:
            outcome = outcome.pending.look(outcome, wait_ns=100 * MS)
        return outcome

    def decided(self) -> ProbationRecord:
        """The last verdict on a core on probation."""
        for _ in range(1000):
            self.runtime.host.settle_probations()
            records = [record for record in self.runtime.probations() if record.verdict != "running"]
            if records:
                return records[-1]
            self.run(5)
        raise AssertionError("no verdict")

    def part(self, name: str = "loop") -> ComponentDescription:
        return next(part for part in self.runtime.components() if part.name == name)

    def sum(self) -> tuple[float, int]:
        """What the loop wrote last, and how many times it wrote."""
        data, number, _ = self.runtime.host.read_resource("sum")
        return struct.unpack_from("<d", data, 4)[0], number

    def mean_step(self) -> float:
        """By how much the loop adds at each release."""
        self.run(3)  # a change that was decided is taken
        before, first = self.sum()
        while self.sum()[1] < first + 10:
            self.run(10)
        after, last = self.sum()
        return (after - before) / (last - first)

    def generation(self, name: str = "loop") -> int:
        return next(int(info.generation) for info in component_infos(self.runtime) if info.name == name)


def make_world(
    kind: str, folder: Path, alternatives: str, executor: str = "", settings: str = ""
) -> Iterator[World]:
    """The architecture, until the test ends.

    `kind`: as in WORLDS; `executor`: its settings; `settings`: those of the loop.
    """
    path = folder / "robot.yaml"
    text = FILE.replace("ALTERNATIVES", alternatives + settings).replace("EXECUTOR", executor)
    path.write_text(text, encoding="utf-8")
    if kind == "threads":
        runtime = Runtime(lambda: load_architecture(path))
        run = _sleep
    else:
        simulation = Simulation()
        runtime = SimulatedRuntime(simulation, lambda: load_architecture(path))
        run = _advance(simulation)
    runtime.configure()
    runtime.activate()
    world = World(runtime, Control(runtime, judge=Judge(runtime)), run)
    while world.sum()[1] == 0:
        run(10)
    yield world
    runtime.deactivate()
    runtime.cleanup()


def make_world_of_bad_cores(kind: str, folder: Path, rebuilt: RebuiltPackage) -> Iterator[World]:
    """As make_world(), of a package with cores that do one thing wrong each."""
    rebuilt.build("NEW_CORE")
    with rebuilt.index.open("a", encoding="utf-8") as file:
        for name in ("Throws", "Nan", "Loud", "Louder"):
            file.write(f"core; reload_tests/{name}; reload_tests/LoopShell; reload_tests\n")
    yield from make_world(kind, folder, alternatives="installed")


def _sleep(duration_ms: int) -> None:
    time.sleep(duration_ms * 1e-3)


def _advance(simulation: Simulation) -> Callable[[int], None]:
    return lambda duration_ms: simulation.run_until(simulation.now_ns() + duration_ms * MS)
