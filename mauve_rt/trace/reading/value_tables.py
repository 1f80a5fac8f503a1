"""The numbers of recorded messages, a table for each topic: a row for each message, a column for each field.

Messages are read as columns of bytes where they have one layout, the others one by one.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.format.message_decoding import Decoder
from mauve_rt.trace.format.message_layout import TIME_FIELDS, Layout
from mauve_rt.trace.progress import Progress

if TYPE_CHECKING:
    from mauve_rt.trace.reading.messages import Payloads, PayloadSource
    from mauve_rt.trace.reading.trace import Trace

Floats = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

MOST_ELEMENTS = 16
"""Of an array whose elements are values; a longer one, as a laser scan, is left out."""
_FEWEST_TOGETHER = 8  # fewer messages of one size are read one by one
_MOST_LAYOUTS = 4  # of messages of one size
_Getter = Callable[[Any], Any]


class Table:
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


def tables_of(trace: "Trace", most: Mapping[str, int], progress: Progress) -> dict[str, Table]:
    """Return a table for each topic with messages; `most`: elements of an array that are values, by topic."""
    if trace.payload_source is not None:
        total = sum(trace.topics[topic][1] for topic in most)
        return _tables_of_bytes(trace.payload_source, most, total, progress)
    tables: dict[str, Table] = {}
    for one in trace.messages(*most):
        if one.topic in most:
            if one.topic not in tables:
                tables[one.topic] = Table(one.msg, most[one.topic])
            tables[one.topic].add(one.log_time_ns, one.monotonic_ns, one.msg)
    return tables


def _tables_of_bytes(
    source: "PayloadSource", most: Mapping[str, int], total: int, progress: Progress
) -> dict[str, Table]:
    """As tables_of(). The earliest message tells the columns: where it comes late, all is read again."""
    firsts: dict[str, tuple[int, Any]] = {}
    while True:
        tables: dict[str, Table] = {}
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
                tables[topic] = Table(firsts[topic][1], most[topic])
            elif firsts[topic][0] == log_time_ns:
                is_whole &= Table(firsts[topic][1], most[topic]).fields == tables[topic].fields
            tables[topic].extend(block)
            done += len(block.data)
            progress(min(done / total, 1.0), "reading values")
        if is_whole:
            return tables


def numbers_of(message: Any, most_elements: int = MOST_ELEMENTS) -> dict[str, float]:
    """Each number of a message by its path, as a table has them: no time stamps, no longer arrays."""
    return {
        name: _number(get, message) for name, get in _numbers("", message, lambda msg: msg, most_elements)
    }


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
