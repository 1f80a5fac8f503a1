"""Log lines of components, as their executor recorded them on /rosout."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

LOG_TYPE = "rcl_interfaces/msg/Log"
WARN = 30
"""The level of a warning; more urgent ones have more."""


class LogLine(NamedTuple):
    """A rcl_interfaces/msg/Log of a component."""

    component: str
    """As the trace names it."""
    time_ns: int
    level: int
    text: str


def log_lines(messages: Iterable[Any], components: Sequence[str]) -> list[LogLine]:
    """Of messages of that type, by time. A merged trace names its components <bag>/<component>."""
    return sorted(_of_messages(messages, components), key=lambda one: one.time_ns)


def _of_messages(messages: Iterable[Any], components: Sequence[str]) -> Iterator[LogLine]:
    for one in messages:
        node, _, name = str(one.msg.name).rpartition(".")
        for component in components:
            owner, _, part = component.rpartition("/")
            if part == name and (not owner or f".{owner}." in f".{node}."):
                yield LogLine(component, one.monotonic_ns, int(one.msg.level), str(one.msg.msg))
