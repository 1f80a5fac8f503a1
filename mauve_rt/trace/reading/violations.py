"""Jobs above their bound, as the executor found them while the bag was recorded."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

VIOLATION_TYPE = "mauve_msgs/msg/BoundViolation"


class Violation(NamedTuple):
    """A mauve_msgs/msg/BoundViolation: the worst job, and how many there were."""

    component: str
    """As the trace names it."""
    instant_ns: int
    response_ns: int
    bound_ns: int
    jobs: int
    message: str

    @property
    def end_ns(self) -> int:
        """When the job came to its wait."""
        return self.instant_ns + self.response_ns

    @property
    def excess_ns(self) -> int:
        """By how much it was above its bound."""
        return self.response_ns - self.bound_ns


def violations(messages: Iterable[Any], components: Sequence[str]) -> list[Violation]:
    """Of messages of that type, by time. A merged trace names its components <bag>/<component>."""
    return sorted(_of_messages(messages, components), key=lambda one: one.end_ns)


def _of_messages(messages: Iterable[Any], components: Sequence[str]) -> Iterator[Violation]:
    for one in messages:
        told = one.msg
        for component in components:
            owner, _, name = component.rpartition("/")
            if name == told.component and (not owner or f"/{owner}/" in one.topic):
                yield Violation(
                    component,
                    instant_ns=int(told.instant_ns),
                    response_ns=int(told.response_ns),
                    bound_ns=int(told.bound_ns),
                    jobs=int(told.count),
                    message=str(told.message),
                )
