"""The messages of a bag's topics as CSV files, one for each topic."""

import csv
import json
import re
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from mauve_rt.fields import flat_fields
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress
from mauve_rt.trace.reading.facts import OWN_TYPES
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.reading.values import names_of_numbers

_TIMES = ("log_time_ns", "monotonic_ns")
_NO_NAME = re.compile(r"[^\w.-]")


def export_topics(trace: Trace, folder: Path, *, progress: Progress) -> list[str]:
    """Write `topic.NAME.csv` for each topic but the trace's own, `.` in the place of `/` in its name.

    A row is a message: its times (CLOCK_REALTIME, CLOCK_MONOTONIC), then a column for each field, as
    `pose.position.x`. An array is one column with all elements, as `mauve_rt.fields.json_value` has them.
    Each number of mauve_msgs/msg/Values has a column with its name, where the bag has the names. What is not
    valid UTF-8 is escaped. Returns which topics are left out, as a message of theirs cannot be read.
    """
    if not _problem(trace, (), folder, progress):
        return []
    topics = [topic for topic, (type_name, _) in trace.topics.items() if type_name not in OWN_TYPES]
    found = (_problem(trace, (topic,), folder, progress) for topic in topics)
    return [problem for problem in found if problem]


def _problem(trace: Trace, topics: tuple[str, ...], folder: Path, progress: Progress) -> str:
    """Write these, or none of them and return why."""
    before = {*folder.iterdir()}
    try:
        _write(trace, topics, folder, progress)
    except TraceError as error:
        for file in {*folder.iterdir()} - before:
            file.unlink()
        return str(error)
    return ""


def _write(trace: Trace, topics: tuple[str, ...], folder: Path, progress: Progress) -> None:
    """Messages of these topics; of all but the trace's own where none is named."""
    total = sum(count for _, count in trace.topics.values())
    with ExitStack() as open_files:
        tables: dict[str, _Table] = {}
        names = names_of_numbers(trace, topics or trace.topics)
        for done, message in enumerate(trace.messages(*topics)):
            row = _row(message.msg, names.get(message.topic, []))
            table = tables.get(message.topic)
            if table is None:
                path = folder / _file_name(message.topic, taken=[file.name for file in folder.iterdir()])
                table = tables[message.topic] = _Table(path, list(row), open_files)
            table.write(message.log_time_ns, message.monotonic_ns, row)
            if done % 1000 == 0:
                progress(done / total, table.path.name)


def _row(message: Any, names: list[str]) -> dict[str, Any]:
    row = {name: json.dumps(each) if isinstance(each, list) else each for name, each in flat_fields(message)}
    if names and len(names) == len(message.values):
        del row["values"]
        row |= zip(names, message.values.tolist(), strict=True)
    return row


class _Table:
    """One file, with a column for each field of its first message."""

    def __init__(self, path: Path, fields: list[str], open_files: ExitStack) -> None:
        self.path = path
        self._fields = fields
        text = path.open("w", encoding="utf-8", errors="backslashreplace", newline="")
        self._writer = csv.writer(open_files.enter_context(text), lineterminator="\n")
        self._writer.writerow([*_TIMES, *fields])

    def write(self, log_time_ns: int, monotonic_ns: int, row: dict[str, Any]) -> None:
        self._writer.writerow([log_time_ns, monotonic_ns, *(row.get(name, "") for name in self._fields)])


def _file_name(topic: str, *, taken: list[str]) -> str:
    """Of ROS names each is another one; of others' bags a second one gets a number."""
    name = "topic." + _NO_NAME.sub("_", topic.strip("/").replace("/", "."))
    numbers = (f".{number}" for number in range(2, len(taken) + 3))
    return next(path for suffix in ("", *numbers) if (path := f"{name}{suffix}.csv") not in taken)
