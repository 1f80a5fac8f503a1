"""Several clients at once: one sequential order of their requests explains all answers."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from linearizability import Call, Part, State, facts_of, is_linearizable
from requesting_clients import FILE, Clients, RuntimeInTurns, TurnLock, Turns

from mauve_rt._kernel import Simulation
from mauve_rt.control import control as executor_control
from mauve_rt.control.control import Control
from mauve_rt.control.requests import Code, Outcome, Request, Step
from mauve_rt.control.runtime import Runtime
from mauve_rt.model import load_architecture

SEEDS = 300
THREAD_SEEDS = 150


@contextmanager
def _active(runtime: Runtime) -> Iterator[None]:
    runtime.configure()
    runtime.activate()
    try:
        yield
    finally:
        runtime.deactivate()
        runtime.cleanup()


@pytest.fixture
def path(tmp_path: Path, plugin_prefix: Path) -> Path:
    del plugin_prefix
    path = tmp_path / "robot.yaml"
    path.write_text(FILE, encoding="utf-8")
    return path


@pytest.fixture
def simulated(path: Path) -> Iterator[RuntimeInTurns]:
    runtime = RuntimeInTurns(Simulation(), lambda: load_architecture(path))
    with _active(runtime):
        yield runtime


@pytest.fixture
def threaded(path: Path) -> Iterator[Runtime]:
    """Python switches between threads after each few instructions."""
    runtime = Runtime(lambda: load_architecture(path))
    interval = sys.getswitchinterval()
    with _active(runtime):
        sys.setswitchinterval(1e-6)
        yield runtime
        sys.setswitchinterval(interval)


def _in_turns(
    runtime: RuntimeInTurns, monkeypatch: pytest.MonkeyPatch, seed: int, kind: type[Control] = Control
) -> Clients:
    """The history of a seed, which decides each switch between the threads of the clients."""
    turns = runtime.turns = Turns(seed)

    def lock() -> TurnLock:
        return TurnLock(turns)

    monkeypatch.setattr(executor_control, "threading", SimpleNamespace(Lock=lock, Condition=lock))
    clients = Clients(runtime, kind(runtime).handle, seed, in_turns=True)
    turns.run(clients.bodies())
    return clients


def test_requests_in_virtual_time_are_linearizable(
    simulated: RuntimeInTurns, monkeypatch: pytest.MonkeyPatch
) -> None:
    for seed in range(SEEDS):
        clients = _in_turns(simulated, monkeypatch, seed)
        assert clients.is_linearizable(), f"seed {seed}\n{clients}"


def test_a_seed_gives_the_same_history_twice(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told = []
    for _ in range(2):
        runtime = RuntimeInTurns(Simulation(), lambda: load_architecture(path))
        with _active(runtime):
            told.append([str(_in_turns(runtime, monkeypatch, seed)) for seed in range(10)])
    assert told[0] == told[1]


def test_requests_on_threads_are_linearizable(threaded: Runtime) -> None:
    for seed in range(THREAD_SEEDS):
        clients = Clients(threaded, Control(threaded).handle, seed, in_turns=False)
        threads = [threading.Thread(target=body) for body in clients.bodies()]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert clients.is_linearizable(), f"seed {seed}\n{clients}"


class ActsTwice(Control):
    """A repeated request acts again, and has the first answer."""

    def handle(self, request: Request) -> Outcome:
        first = super().handle(request)
        if first.replayed:
            super().handle(replace(request, request_id=""))
        return first


class IgnoresIds(Control):
    def handle(self, request: Request) -> Outcome:
        return super().handle(replace(request, request_id=""))


class IgnoresRevisions(Control):
    def handle(self, request: Request) -> Outcome:
        return super().handle(replace(request, expected_revision=0))


class ChecksRevisionsTooEarly(Control):
    """Of the revision that a start or stop expects the kernel is not told."""

    def _start_or_stop(self, step: Step, request: Request, *, expected_revision: int) -> Outcome:
        del expected_revision
        return super()._start_or_stop(step, request, expected_revision=0)


class MakesDryRuns(Control):
    def handle(self, request: Request) -> Outcome:
        return super().handle(replace(request, dry_run=False))


class LeavesAStep(Control):
    """A request that is refused leaves its first step done."""

    def handle(self, request: Request) -> Outcome:
        outcome = super().handle(request)
        if not outcome.success and len(request.steps) > 1:
            super().handle(Request(steps=request.steps[:1]))
        return outcome


class CountsLess(Control):
    """The answer to a change has the revision before it."""

    def handle(self, request: Request) -> Outcome:
        outcome = super().handle(request)
        return replace(outcome, revision=outcome.revision - 1) if outcome.report else outcome


@pytest.mark.parametrize(
    "twin",
    [
        ActsTwice,
        IgnoresIds,
        IgnoresRevisions,
        ChecksRevisionsTooEarly,
        MakesDryRuns,
        LeavesAStep,
        CountsLess,
    ],
)
def test_a_weakened_control_is_found(
    twin: type[Control], simulated: RuntimeInTurns, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not all(_in_turns(simulated, monkeypatch, seed, twin).is_linearizable() for seed in range(SEEDS))


A, B = (Part(running=True, core="executor_tests/Counter", step=1.0, wire="") for _ in "ab")
START = State((("a", A), ("b", B)), revision=5, claimed=5)


def _stop(target: str, when: tuple[int, int], revision: int, *, expected: int = 0) -> Call:
    asked = Request(steps=(Step("stop", target),), expected_revision=expected)
    return Call(*when, Outcome(code=Code.OK, message="", revision=revision), asked)


def _read(when: tuple[int, int], revision: int, *, stopped: str) -> Call:
    facts = tuple((name, part._replace(running=name not in stopped)) for name, part in START.facts)
    return Call(*when, Outcome(code=Code.OK, message="", revision=revision), facts=facts)


@pytest.mark.parametrize(
    ("calls", "is_explained"),
    [
        ([_stop("a", (0, 3), 6), _stop("b", (1, 2), 7)], True),
        ([_stop("a", (0, 3), 6), _stop("b", (1, 2), 6)], False),  # two changes, one revision
        ([_stop("a", (0, 1), 7), _stop("b", (2, 3), 6)], False),  # revisions against the order in time
        ([_stop("a", (0, 3), 6, expected=5), _stop("b", (1, 2), 7, expected=5)], False),
        ([_stop("a", (0, 1), 6), _stop("b", (2, 3), 7, expected=6)], True),
        ([_stop("a", (0, 3), 6), _stop("a", (1, 2), 7)], True),  # both wait for one end
        ([_stop("a", (0, 1), 6), _stop("a", (2, 3), 7)], False),  # stopped twice
        ([_stop("a", (0, 1), 6), _read((2, 3), 6, stopped="a")], True),
        ([_stop("a", (0, 1), 6), _read((2, 3), 6, stopped="")], False),  # an old description
        ([_stop("a", (0, 3), 6), _read((1, 2), 5, stopped="a")], False),  # changed, and not counted
    ],
)
def test_the_check_knows_both(calls: list[Call], *, is_explained: bool) -> None:
    assert is_linearizable(START, calls) is is_explained


def test_after_its_answer_a_change_is_described_as_a_whole(threaded: Runtime) -> None:
    """Whoever looks while it is made sees its parts change one after the other."""
    control = Control(threaded)
    is_over = threading.Event()

    def look() -> None:
        while not is_over.is_set():
            threaded.observe()

    looking = threading.Thread(target=look)
    looking.start()
    try:
        for _ in range(30):
            for steps in (
                (Step("stop", "a"), Step("connect", "a", "set", "number.read")),
                (Step("start", "a"), Step("disconnect", "a", "set")),
            ):
                assert control.handle(Request(steps=steps, timeout_s=10.0)).success
                assert facts_of(threaded.observe().components) == facts_of(threaded.components())
    finally:
        is_over.set()
        looking.join()
