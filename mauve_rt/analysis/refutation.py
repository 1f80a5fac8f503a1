"""Where a recording contradicts the bounds: the model lacks something, or a declared time is false."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from mauve_rt.analysis.bounds import Bound, Subject
from mauve_rt.analysis.machines import in_ms


@dataclass(frozen=True)
class Measured:
    """The longest times of a component in a recording."""

    response_ns: int
    wakeup_ns: int
    execution_ns: Mapping[str, int]
    """Of each state, preemption included."""
    faults: int


def contradictions(
    subjects: Sequence[Subject],
    bounds: Mapping[str, Bound],
    measured: Mapping[str, Measured],
    *,
    wakeup_ns: int,
) -> Iterator[str]:
    """What was longer than it can be by the model, with the term that was; `wakeup_ns` as for `bounds_of`."""
    for subject in subjects:
        bound, found = bounds.get(subject.name), measured.get(subject.name)
        if bound is None or bound.response_ns is None or found is None:
            continue
        if found.faults:
            yield f"{subject.name} faulted"
        elif found.response_ns > bound.response_ns:
            took = (
                f"{subject.name} took {in_ms(found.response_ns)}, and its bound is {in_ms(bound.response_ns)}"
            )
            yield f"{took}: {_term(bound, found, wakeup_ns)}"


def _term(bound: Bound, found: Measured, wakeup_ns: int) -> str:
    if found.wakeup_ns > wakeup_ns:
        return f"a wake-up took {in_ms(found.wakeup_ns)}, and {in_ms(wakeup_ns)} is declared"
    for state, wall_ns in bound.walls_ns.items():
        if found.execution_ns.get(state, 0) > wall_ns:
            took = in_ms(found.execution_ns[state])
            return f"{state} lasted {took}, and {in_ms(wall_ns)} is its bound with all that may delay it"
    return "between its states something took the CPU that is not in the model: a guard, or another thread"
