"""The one description of a drawing: nodes in clusters, edges, and the classes by which a writer colours them.

`components`, `fsms` and their kin make it, `dot`, `mermaid`, `svg` and `page` write it.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from typing import Literal, TypeVar

NodeKind = Literal["component", "resource", "rule", "start", "execution", "wait", "shell", "core", "fsm"]
EdgeKind = Literal["data", "rule", "transition", "use"]
ADDED, REMOVED, CHANGED, HIGH = "added", "removed", "changed", "high"
"""Classes of nodes and edges: differences of two drawings, and a high load."""
NOTHING = "\N{EN DASH}"


@dataclass(frozen=True, kw_only=True)
class Node:
    """A box or a circle with some lines of text; the first one is its name."""

    key: str
    kind: NodeKind
    lines: tuple[str, ...] = ()
    cluster: str = ""
    """Title of the frame around it; empty: none."""
    classes: tuple[str, ...] = ()
    tip: str = ""
    details: Mapping[str, str] = field(default_factory=dict)
    """Facts by name that are written where two drawings differ in them."""


@dataclass(frozen=True, kw_only=True)
class Edge:
    """An arrow from one node to another one, by their keys."""

    start: str
    end: str
    kind: EdgeKind
    lines: tuple[str, ...] = ()
    """Of its label."""
    classes: tuple[str, ...] = ()
    tip: str = ""


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """A graph as it is drawn. Each end of an edge is a node."""

    title: str
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]

    def with_more(self, nodes: Iterable[Node], edges: Iterable[Edge]) -> "Drawing":
        """Return the drawing with further nodes and edges."""
        return replace(self, nodes=(*self.nodes, *nodes), edges=(*self.edges, *edges))


_Part = TypeVar("_Part", Node, Edge)
_Key = TypeVar("_Key")


def merged(edges: Iterable[Edge]) -> tuple[Edge, ...]:
    """Return the edges with one in the place of several that join the same nodes and look the same."""
    found: dict[tuple[str, str, str, tuple[str, ...]], list[Edge]] = {}
    for edge in edges:
        found.setdefault((edge.start, edge.end, edge.kind, edge.classes), []).append(edge)
    return tuple(
        replace(
            several[0],
            lines=tuple(dict.fromkeys(line for one in several for line in one.lines)),
            tip="\n".join(dict.fromkeys(one.tip for one in several if one.tip)),
        )
        for several in found.values()
    )


def compared(before: Drawing, after: Drawing) -> Drawing:
    """Return one drawing of two, in which each node and edge has the class of its difference."""
    old_nodes, new_nodes = ({node.key: node for node in each.nodes} for each in (before, after))
    old_edges, new_edges = (
        {(edge.start, edge.end, edge.kind): edge for edge in each.edges} for each in (before, after)
    )
    return replace(
        after,
        nodes=tuple(_compared(old_nodes, new_nodes)),
        edges=tuple(_compared(old_edges, new_edges)),
    )


def _compared(before: Mapping[_Key, _Part], after: Mapping[_Key, _Part]) -> Iterator[_Part]:
    for key, part in after.items():
        old = before.get(key)
        yield _with_class(part, ADDED) if old is None else _changed(old, part)
    for key, part in before.items():
        if key not in after:
            yield _with_class(part, REMOVED)


def _with_class(part: _Part, css: str) -> _Part:
    return replace(part, classes=(*part.classes, css))


def _changed(old: _Part, new: _Part) -> _Part:
    """What is after the change, with each line of before that is another one."""
    if isinstance(old, Node) and isinstance(new, Node):
        new = replace(new, cluster=new.cluster or old.cluster)
        if (old.lines, old.details) == (new.lines, new.details):
            return new
    elif old.lines == new.lines:
        return new
    lines = [
        is_after if is_before == is_after else f"{is_before} \N{RIGHTWARDS ARROW} {is_after}"
        for is_before, is_after in zip_longest(old.lines, new.lines, fillvalue=NOTHING)
    ]
    if isinstance(old, Node) and isinstance(new, Node):
        lines += [
            f"{name} {old.details.get(name, NOTHING)} \N{RIGHTWARDS ARROW} {value}"
            for name, value in new.details.items()
            if old.details.get(name) != value
        ]
    return _with_class(replace(new, lines=tuple(lines)), CHANGED)
