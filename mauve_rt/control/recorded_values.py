"""Every write to chosen resources, as messages for a bag. Knows nothing of ROS."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from mauve_rt._kernel import ValueLog, message_name
from mauve_rt.control.runtime import Runtime
from mauve_rt.control.values import Values, definition_of
from mauve_rt.errors import MauveError
from mauve_rt.trace.bag.recorded import SentMessage


class RecordedValue(NamedTuple):
    """A resource whose writes are recorded."""

    resource: str
    topic: str
    type_name: str
    definition: str


class RecordedValues:
    """A source of messages for a recorder, on one topic for each resource. All but `choose` for one thread.

    A write is kept in a ring of the resource's own, so that its writer never waits; where the ring is
    full, the write is lost and counted.
    """

    def __init__(self, runtime: Runtime, values: Sequence[RecordedValue]) -> None:
        """`values`: as `choose` found them."""
        self._runtime = runtime
        self._values = values
        self._logs: list[tuple[RecordedValue, ValueLog]] = []

    def keep_messages(self, *, on: bool) -> None:
        """Keep every write from now on until take_messages(), or none any more."""
        if on:
            architecture = self._runtime.architecture
            self._logs = [(value, ValueLog(architecture, value.resource)) for value in self._values]
            return
        for _, log in self._logs:
            log.end()

    def take_messages(self) -> Sequence[SentMessage]:
        """What was written since the last call."""
        return [
            SentMessage(value.topic, value.type_name, data, time_ns, None, value.definition)
            for value, log in self._logs
            for data, time_ns in log.take()
        ]

    def dropped_messages(self) -> int:
        """Writes that found no room."""
        return sum(log.lost for _, log in self._logs)


def choose(runtime: Runtime, names: Iterable[str], node_name: str) -> list[RecordedValue]:
    """The resources of these names, or of the ports COMPONENT.PORT, each once; `node_name`: the executor's.

    Raises:
        MauveError: one has no value, or nobody knows its type.
    """
    values = Values(runtime)
    chosen: dict[str, RecordedValue] = {}
    for name in names:
        try:
            resource = values.find(name).resource
            definition = definition_of(resource)
        except MauveError as error:
            raise MauveError(f"value to record: {error}") from error
        topic = f"{node_name}/values/{resource.name}"
        type_name = message_name(resource.type)
        chosen[resource.name] = RecordedValue(resource.name, topic, type_name, definition)
    return [*chosen.values()]
