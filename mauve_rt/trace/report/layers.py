"""A layered drawing of a directed graph: layers from top to bottom, few crossings, straight-ish edges.

After Sugiyama, Tagawa, Toda, "Methods for visual understanding of hierarchical system structures" (1981):
turn edges of cycles round, assign layers by longest paths, put dummies where an edge passes a layer, order
each layer by the means of its neighbours, then move nodes towards these means without overlap.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import networkx as nx

_SWEEPS = 16
_GAP_X, _GAP_Y = 26.0, 46.0
_DUMMY_WIDTH = 14.0
_STRAIGHTNESS = (1.0, 2.0, 8.0)
"""How much an edge wants to be vertical: between two boxes, a box and a dummy, two dummies."""

Node = str
Point = tuple[float, float]


class Size(NamedTuple):
    """Of a node's box."""

    width: float
    height: float


class Placed(NamedTuple):
    """Where everything is: the middles of boxes, and of each edge the points that it passes."""

    size: Size
    middles: dict[Node, Point]
    routes: dict[tuple[Node, Node], list[Point]]


@dataclass
class _Layout:
    sizes: Mapping[Node, Size]
    layers: list[list[Node]] = field(default_factory=list)
    above: dict[Node, list[Node]] = field(default_factory=dict)
    below: dict[Node, list[Node]] = field(default_factory=dict)
    chains: dict[tuple[Node, Node], list[Node]] = field(default_factory=dict)
    x: dict[Node, float] = field(default_factory=dict)

    def width(self, node: Node) -> float:
        return self.sizes[node].width if node in self.sizes else _DUMMY_WIDTH


def place(
    sizes: Mapping[Node, Size], edges: Sequence[tuple[Node, Node]], *, hubs: Collection[Node] = ()
) -> Placed:
    """Place the nodes of a graph. Edges from a node to itself are left out.

    Long edges of one hub take the same way as far as they can.
    """
    layout = _Layout(sizes)
    graph: nx.DiGraph[Node] = nx.DiGraph()
    graph.add_nodes_from(sizes)
    graph.add_edges_from((a, b) for a, b in edges if a != b)
    turned = _turned(graph)
    down: nx.DiGraph[Node] = nx.DiGraph()
    down.add_nodes_from(sizes)
    down.add_edges_from((b, a) if (a, b) in turned else (a, b) for a, b in graph.edges)
    _fill(layout, down, _layer_of(down), hubs)
    _order(layout)
    _spread(layout)
    return _placed(layout, graph, turned)


def _turned(graph: "nx.DiGraph[Node]") -> set[tuple[Node, Node]]:
    """Edges that close a cycle in a depth-first walk."""
    state: dict[Node, int] = {}
    found: set[tuple[Node, Node]] = set()
    order = sorted(graph, key=lambda node: graph.in_degree(node) > 0)
    for root in order:
        stack = [(root, iter(list(graph.successors(root))))] if root not in state else []
        state.setdefault(root, 1)
        while stack:
            node, successors = stack[-1]
            following = next(successors, None)
            if following is None:
                state[node] = 2
                stack.pop()
            elif state.get(following) == 1:
                found.add((node, following))
            elif following not in state:
                state[following] = 1
                stack.append((following, iter(list(graph.successors(following)))))
    return found


def _layer_of(down: "nx.DiGraph[Node]") -> dict[Node, int]:
    layer: dict[Node, int] = {}
    for node in nx.topological_sort(down):
        layer[node] = max((layer[one] + 1 for one in down.predecessors(node)), default=0)
    for node in reversed(list(nx.topological_sort(down))):
        following = [layer[one] for one in down.successors(node)]
        if following and not down.in_degree(node):
            layer[node] = min(following) - 1
    return layer


def _fill(layout: _Layout, down: "nx.DiGraph[Node]", layer: dict[Node, int], hubs: Collection[Node]) -> None:
    layout.layers = [[] for _ in range(max(layer.values(), default=0) + 1)]
    for node in nx.dfs_preorder_nodes(down):
        layout.layers[layer[node]].append(node)
    for start, end in down.edges:
        chain = [start]
        for level in range(layer[start] + 1, layer[end]):
            way = (start, "") if start in hubs else ("", end) if end in hubs else (start, end)
            dummy = "\0".join(("", *way, str(level)))
            if dummy not in layout.above:
                layout.layers[level].append(dummy)
                layout.above[dummy] = []
            chain.append(dummy)
        chain.append(end)
        layout.chains[start, end] = chain
        for one, following in pairwise(chain):
            if following not in layout.below.setdefault(one, []):
                layout.below[one].append(following)
                layout.above.setdefault(following, []).append(one)


def _order(layout: _Layout) -> None:
    best, fewest = [list(one) for one in layout.layers], _crossings(layout)
    for sweep in range(_SWEEPS):
        neighbours = layout.below if sweep % 2 else layout.above
        levels = range(len(layout.layers))
        for level in reversed(levels) if sweep % 2 else levels:
            place = {node: i for layer in layout.layers for i, node in enumerate(layer)}
            current = {node: i for i, node in enumerate(layout.layers[level])}

            def mean(node: Node, place: dict[Node, int] = place, current: dict[Node, int] = current) -> float:
                around = [place[one] for one in neighbours.get(node, ())]  # noqa: B023
                return sum(around) / len(around) if around else current[node]

            layout.layers[level].sort(key=mean)
        found = _crossings(layout)
        if found < fewest:
            best, fewest = [list(one) for one in layout.layers], found
    layout.layers = best


def _crossings(layout: _Layout) -> int:
    count = 0
    for upper, lower in pairwise(layout.layers):
        place = {node: index for index, node in enumerate(lower)}
        ends = [end for node in upper for end in sorted(place[one] for one in layout.below.get(node, ()))]
        count += sum(later < earlier for index, earlier in enumerate(ends) for later in ends[index + 1 :])
    return count


def _spread(layout: _Layout) -> None:
    for layer in layout.layers:
        at = 0.0
        for node in layer:
            layout.x[node] = at + layout.width(node) / 2
            at += layout.width(node) + _GAP_X
    for sweep in range(_SWEEPS):
        levels = range(len(layout.layers))
        for level in reversed(levels) if sweep % 2 else levels:
            layer = layout.layers[level]
            wanted = [_wanted_x(layout, node) for node in layer]
            gaps = [
                (layout.width(one) + layout.width(following)) / 2 + _GAP_X
                for one, following in pairwise(layer)
            ]
            layout.x.update(
                zip(layer, _apart(wanted, [_pull(layout, node) for node in layer], gaps), strict=True)
            )


def _wanted_x(layout: _Layout, node: Node) -> float:
    """Mean of the neighbours' places, those counting more with which it is part of one long edge."""
    around = [(_weight(layout, node, one), layout.x[one]) for one in _neighbours(layout, node)]
    total = sum(weight for weight, _ in around)
    return sum(weight * x for weight, x in around) / total if around else layout.x[node]


def _pull(layout: _Layout, node: Node) -> float:
    return sum(_weight(layout, node, one) for one in _neighbours(layout, node)) or 1.0


def _neighbours(layout: _Layout, node: Node) -> list[Node]:
    return [*layout.above.get(node, ()), *layout.below.get(node, ())]


def _weight(layout: _Layout, one: Node, other: Node) -> float:
    return _STRAIGHTNESS[(one not in layout.sizes) + (other not in layout.sizes)]


def _apart(wanted: list[float], pulls: list[float], gaps: list[float]) -> list[float]:
    """Return the places nearest to the wanted ones that keep the gaps: pooling of adjacent violators."""
    offset = [0.0]
    for gap in gaps:
        offset.append(offset[-1] + gap)
    blocks: list[tuple[float, float, int]] = []  # of each: sum of weighted places, of weights, how many
    for value, weight, shift in zip(wanted, pulls, offset, strict=False):
        total, weights, count = weight * (value - shift), weight, 1
        while blocks and blocks[-1][0] / blocks[-1][1] > total / weights:
            before = blocks.pop()
            total, weights, count = total + before[0], weights + before[1], count + before[2]
        blocks.append((total, weights, count))
    pooled = [total / weights for total, weights, count in blocks for _ in range(count)]
    return [value + shift for value, shift in zip(pooled, offset, strict=False)]


def _placed(layout: _Layout, graph: "nx.DiGraph[Node]", turned: set[tuple[Node, Node]]) -> Placed:
    left = min((layout.x[node] - layout.width(node) / 2 for node in layout.x), default=0.0)
    right = max((layout.x[node] + layout.width(node) / 2 for node in layout.x), default=0.0)
    middles: dict[Node, Point] = {}
    top = 0.0
    for layer in layout.layers:
        height = max((layout.sizes[node].height for node in layer if node in layout.sizes), default=0.0)
        for node in layer:
            middles[node] = (layout.x[node] - left, top + height / 2)
        top += height + _GAP_Y
    routes = {}
    for start, end in graph.edges:
        chain = layout.chains[(end, start) if (start, end) in turned else (start, end)]
        points = [middles[node] for node in chain]
        routes[start, end] = points[::-1] if (start, end) in turned else points
    boxes = {node: middles[node] for node in layout.sizes}
    return Placed(Size(right - left, max(top - _GAP_Y, 0.0)), boxes, routes)
