"""Values over a run: each numeric field of the messages of topics that are not the trace's own.

A topic `.../values/NAME` holds the values of the resource NAME. They are called `NAME.FIELD`, as `pose.x`.
Values of other topics are called by the topic: `/beat.data`.
"""

import difflib
from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, silent
from mauve_rt.trace.reading.decisions import DECISION_TYPE
from mauve_rt.trace.reading.facts import OWN_TYPES
from mauve_rt.trace.reading.shadows import SHADOW_TYPE
from mauve_rt.trace.reading.value_tables import MOST_ELEMENTS, Floats, tables_of

if TYPE_CHECKING:
    import pandas as pd

    from mauve_rt.trace.reading.trace import Trace

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


def _samples(trace: "Trace", topics: list[str], progress: Progress) -> dict[Field, Samples]:
    names = names_of_numbers(trace, topics)
    most = {topic: max(MOST_ELEMENTS, len(names.get(topic, []))) for topic in topics}
    found: dict[Field, Samples] = {}
    for topic, table in tables_of(trace, most, progress).items():
        times, columns = table.columns()
        fields = table.fields
        given = names.get(topic, [])
        if len(given) == len(fields):
            fields = given
        found |= {
            Field(topic, name): Samples(times, column) for name, column in zip(fields, columns, strict=True)
        }
    return found
