"""What recording topics of other nodes costs: an executor, and a bare rcl reader that writes the same."""

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import native
from executor_process import ExecutorProcess
from native import BenchmarkError
from processes import Processes
from recording import ask
from recording_kept import cpu_s
from rows import Row, compared, exactly_zero
from settings import Settings
from talkers import Talkers, plugin_prefix

from mauve_msgs.srv import StartRecording, StopRecording
from mauve_rt.cli.client import Client, connected
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.recording.ledger import ledger_of

_TOPICS = 20  # of 1 kHz
_CLOUDS_HZ = 30  # of 1 MB
_NAMESPACE, _LARGE = "/bench_recorded", "/bench_large"
_POINT, _CLOUD = "geometry_msgs/msg/Point", "sensor_msgs/msg/PointCloud2"
_SETTLE_S = 1.0
_PROGRAM = str(Path(__file__).with_name("rcl_program.py"))


class _Recorded(NamedTuple):
    cpu_percent: float
    """Of one CPU, of all threads but the components' and of the keeper."""
    lost: int = 0
    lost_before: int = 0


def recording_topics_rows(settings: Settings) -> Iterator[Row]:
    """Rounds of an executor that records 20 topics of 1 kHz and one of 30 MB/s, and of a bare reader."""
    with Processes() as processes, connected() as client:
        bags = processes.folder / "bags"
        bags.mkdir()
        talkers = Talkers(
            processes.folder / "quiet.yaml", count=1, priority=settings.priority, cpu=settings.cpu
        )
        executor = ExecutorProcess(
            processes, talkers.architecture, f"bags:={bags}", plugins=plugin_prefix(processes.folder)
        )
        executor.stop(client, talkers.names[0])
        _start_publishers(processes, settings)

        def recorded(number: int) -> _Recorded:
            return _by_executor(client, executor, bags / f"round_{number}", settings.recording_s)

        def bare(number: int) -> _Recorded:
            return _by_bare_reader(processes, f"reader_{number}", settings.recording_s)

        rounds = native.interleaved(settings.rounds, recorded, bare)
        executor.end()
    before = sum(ours.lost_before for ours, _ in rounds)
    yield compared(
        f"CPU of recording {_TOPICS} topics of other nodes at 1 kHz and one of {_CLOUDS_HZ} MB/s",
        [(ours.cpu_percent, bare.cpu_percent) for ours, bare in rounds],
        unit="%",
        beside="a bare rcl reader that writes the same bytes",
        ratio_limit=1.3,
        note=f"of all rounds together {before:,} messages were lost before the recorder received them",
    )
    yield exactly_zero(
        "messages of other nodes that the recorder lost, in any round", [ours.lost for ours, _ in rounds]
    )


def _start_publishers(processes: Processes, settings: Settings) -> None:
    place = ("--priority", str(settings.priority), "--cpu", str(settings.cpu))
    points = ("publish", "--namespace", _NAMESPACE, "--topics", str(_TOPICS))
    clouds = ("send", "--type", "cloud", "--topic", _LARGE, "--period-us", str(1_000_000 // _CLOUDS_HZ))
    for name, words in (("points", points), ("clouds", clouds)):
        processes.spawn(name, _PROGRAM, *words, *place)
        processes.await_output(name, "ready")
        processes.tell(name, "start")


def _by_executor(client: Client, executor: ExecutorProcess, bag: Path, duration_s: float) -> _Recorded:
    topics = [f"{_NAMESPACE}/point_{number}:{_POINT}:reliable" for number in range(_TOPICS)]
    request = StartRecording.Request(bag=bag.name, topics=[*topics, f"{_LARGE}:{_CLOUD}:reliable"])
    ask(client, executor, StartRecording, "start_recording", request)
    cpu_percent = _cpu_percent(executor.pid, duration_s)
    ask(client, executor, StopRecording, "stop_recording", StopRecording.Request())
    entries = ledger_of(examine_bag(bag).custom_data)
    others = [entry for entry in entries.values() if entry.numbered is not None]
    if len(others) != _TOPICS + 1 or not all(entry.received for entry in others):
        raise BenchmarkError(f"not all topics were recorded: {json.dumps(list(entries))}")
    for file in bag.iterdir():
        file.unlink()
    return _Recorded(cpu_percent, sum(one.lost for one in others), sum(one.lost_before for one in others))


def _by_bare_reader(processes: Processes, name: str, duration_s: float) -> _Recorded:
    file = processes.folder / f"{name}.bytes"
    words = ("--namespace", _NAMESPACE, "--topics", str(_TOPICS), "--large", _LARGE, "--file", str(file))
    pid = processes.spawn(name, _PROGRAM, "record", *words)
    processes.await_output(name, "ready")
    cpu_percent = _cpu_percent(pid, duration_s)
    processes.tell(name, "end")
    processes.await_output(name, "written")
    file.unlink()
    return _Recorded(cpu_percent)


def _cpu_percent(pid: int, duration_s: float) -> float:
    time.sleep(_SETTLE_S)
    before, began_s = cpu_s(pid), time.monotonic()
    time.sleep(duration_s)
    return 100 * (cpu_s(pid) - before) / (time.monotonic() - began_s)
