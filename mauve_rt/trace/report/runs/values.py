"""Values of messages in two runs: each numeric field of each topic that both bags have."""

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.reading.decisions import DECISION_TYPE
from mauve_rt.trace.reading.facts import OWN_TYPES
from mauve_rt.trace.reading.trace import Trace
from mauve_rt.trace.report.runs.events import EVENT_TYPE
from mauve_rt.trace.report.runs.noise import Floats, block_count, moment_changes
from mauve_rt.trace.report.runs.timing import TOO_SHORT, Figure

MOST_FIELDS = 200
MOST_ELEMENTS = 16
"""Of an array whose elements are compared one by one; a longer one, as a laser scan, is left out."""
_NO_VALUES = (*OWN_TYPES, EVENT_TYPE, DECISION_TYPE, "mauve_msgs/msg/ArchitectureState")
_TIME = ("sec", "nanosec")
_Getter = Callable[[Any], Any]


class Field(NamedTuple):
    """Where a value comes from."""

    topic: str
    name: str
    """As `pose.position.x`, `ranges[3]`."""


class Samples(NamedTuple):
    """A value over a run."""

    monotonic_ns: npt.NDArray[np.int64]
    values: Floats
    """NaN where a message has no finite value."""

    @property
    def finite(self) -> Floats:
        """The values that are numbers."""
        return self.values[np.isfinite(self.values)]

    @property
    def nan_share(self) -> float:
        """Share of values that are not finite, 0 to 1."""
        return 1 - len(self.finite) / len(self.values) if len(self.values) else 0.0


@dataclass(frozen=True)
class ComparedField:
    """A field in both runs."""

    field: Field
    a: Samples
    b: Samples
    mean: Figure
    rms: Figure
    largest_difference: float | None = None
    """Of samples at equal instants of simulated time; None in real time."""

    @property
    def differs(self) -> bool:
        """Return whether B differs by more than the noise; in simulated time, whether any sample differs."""
        return self.mean.differs or self.rms.differs or bool(self.largest_difference)


@dataclass(frozen=True)
class Values:
    """The fields that both runs have, and what was left out."""

    fields: list[ComparedField]
    only_a: list[str]
    """Topics."""
    only_b: list[str]
    left_out: list[str]
    """Sentences."""


def compared_values(a: Trace, b: Trace, *, simulated: bool) -> Values:
    """Read and compare the values of both runs; `simulated`: both are of simulated time."""
    topics = [
        [topic for topic, (kind, count) in trace.topics.items() if count and kind not in _NO_VALUES]
        for trace in (a, b)
    ]
    shared = [topic for topic in topics[0] if topic in topics[1]]
    left_out: list[str] = []
    runs = [_read(trace, shared, left_out) for trace in (a, b)]
    fields = [field for field in runs[0] if field in runs[1]]
    if len(fields) > MOST_FIELDS:
        topics_out = {field.topic for field in fields[MOST_FIELDS:]}
        text = f"{len(fields) - MOST_FIELDS:,} more fields are left out (of {', '.join(sorted(topics_out))})."
        left_out.append(text)
    return Values(
        [_compare(field, runs[0][field], runs[1][field], simulated) for field in fields[:MOST_FIELDS]],
        [topic for topic in topics[0] if topic not in topics[1]],
        [topic for topic in topics[1] if topic not in topics[0]],
        list(dict.fromkeys(left_out)),
    )


def _compare(field: Field, a: Samples, b: Samples, simulated: bool) -> ComparedField:  # noqa: FBT001
    blocks = tuple(block_count(len(one.finite), int(np.ptp(one.monotonic_ns))) for one in (a, b))
    changes = moment_changes(a.finite, b.finite, (blocks[0], blocks[1])) if all(blocks) else (None, None)
    remark = "" if all(blocks) else TOO_SHORT
    means, rms = (
        [float(of(one.finite)) if len(one.finite) else np.nan for one in (a, b)] for of in (np.mean, _rms)
    )
    subject = f"{field.topic} {field.name}"
    return ComparedField(
        field,
        a,
        b,
        Figure(subject, "value", "mean", means[0], means[1], change=changes[0], remark=remark),
        Figure(subject, "value", "rms", rms[0], rms[1], change=changes[1], remark=remark),
        _largest_difference(a, b) if simulated else None,
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _largest_difference(a: Samples, b: Samples) -> float | None:
    _, at_a, at_b = np.intersect1d(a.monotonic_ns, b.monotonic_ns, return_indices=True)
    apart = np.abs(a.values[at_a] - b.values[at_b])
    apart = apart[np.isfinite(apart)]
    return float(apart.max()) if len(apart) else None


def _read(trace: Trace, topics: list[str], left_out: list[str]) -> dict[Field, Samples]:
    """Samples of all fields; a topic with a message that cannot be read is left out, and reported."""
    if not topics:
        return {}
    try:
        return _samples(trace, topics)
    except TraceError:
        found: dict[Field, Samples] = {}
        for topic in topics:
            try:
                found |= _samples(trace, [topic])
            except TraceError as error:
                left_out.append(f"{topic} is left out: {error}")
        return found


def _samples(trace: Trace, topics: list[str]) -> dict[Field, Samples]:
    wanted = set(topics)
    getters: dict[str, list[tuple[str, _Getter]]] = {}
    times: dict[str, list[int]] = {topic: [] for topic in topics}
    rows: dict[str, list[list[float]]] = {topic: [] for topic in topics}
    for message in trace.messages(*topics):
        topic = message.topic
        if topic not in wanted:
            continue
        if topic not in getters:
            getters[topic] = list(_numbers("", message.msg, lambda msg: msg))
        times[topic].append(message.monotonic_ns)
        rows[topic].append([_number(get, message.msg) for _, get in getters[topic]])
    found: dict[Field, Samples] = {}
    for topic, named in getters.items():
        columns = np.array(rows[topic], np.float64).reshape(len(rows[topic]), len(named))
        columns[~np.isfinite(columns)] = np.nan
        monotonic_ns = np.array(times[topic], np.int64)
        for index, (name, _) in enumerate(named):
            found[Field(topic, name)] = Samples(monotonic_ns, columns[:, index])
    return found


def _number(get: _Getter, message: Any) -> float:
    try:
        return float(get(message))
    except (IndexError, TypeError, OverflowError):  # a sequence that is shorter than in the first message
        return float("nan")


def _numbers(name: str, value: Any, get: _Getter) -> Iterator[tuple[str, _Getter]]:
    """The numeric fields of a message and how to read them; no time stamps, which always differ."""
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]
        if tuple(names) == _TIME:
            return
        for one in names:
            yield from _numbers(f"{name}.{one}" if name else one, getattr(value, one), _attribute(get, one))
    elif isinstance(value, np.ndarray | list | tuple):
        yield from _elements(name, value, get)
    elif isinstance(value, bool | int | float | np.number | np.bool_):
        yield name, get


def _elements(name: str, values: Iterable[Any], get: _Getter) -> Iterator[tuple[str, _Getter]]:
    elements = list(values)
    if len(elements) <= MOST_ELEMENTS:
        for index, element in enumerate(elements):
            yield from _numbers(f"{name}[{index}]", element, _item(get, index))


def _attribute(get: _Getter, name: str) -> _Getter:
    return lambda message: getattr(get(message), name)


def _item(get: _Getter, index: int) -> _Getter:
    return lambda message: get(message)[index]
