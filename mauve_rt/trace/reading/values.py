"""Values over a run: each numeric field of the messages of topics that are not the trace's own.

A topic `.../values/NAME` holds the values of the resource NAME. They are called `NAME.FIELD`, as `pose.x`.
Values of other topics are called by the topic: `/beat.data`.
"""

import dataclasses
import difflib
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.message_decoding import Decoder
from mauve_rt.trace.format.message_layout import TIME_FIELDS, Layout
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.decisions import DECISION_TYPE
from mauve_rt.trace.reading.facts import OWN_TYPES
from mauve_rt.trace.reading.shadows import SHADOW_TYPE

if TYPE_CHECKING:
    import pandas as pd

    from mauve_rt.trace.reading.messages import Payloads, PayloadSource
    from mauve_rt.trace.reading.trace import Trace

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

MOST_ELEMENTS = 16
"""Of an array whose elements are values; a longer one, as a laser scan, is left out."""
VALUES_TYPE, NAMES_TYPE = "mauve_msgs/msg/Values", "mauve_msgs/msg/ValueNames"
NO_VALUES = (
    *OWN_TYPES,
    DECISION_TYPE,
    SHADOW_TYPE,
    NAMES_TYPE,
    "mauve_msgs/msg/ReconfigurationEvent",
    "mauve_msgs/msg/ArchitectureState",
    "diagnostic_msgs/msg/DiagnosticArray",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/ParameterEvent",
)
"""Types of messages that report on the executor and its computer."""
_RESOURCES = "/values/"
_FEWEST_TOGETHER = 8  # fewer messages of one size are read one by one
_MOST_LAYOUTS = 4  # of messages of one size
_Getter = Callable[[Any], Any]


class Field(NamedTuple):
    """Where a value comes from."""

    topic: str
    name: str
    """As `pose.position.x`, `ranges[3]`."""

    @property
    def of_resource(self) -> bool:
        """Whether the executor recorded the writes to a resource on this topic."""
        return bool(resource_of(self.topic))


class Samples(NamedTuple):
    """A value over a run."""

    monotonic_ns: npt.NDArray[np.int64]
    """CLOCK_MONOTONIC, as in the records; never decreases."""
    values: Floats
    """NaN where a message lacks the field."""

    @property
    def finite(self) -> Floats:
        """The values that are finite numbers."""
        return self.values[np.isfinite(self.values)]

    def without_gaps(self) -> "Samples":
        """Return the samples whose values are finite numbers."""
        finite = np.isfinite(self.values)
        return self if finite.all() else Samples(self.monotonic_ns[finite], self.values[finite])

    @property
    def nan_share(self) -> float:
        """Share of values that are not finite, 0 to 1."""
        return 1 - len(self.finite) / len(self.values) if len(self.values) else 0.0


class TraceValues:
    """The values of a trace by their names; each topic is read once, when one of its values is asked for."""

    def __init__(self, trace: "Trace") -> None:
        """Read nothing yet."""
        self._trace = trace
        self._topics = _spoken(value_topics(trace))
        self._read: dict[str, dict[Field, Samples]] = {}
        self._problems: list[str] = []

    def __getitem__(self, name: str) -> "pd.Series[float]":
        """One value, as `pose.x`: float64 over int64 ns of CLOCK_MONOTONIC, the clock of `Trace.frames`.

        Raises:
            TraceError: the trace has no such value; the message names the nearest one.

        """
        import pandas as pd  # noqa: PLC0415 - takes its time to load

        near = [topic for spoken, topic in self._topics.items() if name.startswith(f"{spoken}.")]
        found = self._samples(near) or {}
        field = next((one for one in found if self.name(one) == name), None)
        if field is None:
            raise TraceError(self._unknown(name))
        index = pd.Index(found[field].monotonic_ns, name="monotonic_ns")
        return pd.Series(found[field].values, index, name=name)

    def __iter__(self) -> Iterator[str]:
        """The names of all values."""
        return iter(self.names)

    def __len__(self) -> int:
        """How many values there are."""
        return len(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all values, those of recorded resources first. Reads all topics."""
        return tuple(self.name(field) for field in self.samples)

    @property
    def samples(self) -> dict[Field, Samples]:
        """All values, those of recorded resources first. Reads all topics."""
        return self.read()

    @cached_property
    def finite_samples(self) -> dict[Field, Samples]:
        """As `samples`, without what is not a finite number."""
        return {field: samples.without_gaps() for field, samples in self.samples.items()}

    def read(self, *, progress: Progress = silent) -> dict[Field, Samples]:
        """Return `samples`; `progress` is called while topics are read."""
        found = self._samples(self._topics.values(), progress)
        return dict(sorted(found.items(), key=lambda item: not item[0].of_resource))

    @property
    def problems(self) -> tuple[str, ...]:
        """Sentences: which of the topics read so far are left out, and why."""
        return tuple(self._problems)

    def name(self, field: Field) -> str:
        """What a field is called here: `pose.x` of `/executor/values/pose`, `/beat.data` of `/beat`."""
        spoken = next((one for one, topic in self._topics.items() if topic == field.topic), field.topic)
        return f"{spoken}.{field.name}"

    def _samples(self, topics: Iterable[str], progress: Progress = silent) -> dict[Field, Samples]:
        wanted = list(topics)
        new = [topic for topic in wanted if topic not in self._read]
        self._read |= {topic: {} for topic in new}
        for field, samples in read_samples(self._trace, new, self._problems, progress).items():
            self._read[field.topic][field] = samples
        return {field: samples for topic in wanted for field, samples in self._read[topic].items()}

    def _unknown(self, name: str) -> str:
        nearest = difflib.get_close_matches(name, self.names, 1, 0)
        if not nearest:
            return f"value '{name}': the bag has no values. Bind a resource to a topic and record again."
        return f"value '{name}': not in the bag, which has {len(self):,}; the nearest is '{nearest[0]}'."


def value_topics(trace: "Trace") -> list[str]:
    """Topics with values."""
    return [topic for topic, (kind, count) in trace.topics.items() if count and kind not in NO_VALUES]


def resource_of(topic: str) -> str:
    """The resource whose writes a topic holds; empty for another topic."""
    return topic.partition(_RESOURCES)[2]


def names_of_numbers(trace: "Trace", topics: Iterable[str]) -> dict[str, list[str]]:
    """For each of these topics whose messages are mauve_msgs/msg/Values: the names of the numbers in them."""
    suffix = "/names"
    wanted = {f"{topic}{suffix}" for topic in topics if trace.topics[topic][0] == VALUES_TYPE}
    present = wanted & {*trace.topics}
    messages = trace.messages(*present) if present else ()
    return {one.topic.removesuffix(suffix): list(one.msg.names) for one in messages if one.topic in present}


def read_samples(
    trace: "Trace", topics: list[str], left_out: list[str], progress: Progress = silent
) -> dict[Field, Samples]:
    """Read all fields of these topics; `left_out` gets a sentence for each topic that is unreadable."""
    if not topics:
        return {}
    try:
        return _samples(trace, topics, progress)
    except TraceError:
        found: dict[Field, Samples] = {}
        for topic in topics:
            try:
                found |= _samples(trace, [topic], progress)
            except TraceError as error:
                left_out.append(f"{topic} is left out: {error}")
        return found


def _spoken(topics: list[str]) -> dict[str, str]:
    """Topics by what they are called: a resource by its name, unless two executors have one of that name."""
    resources = [resource_of(topic) for topic in topics]
    return {
        resource if resource and resources.count(resource) == 1 else topic: topic
        for topic, resource in zip(topics, resources, strict=True)
    }


class _Table:
    """The messages of one topic: times, and a row of numbers each."""

    def __init__(self, first: Any, most_elements: int) -> None:
        """Have a column for each number of the first message."""
        self.named = list(_numbers("", first, lambda msg: msg, most_elements))
        self._most_elements = most_elements
        self._parts: list[tuple[Times, Times, Floats]] = []
        self._layouts: dict[tuple[Decoder, int], list[Layout | None]] = {}

    @property
    def fields(self) -> list[str]:
        """The names of the columns."""
        return [name for name, _ in self.named]

    def add(self, log_time_ns: int, monotonic_ns: int, message: Any) -> None:
        """Add one message."""
        logged, time_ns = np.array([log_time_ns], np.int64), np.array([monotonic_ns], np.int64)
        self._parts.append((logged, time_ns, np.array([self._row(message)], np.float64)))

    def extend(self, block: "Payloads") -> None:
        """Add messages, each as `add` would: those of one layout together, the others one by one.

        Raises:
            TraceError: one cannot be read.

        """
        rows = np.full((len(block.data), len(self.named)), np.nan)
        sizes = block.data.sizes
        left = [self._fill(rows, block, np.flatnonzero(sizes == size)) for size in np.unique(sizes)]
        for index in np.sort(np.concatenate(left)).tolist():
            rows[index] = self._row(block.decoded(index))
        self._parts.append((block.log_time_ns, block.monotonic_ns, rows))

    def columns(self) -> tuple[Times, Floats]:
        """Times, (n,), and numbers, (fields, n), by time."""
        logged, times, numbers = (np.concatenate(parts) for parts in zip(*self._parts, strict=True))
        order = np.lexsort((logged, times))
        return times[order], np.ascontiguousarray(numbers[order].T)

    def _row(self, message: Any) -> list[float]:
        return [_number(get, message) for _, get in self.named]

    def _fill(self, rows: Floats, block: "Payloads", at: Times) -> Times:
        """Fill the rows of messages of one size; returns those that are left."""
        if len(at) < _FEWEST_TOGETHER:
            return at
        size = int(block.data.sizes[at[0]])
        layouts = self._layouts.setdefault((block.decoder, size), [])
        messages = block.data.together(at)
        odd = []
        for number in range(_MOST_LAYOUTS):
            if len(at) < _FEWEST_TOGETHER:
                break
            if number == len(layouts):
                layouts.append(self._layout(block, int(at[0])))
            layout = layouts[number]
            same = np.zeros(len(at), np.bool_) if layout is None else layout.matches(messages)
            if layout is not None and same.any():
                alike, places = (messages, at) if same.all() else (messages[same], at[same])
                for index, (name, _) in enumerate(self.named):
                    column = layout.column(name, alike)
                    if column is not None:
                        rows[places, index] = column
            elif number == len(layouts) - 1:  # made of the first message, and even that one does not fit
                odd.append(at[:1])
                same[0] = True
            at, messages = at[~same], messages[~same]
        return np.concatenate([*odd, at])

    def _layout(self, block: "Payloads", index: int) -> Layout | None:
        """The layout of a message, where it tells the same numbers as the message itself."""
        layout = block.decoder.layout(block.data.one(index), most_elements=self._most_elements)
        if layout is None:
            return None
        try:
            expected = self._row(block.decoded(index))
        except TraceError:
            return None
        message = block.data.together(np.array([index]))
        columns = [layout.column(name, message) for name in self.fields]
        found = [np.nan if column is None else float(column[0]) for column in columns]
        return layout if np.array_equal(expected, found, equal_nan=True) else None


def _samples(trace: "Trace", topics: list[str], progress: Progress) -> dict[Field, Samples]:
    names = names_of_numbers(trace, topics)
    most = {topic: max(MOST_ELEMENTS, len(names.get(topic, []))) for topic in topics}
    found: dict[Field, Samples] = {}
    for topic, table in _tables(trace, most, progress).items():
        times, columns = table.columns()
        fields = table.fields
        given = names.get(topic, [])
        if len(given) == len(fields):
            fields = given
        found |= {
            Field(topic, name): Samples(times, column) for name, column in zip(fields, columns, strict=True)
        }
    return found


def _tables(trace: "Trace", most: Mapping[str, int], progress: Progress) -> dict[str, _Table]:
    """Return a table for each topic with messages; `most`: elements of an array that are values, by topic."""
    if trace.payload_source is not None:
        total = sum(trace.topics[topic][1] for topic in most)
        return _tables_of_bytes(trace.payload_source, most, total, progress)
    tables: dict[str, _Table] = {}
    for one in trace.messages(*most):
        if one.topic in most:
            if one.topic not in tables:
                tables[one.topic] = _Table(one.msg, most[one.topic])
            tables[one.topic].add(one.log_time_ns, one.monotonic_ns, one.msg)
    return tables


def _tables_of_bytes(
    source: "PayloadSource", most: Mapping[str, int], total: int, progress: Progress
) -> dict[str, _Table]:
    """As _tables(). The earliest message tells the columns: where it comes late, all is read again."""
    firsts: dict[str, tuple[int, Any]] = {}
    while True:
        tables: dict[str, _Table] = {}
        is_whole = True
        done = 0
        for block in source(tuple(most)):
            topic = block.topic
            if topic not in most:
                continue
            at = int(np.argmin(block.log_time_ns))
            log_time_ns = int(block.log_time_ns[at])
            if topic not in firsts or log_time_ns < firsts[topic][0]:
                firsts[topic] = (log_time_ns, block.decoded(at))
            if topic not in tables:
                tables[topic] = _Table(firsts[topic][1], most[topic])
            elif firsts[topic][0] == log_time_ns:
                is_whole &= _Table(firsts[topic][1], most[topic]).fields == tables[topic].fields
            tables[topic].extend(block)
            done += len(block.data)
            progress(min(done / total, 1.0), "reading values")
        if is_whole:
            return tables


def _number(get: _Getter, message: Any) -> float:
    try:
        return float(get(message))
    except (IndexError, TypeError, OverflowError):  # a sequence that is shorter than in the first message
        return float("nan")


def _numbers(name: str, value: Any, get: _Getter, most_elements: int) -> Iterator[tuple[str, _Getter]]:
    """The numeric fields of a message and how to read them; no time stamps, no longer arrays."""
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value)]
        if tuple(names) == TIME_FIELDS:
            return
        for one in names:
            path = f"{name}.{one}" if name else one
            yield from _numbers(path, getattr(value, one), _attribute(get, one), most_elements)
    elif isinstance(value, np.ndarray | list | tuple):
        for index, element in enumerate(value if len(value) <= most_elements else ()):
            yield from _numbers(f"{name}[{index}]", element, _item(get, index), most_elements)
    elif isinstance(value, bool | int | float | np.number | np.bool_):
        yield name, get


def _attribute(get: _Getter, name: str) -> _Getter:
    return lambda message: getattr(get(message), name)


def _item(get: _Getter, index: int) -> _Getter:
    return lambda message: get(message)[index]
