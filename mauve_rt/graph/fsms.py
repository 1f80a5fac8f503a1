"""The drawing of an fsm as Fig. 4 of the paper has it: circles are states, arrows have the guards."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import zip_longest
from typing import Any

from mauve_rt.analysis.machines import FOREVER_NS
from mauve_rt.counts import duration
from mauve_rt.graph.drawing import Drawing, Edge, Node

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


def _state(described: Any) -> Node:
    lines = [described.name, *(_wait(described) if described.is_wait else [getattr(described, "action", "")])]
    if not described.is_wait and described.wcet_ns:
        lines.append(f"wcet {duration(described.wcet_ns)}")
    return Node(
        key=_key(described.name),
        kind="wait" if described.is_wait else "execution",
        lines=tuple(filter(None, lines)),
    )


def _wait(described: Any) -> Iterator[str]:
    """Its time, as it is written and in ns; of a wait for an event the port and the limits."""
    if described.is_event_wait:
        yield f"event {getattr(described, 'event_port', '')}"
        yield f"at most every {duration(described.min_interarrival_ns)}"
    if described.duration_ns != FOREVER_NS:
        yield getattr(described, "duration_text", "")
        yield f"{'timeout ' if described.is_event_wait else ''}{duration(described.duration_ns)}"
    elif not described.is_event_wait:
        yield "forever"


def _transitions(described: Any) -> Iterator[Edge]:
    guards: Sequence[str] = getattr(described, "guards", ())
    for number, (to, guard) in enumerate(zip_longest(described.successors, guards, fillvalue=""), start=1):
        text = guard or ("else" if guards else "")
        tip = f"{described.name} to {to}" + (f", guard {number} of {len(guards)}: {guard}" if guard else "")
        yield Edge(
            start=_key(described.name),
            end=_key(to),
            kind="transition",
            lines=(text,) if text else (),
            tip=tip,
        )
