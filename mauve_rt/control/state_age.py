"""How long components' present states last, in words; hung ones noticed once each.

A part is a `ComponentDescription` or a message with these of its fields: ComponentInfo.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from mauve_rt._kernel import ComponentDescription


def in_words(part: Any) -> str:
    """`state Act has lasted 2.5 s (period 0.01 s, declared bound 0.005 s, hung from 1 s on)`."""
    against = [f"period {_seconds(part.period_ns)}"] if part.period_ns else []
    against += [f"declared bound {_seconds(part.state_bound_ns)}"] if part.state_bound_ns else []
    against += [f"hung from {_seconds(part.hung_after_ns)} on"]
    age = _seconds(part.state_age_ns)
    what = f"wait {part.current_state} is {age} past its instant"
    if not part.waiting:
        what = f"state {part.current_state} has lasted {age}"
    return f"{what} ({', '.join(against)})"


def _seconds(nanoseconds: int) -> str:
    return f"{nanoseconds / 1e9:.4g} s"


class Turn(NamedTuple):
    """A component that is hung since the last look, or is no longer."""

    part: "ComponentDescription"
    hung: bool

    @property
    def message(self) -> str:
        """What became of it."""
        if self.hung:
            return f"component '{self.part.name}' is hung: {in_words(self.part)}"
        return (
            f"component '{self.part.name}' is no longer hung: {self.part.state}, in {self.part.current_state}"
        )


class HangWatch:
    """Compares the components with what they were."""

    def __init__(self) -> None:
        self._hung: set[str] = set()

    def look(self, parts: Sequence["ComponentDescription"]) -> Iterator[Turn]:
        """Yield those that are hung since the last look, and those that are no longer."""
        before, self._hung = self._hung, {part.name for part in parts if part.hung}
        for part in parts:
            if part.hung != (part.name in before):
                yield Turn(part, part.hung)
