"""What large messages cost: an image and a cloud sent and taken, beside the same with rcl alone.

All are on one topic: an executor and a bare program send in turn, an executor and a bare program take.
"""

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import native
import numpy as np
import numpy.typing as npt
from executor_process import ExecutorProcess
from processes import Processes
from rows import Row, compared
from scope import Scope
from settings import Settings
from talkers import plugin_prefix
from topics import Side, Window, process_cpu_ns

from mauve_rt.cli.client import connected

_PROGRAM = str(Path(__file__).with_name("rcl_program.py"))
_SETTLE_S = 2.0  # until all know each other
_LIMIT = 1.5


@dataclass(frozen=True)
class Kind:
    """A message, and how often it is sent."""

    name: str
    type: str
    capacity: Mapping[str, int]
    rate_hz: int
    words: str


_KINDS = (
    Kind("image", "sensor_msgs/msg/Image", {"data": 6_220_800}, 30, "an Image of 6 MB at 30 Hz"),
    Kind(
        "cloud",
        "sensor_msgs/msg/PointCloud2",
        {"fields": 4, "data": 1_048_576},
        100,
        "a PointCloud2 of 1 MB at 100 Hz",
    ),
)


class Stage(Scope):
    """A context: who sends and who takes, none of whom sends yet."""

    def __init__(self, settings: Settings, kind: Kind) -> None:
        self._settings = settings
        self._kind = kind
        super().__init__()

    def _enter(self, stack: ExitStack) -> None:
        self._processes = stack.enter_context(Processes())
        client = stack.enter_context(connected())
        plugins = plugin_prefix(self._processes.folder, package="bench_large", plugin="large")
        sender, self._taker = (
            ExecutorProcess(self._processes, self._architecture(part), name=part, plugins=plugins)
            for part in ("sender", "taker")
        )
        sender.stop(client, "sender")
        self._taker.wait()
        bare_sender, self._bare_taker = self._bare("send"), self._bare("take")
        self.senders = (
            Side(
                sender.pid,
                lambda: sender.start(client, "sender"),
                lambda: sender.stop(client, "sender"),
            ),
            Side(
                bare_sender,
                lambda: self._processes.tell("send", "start"),
                lambda: self._processes.tell("send", "stop"),
            ),
        )
        time.sleep(_SETTLE_S)

    def measured(self, sender: Side) -> Sequence[Window]:
        """Of the sender, of the executor that takes, and of the bare program that does."""
        takers = (self._taker.pid, self._bare_taker)
        before = [process_cpu_ns(pid) for pid in takers]
        window = sender.measured(self._settings.topics_s)
        used = [process_cpu_ns(pid) - cpu_ns for pid, cpu_ns in zip(takers, before, strict=True)]
        return [window, *(window._replace(cpu_ns=cpu_ns) for cpu_ns in used)]

    def arrivals(self) -> Sequence[npt.NDArray[np.int64]]:
        """Rows of instant sent and instant taken, at the executor and at the bare program; both end."""
        self._processes.tell("take", "write")
        self._processes.await_output("take", "written")
        self._taker.end()
        files = (self._processes.folder / name for name in ("taken", "taken_bare"))
        return [np.fromfile(file, np.int64).reshape(-1, 2) for file in files]

    def _bare(self, word: str) -> int:
        options = {"type": self._kind.name, "topic": "/bench_large"}
        if word == "send":
            options |= {"period-us": str(1_000_000 // self._kind.rate_hz)}
            options |= {"priority": str(self._settings.priority), "cpu": str(self._settings.cpu)}
        else:
            options |= {"publishers": "2", "file": str(self._processes.folder / "taken_bare")}
        words = [word for name, value in options.items() for word in (f"--{name}", value)]
        pid = self._processes.spawn(word, _PROGRAM, word, *words)
        self._processes.await_output(word, "ready")
        return pid

    def _architecture(self, part: str) -> Path:
        kind, is_sender = self._kind, part == "sender"
        name = f"bench_large/{kind.name.title()}{part.title()}"
        properties: dict[str, Any] = {"file": str(self._processes.folder / "taken")}
        if is_sender:
            properties = {"period_us": 1_000_000 // kind.rate_hz}
        topic = {"name": "/bench_large", "direction": "publish" if is_sender else "subscribe"}
        resource = {"kind": "shared_data", "type": kind.type, "topic": topic, "capacity": kind.capacity}
        component = {"shell": f"{name}Shell", "core": name, "fsm": f"{name}Fsm"}
        component |= {"priority": self._settings.priority, "cpus": [self._settings.cpu]}
        path = self._processes.folder / f"{part}.yaml"
        model = {
            "mauve": 1,
            "components": {part: component | {"properties": properties}},
            "resources": {"large": resource},
            "connections": [
                [f"{part}.output", "large.write"] if is_sender else [f"{part}.input", "large.read"]
            ],
        }
        path.write_text(json.dumps(model), encoding="utf-8")  # which is YAML
        return path


def large_message_rows(settings: Settings) -> Iterator[Row]:
    """For each message the CPU of who sends it and of who takes it."""
    for kind in _KINDS:
        with Stage(settings, kind) as stage:
            rounds = native.interleaved(
                settings.rounds, *(lambda _, side=side: stage.measured(side) for side in stage.senders)
            )
            arrivals = stage.arrivals()
        sent = [(ours[0], bare[0]) for ours, bare in rounds]
        taken = [tuple(bare[1:]) for _, bare in rounds]
        yield _row(
            f"CPU of an executor that sends {kind.words}",
            sent,
            "bare rcl publisher, same subscribers",
            [_lost(kind, arrivals[1], [pair[which] for pair in sent]) for which in range(2)],
        )
        yield _row(
            f"CPU of an executor that takes {kind.words}",
            taken,
            "bare rcl subscriber, same publisher",
            [_lost(kind, found, [bare[0] for _, bare in rounds]) for found in arrivals],
        )


def _row(what: str, pairs: Sequence[Sequence[Window]], beside: str, lost: Sequence[str]) -> Row:
    return compared(
        what,
        [(ours.cpu_percent, bare.cpu_percent) for ours, bare in pairs],
        unit="%",
        beside=beside,
        ratio_limit=_LIMIT,
        note=f"of the messages due, lost: the executor's {lost[0]}, the bare program's {lost[1]}",
    )


def _lost(kind: Kind, arrivals: npt.NDArray[np.int64], windows: Sequence[Window]) -> str:
    """Of the messages due in the windows, those that never arrived whole."""
    sent = arrivals[:, 0]
    came = sum(int(((sent >= one.begin_ns) & (sent < one.end_ns)).sum()) for one in windows)
    due = sum(kind.rate_hz * (one.end_ns - one.begin_ns) / 1e9 for one in windows)
    return f"{max(0.0, 100 * (1 - came / due)):.1f} %"
