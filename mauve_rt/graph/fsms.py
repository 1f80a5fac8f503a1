"""The drawing of an fsm as Fig. 4 of the paper has it: circles are states, arrows have the guards."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest
from typing import Any

from mauve_rt.counts import duration
from mauve_rt.graph.drawing import Drawing, Edge, Node

_FOREVER_NS = 2**63 - 1
_START = "start"


def fsm_drawing(title: str, states: Iterable[Any]) -> Drawing:
    """Return the drawing of states: DescribedState, or StateInfo messages, which lack guards and actions."""
    found = list(states)
    nodes = [_state(one) for one in found]
    edges = [edge for one in found for edge in _transitions(one)]
    initial = [_key(one.name) for one in found if one.is_initial]
    if initial:
        nodes.insert(0, Node(key=_START, kind="start"))
        edges.insert(0, Edge(start=_START, end=initial[0], kind="transition", tip="initial state"))
    return Drawing(title=title, nodes=tuple(nodes), edges=tuple(edges))


def _key(name: str) -> str:
    return f"state {name}"


def _state(told: Any) -> Node:
    lines = [told.name, *(_wait(told) if told.is_wait else [getattr(told, "action", "")])]
    if not told.is_wait and told.wcet_ns:
        lines.append(f"wcet {duration(told.wcet_ns)}")
    return Node(
        key=_key(told.name), kind="wait" if told.is_wait else "execution", lines=tuple(filter(None, lines))
    )


def _wait(told: Any) -> Iterator[str]:
    """Its time, as it is written and in ns; of a wait for an event the port and the limits."""
    if told.is_event_wait:
        yield f"event {getattr(told, 'event_port', '')}"
        yield f"at most every {duration(told.min_interarrival_ns)}"
    if told.duration_ns != _FOREVER_NS:
        yield getattr(told, "duration_text", "")
        yield f"{'timeout ' if told.is_event_wait else ''}{duration(told.duration_ns)}"
    elif not told.is_event_wait:
        yield "forever"


def _transitions(told: Any) -> Iterator[Edge]:
    guards: Sequence[str] = getattr(told, "guards", ())
    for number, (to, guard) in enumerate(zip_longest(told.successors, guards, fillvalue=""), start=1):
        text = guard or ("else" if guards else "")
        tip = f"{told.name} to {to}" + (f", guard {number} of {len(guards)}: {guard}" if guard else "")
        yield Edge(
            start=_key(told.name), end=_key(to), kind="transition", lines=(text,) if text else (), tip=tip
        )
