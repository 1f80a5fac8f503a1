"""What recording 100,000 trace records a second costs: an executor while it records and while not."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import native
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from rows import Row, alone, compared, exactly_zero
from settings import Settings
from talkers import Talkers, plugin_prefix

import mauve_rt.trace
from mauve_msgs.srv import StartRecording, StopRecording
from mauve_rt.cli.client import Client, connected

_TALKERS, _MARKS = 5, 16  # 1 kHz each, 4 records of the kernel's and these: 100,000 a second
_SETTLE_S = 0.3
_START_S = 10.0  # the executor may have been spawned just now


class _Recorded(NamedTuple):
    cpu_percent: float
    """Of one CPU, of all threads but the components'."""
    records_per_s: float
    bytes_per_record: float
    lost: int


def recording_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of an executor that records, and of the same while it does not."""
    with Processes() as processes, connected() as client:
        bags = processes.folder / "bags"
        bags.mkdir()
        talkers = Talkers(
            processes.folder / "traced.yaml",
            count=_TALKERS,
            marks=_MARKS,
            priority=settings.priority,
            cpu=settings.cpu,
        )
        executor = ExecutorProcess(
            processes, talkers.architecture, f"bags:={bags}", plugins=plugin_prefix(processes.folder)
        )

        def recorded(number: int) -> _Recorded:
            bag = bags / f"round_{number}"
            ask(client, executor, StartRecording, "start_recording", StartRecording.Request(bag=bag.name))
            cpu_percent = _cpu_percent(executor.pid, settings.recording_s)
            ask(client, executor, StopRecording, "stop_recording", StopRecording.Request())
            return _of_bag(bag, cpu_percent)

        def not_recorded(_: int) -> _Recorded:
            return _Recorded(_cpu_percent(executor.pid, settings.recording_s), 0.0, 0.0, 0)

        rounds = native.interleaved(settings.rounds, recorded, not_recorded)
        executor.end()
    found = [pair[0] for pair in rounds]
    rate = [one.records_per_s for one in found]
    what = "CPU that recording takes at 100,000 records a second"
    costs = [recording.cpu_percent - idle.cpu_percent for recording, idle in rounds]
    yield alone(
        what,
        costs,
        unit="%",
        limit=33.0,
        note="of one core: all threads but the components', less the same while nothing is recorded",
    )
    yield compared(
        "the executor's threads but the components', recording",
        [(recording.cpu_percent, idle.cpu_percent) for recording, idle in rounds],
        unit="%",
        beside="recording nothing",
    )
    yield alone("records written a second", rate, unit="records/s")
    yield alone("bytes of a record in the bag", [one.bytes_per_record for one in found], unit="B")
    yield exactly_zero("records lost at that rate, in any round", [one.lost for one in found])


def _of_bag(bag: Path, cpu_percent: float) -> _Recorded:
    trace = mauve_rt.trace.open(bag)
    count = sum(loss.received for loss in trace.losses.values())
    begin_ns, end_ns = trace.span_ns
    size = sum(file.stat().st_size for file in bag.iterdir())
    return _Recorded(cpu_percent, 1e9 * count / max(end_ns - begin_ns, 1), size / max(count, 1), trace.lost)


def ask(client: Client, executor: ExecutorProcess, service_type: type, name: str, request: object) -> None:
    """Call a service of the executor.

    Raises:
        BenchmarkError: the answer is no.
    """
    reply = client.call(service_type, f"{executor.namespace}/executor/{name}", request, wait_s=_START_S)
    if not reply.success:
        raise BenchmarkError(f"{name} refused: {reply.message}")


def _cpu_percent(pid: int, duration_s: float) -> float:
    time.sleep(_SETTLE_S)
    cpu_ns, begin_ns = _other_threads_cpu_ns(pid), time.monotonic_ns()
    time.sleep(duration_s)
    cpu_ns, end_ns = _other_threads_cpu_ns(pid) - cpu_ns, time.monotonic_ns()
    return 100 * cpu_ns / (end_ns - begin_ns)


def _other_threads_cpu_ns(pid: int) -> int:
    """CPU time of all threads of a process that are no components."""
    total = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        try:
            name = (task / "comm").read_text(encoding="utf-8")
            fields = (task / "schedstat").read_text(encoding="utf-8").split()
        except OSError:  # it has ended
            continue
        if not name.startswith("talker_"):
            total += int(fields[0])
    return total
