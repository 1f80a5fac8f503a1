"""Clients that send random requests to one Control at the same time, on threads or in turns."""

import itertools
import random
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from linearizability import Call, State, facts_of, is_linearizable

from mauve_rt._kernel import Host
from mauve_rt.control.requests import Code, Outcome, Request, Step
from mauve_rt.control.runtime import Observed, Runtime
from mauve_rt.control.simulated_runtime import SimulatedRuntime

FILE = """\
mauve: 1
components:
  a: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
      alternatives: [executor_tests/Backwards, executor_tests/Reluctant]}
  b: {shell: executor_tests/CounterShell, core: executor_tests/Counter, fsm: executor_tests/CounterFsm,
      alternatives: [executor_tests/Backwards, executor_tests/Reluctant]}
resources:
  number: {kind: shared_data, type: std_msgs/msg/Float64}
"""
_CORES = ("Counter", "Backwards", "Backwards", "Reluctant", "Undeclared")


class Turns:
    """Lets one thread run at a time; a seed decides at each switch() which one is next."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)  # noqa: S311 - not for secrets
        self._gates: dict[int, threading.Semaphore] = {}

    def run(self, bodies: Sequence[Callable[[], None]]) -> None:
        """Runs each body in a thread of its own, until all have ended."""

        def in_turns(body: Callable[[], None], gate: threading.Semaphore) -> None:
            gate.acquire()
            self._gates[threading.get_ident()] = gate
            try:
                body()
            finally:
                del self._gates[threading.get_ident()]
                gates.remove(gate)
                if gates:
                    self._random.choice(gates).release()

        gates = [threading.Semaphore(0) for _ in bodies]
        self._all = gates
        threads = [
            threading.Thread(target=in_turns, args=each) for each in zip(bodies, list(gates), strict=True)
        ]
        for thread in threads:
            thread.start()
        self._random.choice(gates).release()
        for thread in threads:
            thread.join()

    def switch(self) -> None:
        """Another thread may run here. Does nothing in a thread that takes no part."""
        own = self._gates.get(threading.get_ident())
        if own is not None and (following := self._random.choice(self._all)) is not own:
            following.release()
            own.acquire()


class TurnLock:
    """A lock, and a condition, of threads that run in turns."""

    def __init__(self, turns: Turns) -> None:
        self._turns = turns
        self._is_held = False

    def __enter__(self) -> None:
        self._turns.switch()
        while self._is_held:
            self._turns.switch()
        self._is_held = True

    def __exit__(self, *_: object) -> None:
        self._is_held = False

    def wait_for(self, condition: Callable[[], bool]) -> None:
        while not condition():
            self._is_held = False
            self.__enter__()

    def notify_all(self) -> None:
        """Whoever waits asks again at each turn."""


class RuntimeInTurns(SimulatedRuntime):
    """Another thread may run before each look at the architecture and each call of its host."""

    turns: Turns | None = None

    def _switch(self) -> None:
        if self.turns is not None:
            self.turns.switch()

    @property
    def host(self) -> Host:
        self._switch()
        return super().host

    @property
    def revision(self) -> int:
        self._switch()
        return super().revision

    def observe(self, *, changed_since: int | None = None, anew: bool = False) -> Observed:
        self._switch()
        return super().observe(changed_since=changed_since, anew=anew)


class Clients:
    """Clients of one executor, and the history of their calls."""

    def __init__(
        self, runtime: Runtime, handle: Callable[[Request], Outcome], seed: int, *, in_turns: bool
    ) -> None:
        """In turns the clients read the architecture, too, and a start or stop may expect a revision.

        On threads an executor shows a change a moment after it is made: a start or stop of that moment finds
        the revision before.
        """
        self.calls: list[Call] = []
        self._runtime = runtime
        self._handle = handle
        self._seed = seed
        self._in_turns = in_turns
        self._clock = itertools.count()
        self._sent: list[Request] = []
        self.start = self._read()

    def __str__(self) -> str:
        return "\n".join(map(str, self.calls))

    def bodies(self) -> list[Callable[[], None]]:
        """What the threads of 2 to 4 clients do."""
        numbers = [random.Random(f"{self._seed} {client}") for client in range(4)]  # noqa: S311 - not for secrets
        return [partial(self._run, each, client) for client, each in enumerate(numbers[: 2 + self._seed % 3])]

    def is_linearizable(self) -> bool:
        """Whether one order explains all answers, and what the architecture is now."""
        revision = self.start.outcome.revision
        start = State(self.start.facts, revision, claimed=revision)
        return is_linearizable(start, [*self.calls, self._read()])

    def _run(self, numbers: random.Random, client: int) -> None:
        revision = self.start.outcome.revision
        for move in range(5):
            if numbers.random() < 0.1 and self._in_turns:
                call = self._read()
            else:
                call = self._ask(self._choose(numbers, f"{client}.{move}", revision))
            self.calls.append(call)
            revision = call.outcome.revision

    def _choose(self, numbers: random.Random, request_id: str, revision: int) -> Request:
        if self._sent and numbers.random() < 0.2:
            return numbers.choice(self._sent)
        if self._sent and numbers.random() < 0.1:
            request_id = numbers.choice(self._sent).request_id
        request = Request(
            steps=tuple(_random_step(numbers) for _ in range(numbers.choice((1, 1, 1, 2, 3)))),
            request_id=request_id,
            expected_revision=numbers.choice((0, 0, revision, revision, revision - 1)),
            dry_run=numbers.random() < 0.1,
            timeout_s=10.0,
        )
        return request if self._in_turns or not request.is_direct else replace(request, expected_revision=0)

    def _ask(self, request: Request) -> Call:
        self._sent.append(request)
        begin = next(self._clock)
        outcome = self._handle(request)
        return Call(begin, next(self._clock), outcome, request)

    def _read(self) -> Call:
        begin = next(self._clock)
        seen = self._runtime.observe()
        outcome = Outcome(code=Code.OK, message="", revision=seen.revision)
        return Call(begin, next(self._clock), outcome, facts=facts_of(seen.components))


def _random_step(numbers: random.Random) -> Step:
    target = numbers.choice("ab")
    return numbers.choice(
        (
            Step("start", target),
            Step("stop", target),
            Step("replace_core", target, f"executor_tests/{numbers.choice(_CORES)}"),
            Step("set_property", target, "step", numbers.choice(("1.0", "2.0", "99.0"))),
            Step("connect", target, "set", "number.read"),
            Step("disconnect", target, "set"),
        )
    )
