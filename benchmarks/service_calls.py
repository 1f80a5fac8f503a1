"""An executor's services: how long calls take, and the blackout of replace_core on a busy machine."""

import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import machine
import native
import numpy as np
import rclpy
import stress
from busy_executor import ARCHITECTURE, COMPONENT
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rows import Row, compared
from settings import Settings
from std_srvs.srv import Trigger
from talkers import Talkers, plugin_prefix

from mauve_msgs.msg import StepReport
from mauve_msgs.srv import ReplaceCore, Start, Stop

_CORES = ("mauve_examples/Accelerando", "mauve_examples/Metronome")
_REPLY_S = 10.0
_DISCOVERY_S = 20.0
_PAUSE_S = 0.002  # longest pause between calls: a random pause reaches every phase of the 1 ms period
_UNDER_WAY_S = 0.02  # after which a preparation, which takes 0.1 s, is under way


def service_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of calls, one after the other, of a 1 kHz component's replacement and of Trigger."""
    with ExitStack() as stack:
        processes = stack.enter_context(Processes())
        executor = ExecutorProcess(processes, ARCHITECTURE)
        trigger_name = f"{executor.namespace}/trigger"
        processes.spawn("trigger", str(Path(__file__).with_name("trigger_server.py")), trigger_name)
        processes.await_output("trigger", "ready")
        calls = stack.enter_context(_SpunClient())
        trigger = calls.client(Trigger, trigger_name)
        replace = calls.client(ReplaceCore, f"{executor.namespace}/executor/replace_core")

        def replacements(number: int) -> list[float]:
            requests = _replacements(number, settings.service_calls)
            return [calls.duration_ns(replace, request) for request in requests]

        def triggers(_: int) -> list[float]:
            return [calls.duration_ns(trigger, Trigger.Request()) for _ in range(settings.service_calls)]

        rounds = native.interleaved(settings.rounds, replacements, triggers)
    yield from _compared(
        "replace_core of a 1 kHz component over its service",
        rounds,
        beside="a bare std_srvs/Trigger call",
        ratio_limits={50: 1.5, 99: 1.5},
    )


def service_blackout_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of replacements of a 1 kHz component's core: another process computes on each CPU, or none."""
    with ExitStack() as stack:
        processes = stack.enter_context(Processes())
        executor = ExecutorProcess(processes, ARCHITECTURE)
        calls = stack.enter_context(_SpunClient())
        replace = calls.client(ReplaceCore, f"{executor.namespace}/executor/replace_core")

        def blackout_ns(request: ReplaceCore.Request) -> float:
            future = replace.call_async(request)
            calls.result(replace, future)
            (step,) = future.result().report
            if step.blackout_ns == StepReport.NOT_MEASURED:
                raise BenchmarkError(f"no blackout in the report of {step.step}: {COMPONENT} does not run")
            return float(step.blackout_ns)

        def blackouts(number: int) -> list[float]:
            random = np.random.default_rng(number)
            found = []
            for request in _replacements(number, settings.service_calls):
                time.sleep(random.uniform(0, _PAUSE_S))
                found.append(blackout_ns(request))
            return found

        def busy(number: int) -> list[float]:
            with stress.computing():
                return blackouts(number)

        idle_percents = []

        def idle(number: int) -> list[float]:
            meter = machine.IdleMeter()
            found = blackouts(number)
            idle_percents.append(meter.percent())
            return found

        rounds = native.interleaved(settings.rounds, busy, idle)
    yield from _compared(
        "replace_core of a 1 kHz component over its service, an ordinary thread busy on each CPU, blackout",
        rounds,
        beside="the same, machine idle",
        ratio_limits={50: 1.2, 99: None},
        note=f"the CPUs were idle for {np.median(idle_percents):.0f} % of the time of the idle side (median)",
    )


def service_stop_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of stops of a 1 kHz component, beside another one's core that is prepared, and alone."""
    with ExitStack() as stack:
        processes = stack.enter_context(Processes())
        path = processes.folder / "talkers.yaml"
        talkers = Talkers(path, count=2, priority=settings.priority, cpu=settings.cpu)
        executor = ExecutorProcess(processes, talkers.architecture, plugins=plugin_prefix(processes.folder))
        calls = stack.enter_context(_SpunClient())
        stop, start, replace = (
            calls.client(kind, f"{executor.namespace}/executor/{name}")
            for kind, name in ((Stop, "stop"), (Start, "start"), (ReplaceCore, "replace_core"))
        )
        changed, stopped = talkers.names

        def stop_once() -> float:
            time.sleep(_UNDER_WAY_S)
            duration_ns = calls.duration_ns(stop, Stop.Request(component=stopped))
            calls.duration_ns(start, Start.Request(component=stopped))
            return duration_ns

        def stop_beside_once() -> float:
            preparing = replace.call_async(ReplaceCore.Request(component=changed, core="bench/Sluggish"))
            duration_ns = stop_once()
            if preparing.done():
                raise BenchmarkError(f"the preparation was over too soon: {preparing.result().message}")
            calls.result(replace, preparing)
            return duration_ns

        def stops(_: int) -> list[float]:
            return [stop_once() for _ in range(settings.busy_stops)]

        def stops_beside(_: int) -> list[float]:
            return [stop_beside_once() for _ in range(settings.busy_stops)]

        rounds = native.interleaved(settings.rounds, stops_beside, stops)
    yield from _compared(
        "stop of a 1 kHz component over its service while another one's new core is prepared",
        rounds,
        beside="the same alone",
        ratio_limits={50: 2.0, 99: 2.0},
    )


def _replacements(number: int, count: int) -> Iterator[ReplaceCore.Request]:
    """The requests of a round: the two cores in turn."""
    for index in range(count):
        yield ReplaceCore.Request(component=COMPONENT, core=_CORES[(number + index) % 2])


def _compared(
    what: str,
    rounds: Sequence[Any],
    *,
    beside: str,
    ratio_limits: Mapping[int, float | None],
    note: str = "",
) -> Iterator[Row]:
    """One row for each percentile that has an entry in `ratio_limits`; None: no limit."""
    for percent, ratio_limit in ratio_limits.items():
        pairs = [tuple(float(np.percentile(part, percent)) / 1e3 for part in found) for found in rounds]
        yield compared(
            f"{what}, p{percent}",
            [(pair[0], pair[1]) for pair in pairs],
            unit="us",
            beside=beside,
            ratio_limit=ratio_limit,
            note=note,
        )


class _SpunClient:
    """A context: a node that a thread spins, which calls services."""

    def __enter__(self) -> Self:
        self._context = Context()
        rclpy.init(context=self._context, args=[])
        self._node = rclpy.create_node("bench_client", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ending.set()
        self._thread.join()
        self._executor.shutdown(timeout_sec=0)
        self._node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        while not self._ending.is_set():
            self._executor.spin_once(timeout_sec=0.2)

    def client(self, service_type: Any, name: str) -> Any:
        """A client of a service that is there and has answered once."""
        client = self._node.create_client(service_type, name)
        if not client.wait_for_service(_DISCOVERY_S):
            raise BenchmarkError(f"no service {name} within {_DISCOVERY_S:g} s")
        until = time.monotonic() + _DISCOVERY_S
        while time.monotonic() < until:  # a first reply may be lost: the service may not know its client yet
            answered = threading.Event()
            client.call_async(service_type.Request()).add_done_callback(lambda _: answered.set())  # noqa: B023
            if answered.wait(1.0):
                return client
        raise BenchmarkError(f"no reply of {name} within {_DISCOVERY_S:g} s")

    def duration_ns(self, client: Any, request: Any) -> float:
        """How long a call takes that succeeds."""
        begin_ns = time.monotonic_ns()
        future = client.call_async(request)
        answered_ns = self.result(client, future)
        return float(answered_ns - begin_ns)

    def result(self, client: Any, future: Any) -> int:
        """When the answer to a call was there; it is yes."""
        answered = threading.Event()
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(_REPLY_S):
            raise BenchmarkError(f"no reply of {client.srv_name} within {_REPLY_S:g} s")
        now_ns = time.monotonic_ns()
        reply = future.result()
        if not reply.success:
            raise BenchmarkError(f"{client.srv_name} refused: {reply.message}")
        return now_ns
