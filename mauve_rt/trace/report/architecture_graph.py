"""The architecture with its loads: components and resources as boxes, ports as arrows along the data."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import networkx as nx

from mauve_rt.trace.reading.architecture import ComponentInfo, PortInfo
from mauve_rt.trace.report import svg
from mauve_rt.trace.report.analysis import Analysis
from mauve_rt.trace.report.blocks import Section
from mauve_rt.trace.report.layers import Placed, Point, Size, place
from mauve_rt.trace.report.units import share_text, time_text

_COMPONENT = Size(186.0, 78.0)
_RESOURCE = Size(122.0, 30.0)
_MARGIN, _BETWEEN = 14.0, 40.0
_WIDEST = 1090.0
_HIGH_LOAD = 0.7


@dataclass(frozen=True)
class _Arrow:
    component: str
    port: PortInfo

    @property
    def ends(self) -> tuple[str, str]:
        """Node that gives the data, node that takes it."""
        reads = self.port.kind in ("read", "event") or self.port.service.startswith(("read", "get"))
        ends = (_component_node(self.component), _resource_node(self.port.resource))
        return (ends[1], ends[0]) if reads else ends


def architecture_section(analysis: Analysis) -> Section | None:
    """Return the section with the graph; None when there is no component at all."""
    if not analysis.trace.components:
        return None
    told = {info.name: info for info in analysis.trace.architecture}
    names = list(dict.fromkeys([*analysis.trace.components, *told]))
    arrows = [
        _Arrow(info.name, port)
        for info in told.values()
        for port in info.ports
        if port.resource and info.name in names
    ]
    note = "Loads are shares of the recorded time spent in execution states, preemption included. "
    if told:
        note += "Arrows point from who gives data to who takes it; hover over them for the port."
    else:
        note += "The bag does not tell how the components are connected."
    drawing = _drawing(analysis, names, told, arrows)
    return Section("Architecture", f'<div class="scroll">{drawing}</div>', note=note, anchor="architecture")


def _drawing(
    analysis: Analysis, names: list[str], told: dict[str, ComponentInfo], arrows: list[_Arrow]
) -> str:
    sizes: dict[str, Size] = {_component_node(name): _COMPONENT for name in names}
    sizes |= {_resource_node(arrow.port.resource): _RESOURCE for arrow in arrows}
    graph: nx.DiGraph[str] = nx.DiGraph()
    graph.add_nodes_from(sizes)
    graph.add_edges_from(arrow.ends for arrow in arrows)
    parts, width, height = [], 0.0, 0.0
    for dx, dy, placed in _arranged(graph, sizes):
        inside = [
            *_arrows(placed, [arrow for arrow in arrows if arrow.ends in placed.routes], sizes),
            *(
                _component_box(analysis, name, told.get(name), placed.middles[_component_node(name)])
                for name in names
                if _component_node(name) in placed.middles
            ),
            *(_resource_box(node, placed.middles[node], arrows) for node in placed.middles if node[0] == "r"),
        ]
        parts.append(f'<g transform="translate({svg.number(dx)} {svg.number(dy)})">{"".join(inside)}</g>')
        width = max(width, dx + placed.size.width + _MARGIN)
        height = max(height, dy + placed.size.height + _MARGIN)
    drawing = svg.svg(
        width, height, "".join(parts), css="architecture", described="the architecture as a graph"
    )
    return drawing.replace("<svg ", f'<svg style="width:{width:.0f}px" ', 1)


def _arranged(graph: "nx.DiGraph[str]", sizes: dict[str, Size]) -> Iterable[tuple[float, float, Placed]]:
    """Place the connected parts of the graph, the largest first, in rows."""
    found = sorted(nx.weakly_connected_components(graph), key=len, reverse=True)
    x, y, row_height = _MARGIN, _MARGIN, 0.0
    for nodes in found:
        edges = [edge for edge in graph.edges if edge[0] in nodes]
        hubs = {node for node in nodes if node.startswith("r:")}
        placed = place({node: sizes[node] for node in sizes if node in nodes}, edges, hubs=hubs)
        if x > _MARGIN and x + placed.size.width > _WIDEST:
            x, y, row_height = _MARGIN, y + row_height + _BETWEEN, 0.0
        yield x, y, placed
        x += placed.size.width + _BETWEEN
        row_height = max(row_height, placed.size.height)


def _arrows(placed: Placed, arrows: list[_Arrow], sizes: dict[str, Size]) -> Iterable[str]:
    by_ends: dict[tuple[str, str], list[_Arrow]] = {}
    for arrow in arrows:
        by_ends.setdefault(arrow.ends, []).append(arrow)
    for ends, several in by_ends.items():
        points = _clipped(placed.routes[ends], sizes[ends[0]], sizes[ends[1]])
        tips = [
            f"{one.component}.{one.port.name} ({one.port.kind}), {one.port.resource}.{one.port.service}"
            + (f", {one.port.type}" if one.port.type else "")
            for one in several
        ]
        commands = _curve(points)
        head = _head(points)
        parts = svg.path(commands, css="edge") + svg.path(commands, css="edge-hit") + head
        resource = several[0].port.resource.rpartition("/")[2]
        words = [one.port.name for one in several if one.port.name != resource]
        if words:
            middle = _middle(points, last=ends[1].startswith("c:"))
            text = svg.shortened(", ".join(words), 110, character=5.4)
            parts += svg.label(*middle, text, css="port", anchor="middle")
        yield svg.group(parts, css="arrow", tip="\n".join(tips))


def _clipped(points: list[Point], start: Size, end: Size) -> list[Point]:
    """Let an edge begin and end at the edges of its boxes rather than in their middles."""
    down = points[-1][1] >= points[0][1]
    sign = 1 if down else -1
    (x0, y0), (x1, y1) = points[0], points[-1]
    shift = 14.0 if not down else 0.0  # what goes up stands beside what comes down
    first = (x0 + _towards(points[1][0] - x0, start.width / 2 - 16) + shift, y0 + sign * start.height / 2)
    last = (x1 + _towards(points[-2][0] - x1, end.width / 2 - 16) + shift, y1 - sign * end.height / 2)
    return [first, *points[1:-1], last]


def _towards(distance: float, most: float) -> float:
    return max(-most, min(most, distance * 0.35))


def _curve(points: list[Point]) -> str:
    """Return a smooth path that leaves and enters every point vertically."""
    commands = f"M{svg.number(points[0][0])} {svg.number(points[0][1])}"
    for (x0, y0), (x1, y1) in pairwise(points):
        half = (y1 - y0) / 2
        numbers = (x0, y0 + half, x1, y1 - half, x1, y1)
        commands += "C" + " ".join(svg.number(value) for value in numbers)
    return commands


def _head(points: list[Point]) -> str:
    (_, before), (x, y) = points[-2], points[-1]
    back = -7 if y > before else 7
    return svg.path(
        f"M{svg.number(x)} {svg.number(y)}l-4 {back}h8z",
        css="head",
    )


def _middle(points: list[Point], *, last: bool) -> Point:
    """Middle of the part at the component, where no other edge takes the same way."""
    (x0, y0), (x1, y1) = points[-2:] if last else points[:2]
    return ((x0 + x1) / 2, (y0 + y1) / 2 + 3)


def _component_box(analysis: Analysis, name: str, info: ComponentInfo | None, middle: Point) -> str:
    width, height = _COMPONENT
    x, y = middle[0] - width / 2, middle[1] - height / 2
    found = analysis.statistics.get(name)
    load = found.load if found else 0.0
    core = info.core.rsplit("/", 1)[-1] if info else ""
    period_ns = info.period_ns if info else found.period_ns if found else 0
    facts = (
        [time_text(period_ns)] if period_ns else ["sporadic"] if _is_sporadic(analysis, name, info) else []
    )
    if info:
        facts.append(f"priority {info.priority}")
        facts += [f"CPU {' '.join(map(str, info.cpus))}"] if info.cpus else []
    inside = width - 24
    parts = [
        svg.rect(x, y, width, height, css="box", round_=9),
        svg.label(x + 12, y + 21, svg.shortened(name, inside, character=8), css="title"),
        svg.label(x + 12, y + 38, svg.shortened(core, inside), css="core"),
        svg.label(
            x + 12, y + 54, svg.shortened(" \N{MIDDLE DOT} ".join(facts), inside, character=5.6), css="facts"
        ),
        svg.rect(x + 12, y + 62, inside - 52, 6, css="load-back", round_=3),
        svg.rect(
            x + 12,
            y + 62,
            max(inside - 52, 0) * min(load, 1),
            6,
            css="load high" if load > _HIGH_LOAD else "load",
            round_=3,
        ),
        svg.label(x + width - 12, y + 69, share_text(load), css="facts", anchor="end"),
    ]
    tip = [name, f"load {share_text(load)}"]
    if info:
        tip += [
            f"shell {info.shell}",
            f"core {info.core}",
            f"fsm {info.fsm}",
            f"{info.policy} {info.priority}",
        ]
    return svg.group("".join(parts), css="component-box", tip="\n".join(tip))


def _is_sporadic(analysis: Analysis, name: str, info: ComponentInfo | None) -> bool:
    """Tell whether a component is triggered by events."""
    if name in analysis.statistics:
        return analysis.sporadic(name)
    return info is not None and info.period_ns == 0


def _resource_box(node: str, middle: Point, arrows: list[_Arrow]) -> str:
    width, height = _RESOURCE
    name = node[2:]
    users = [f"{one.component}.{one.port.name}" for one in arrows if one.port.resource == name]
    x, y = middle[0] - width / 2, middle[1] - height / 2
    shown = svg.shortened(name.rpartition("/")[2], width - 18, character=6.8)
    parts = svg.rect(x, y, width, height, css="resource", round_=height / 2)
    parts += svg.label(middle[0], middle[1] + 4.5, shown, css="resource-name", anchor="middle")
    return svg.group(parts, css="resource-box", tip="\n".join([f"resource {name}", *users]))


def _component_node(name: str) -> str:
    return f"c:{name}"


def _resource_node(name: str) -> str:
    return f"r:{name}"
