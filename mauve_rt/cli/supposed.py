"""`--suppose COMPONENT.STATE=TIME` of `mauve analyze`: the model with another execution time."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

from mauve_rt.analysis.machines import FOREVER_NS, ExecutionTime, Machine, State
from mauve_rt.errors import MauveError

_SUPPOSED = re.compile(
    r"(?P<component>[^.=]+)\.(?P<state>[^.=]+)=(?P<time>\d+(?:\.\d+)?)(?P<unit>ns|us|ms|s)"
)
_Found = TypeVar("_Found", Machine, State)
_UNITS_NS = {"ns": 1, "us": 1_000, "ms": 1_000_000, "s": 1_000_000_000}


def with_supposed(machines: Iterable[Machine], words: Sequence[str]) -> list[Machine]:
    """The machines, with the time of each named state replaced.

    Raises:
        MauveError: a word is not of that form, or names no execution state.
    """
    found = {machine.name: machine for machine in machines}
    for word in words:
        match = _SUPPOSED.fullmatch(word)
        time_ns = round(float(match["time"]) * _UNITS_NS[match["unit"]]) if match else 0
        if match is None or not 1 <= time_ns < FOREVER_NS:
            raise MauveError(f"--suppose: expected COMPONENT.STATE=TIME as guidance.Plan=5ms, found {word}")
        machine = _named(found, match["component"], f"--suppose {word}: no such component")
        states = {state.name: state for state in machine.states if not state.is_wait}
        state = _named(states, match["state"], f"--suppose {word}: no such execution state")
        supposed = replace(state, time=ExecutionTime(time_ns, "supposed"))
        states_then = tuple(supposed if one is state else one for one in machine.states)
        found[machine.name] = replace(machine, states=states_then)
    return [*found.values()]


def _named(known: dict[str, _Found], name: str, problem: str) -> _Found:
    if name not in known:
        raise MauveError(f"{problem}; expected one of {', '.join(known)}, found {name}")
    return known[name]
