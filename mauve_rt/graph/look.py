"""The look of each kind of node and edge: a shape, and colours by their names in `colours.css`.

Graphviz takes the light colours as attributes. In a browser the style sheet decides, in light and in dark.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from mauve_rt.graph.drawing import ADDED, CHANGED, HIGH, REMOVED, EdgeKind, NodeKind

FONT = "Helvetica, Arial, sans-serif"
FONT_PX = 12
NAME_PX = 13
"""Of the first line of a node; the browser's style sheet alone sets it apart."""


@dataclass(frozen=True)
class NodeLook:
    """Of one kind of node."""

    shape: str
    style: str
    fill: str
    stroke: str
    mermaid: tuple[str, str]
    """Brackets around its label."""


NODE_LOOKS: Mapping[NodeKind, NodeLook] = {
    "component": NodeLook("box", "rounded,filled", "panel", "muted", ("(", ")")),
    "resource": NodeLook("box", "rounded,filled", "faint", "line-strong", ("([", "])")),
    "rule": NodeLook("octagon", "filled,dashed", "panel", "swap", ("{{", "}}")),
    "start": NodeLook("point", "filled", "ink", "ink", ("((", "))")),
    "execution": NodeLook("circle", "filled", "panel", "accent", ("((", "))")),
    "wait": NodeLook("circle", "filled,dashed", "faint", "muted", ("((", "))")),
    "shell": NodeLook("box", "filled", "panel", "accent", ("[", "]")),
    "core": NodeLook("box", "rounded,filled", "panel", "muted", ("(", ")")),
    "fsm": NodeLook("ellipse", "filled", "faint", "muted", ("([", "])")),
}
EDGE_COLOURS: Mapping[EdgeKind, str] = {"data": "muted", "rule": "swap", "transition": "ink", "use": "muted"}
EDGE_STYLES: Mapping[EdgeKind, str] = {"rule": "dashed", "use": "dotted"}
CLASS_COLOURS: Mapping[str, str] = {ADDED: "good", REMOVED: "bad", CHANGED: "attention", HIGH: "attention"}
"""Of the outline of a node, and of an edge, instead of that of its kind."""


@cache
def colours() -> Mapping[str, tuple[str, str]]:
    """The light and the dark colour of each name."""
    pairs = re.findall(r"--([\w-]+): light-dark\((#\w+), (#\w+)\);", colours_css())
    return {name: (light, dark) for name, light, dark in pairs}


@cache
def colours_css() -> str:
    """The style sheet that gives the names their colours by `light-dark()`."""
    return (files("mauve_rt.graph") / "colours.css").read_text(encoding="utf-8").strip()


def light(name: str) -> str:
    """The light colour of a name."""
    return colours()[name][0]


def graph_css() -> str:
    """The style sheet of a drawing that stands in a page with `colours_css()`."""
    rules = [
        "svg.mauve-graph { display: block; max-width: none; }",
        ".mauve-graph text { fill: var(--ink); }",
        ".mauve-graph .node text ~ text, .mauve-graph .cluster text { fill: var(--muted); }",
        f".mauve-graph .node text:first-of-type {{ font-size: {NAME_PX}px; font-weight: 640; }}",
        f"{_shapes('.cluster')} {{ fill: none; stroke: var(--line-strong); }}",
        ".mauve-graph .edge text { paint-order: stroke; stroke: var(--panel); stroke-width: 3px; }",
    ]
    for kind, look in NODE_LOOKS.items():
        rules.append(
            f"{_shapes(f'.node.{kind}')} {{ fill: var(--{look.fill}); stroke: var(--{look.stroke}); }}"
        )
    for edge_kind, colour in EDGE_COLOURS.items():
        rules += _edge_rules(f".edge.{edge_kind}", colour)
    for css, colour in CLASS_COLOURS.items():
        rules.append(f"{_shapes(f'.node.{css}')} {{ stroke: var(--{colour}); stroke-width: 2.4px; }}")
        rules += _edge_rules(f".edge.{css}", colour)
    rules += [
        f".mauve-graph .{REMOVED} text {{ text-decoration: line-through; }}",
        f"{_shapes('.node:hover')} {{ stroke: var(--accent); stroke-width: 2px; }}",
        *_edge_rules(".edge:hover", "accent"),
    ]
    return "\n".join(rules)


def file_css() -> str:
    """The style sheet within an SVG file: the colours of the reader's theme, without `light-dark()`."""
    both = ["".join(f" --{name}: {pair[index]};" for name, pair in colours().items()) for index in range(2)]
    return (
        f":root {{{both[0]} background: var(--page); }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root {{{both[1]} }} }}\n{graph_css()}"
    )


def _shapes(of: str) -> str:
    return ", ".join(f".mauve-graph {of} > {shape}" for shape in ("path", "polygon", "ellipse", "polyline"))


def _edge_rules(of: str, colour: str) -> list[str]:
    return [
        f".mauve-graph {of} > path {{ stroke: var(--{colour}); }}",
        f".mauve-graph {of} > polygon {{ fill: var(--{colour}); stroke: var(--{colour}); }}",
    ]
