"""A drawing in the language of Mermaid, which GitHub and GitLab draw in Markdown."""

from collections.abc import Iterator, Mapping, Sequence

from mauve_rt.graph import look
from mauve_rt.graph.drawing import Drawing, Edge
from mauve_rt.graph.text import shown

_ARROWS = {"dashed": "-.->", "dotted": "-.->"}


def mermaid_text(drawing: Drawing) -> str:
    """Return the text of a .mmd file."""
    return "\n".join([*_lines(drawing), ""])


def _lines(drawing: Drawing) -> Iterator[str]:
    yield "flowchart TB"
    numbers = {node.key: f"n{index}" for index, node in enumerate(drawing.nodes)}
    yield from _nodes(drawing, numbers)
    for edge in drawing.edges:
        yield f"  {numbers[edge.start]} {_arrow(edge)} {numbers[edge.end]}"
    yield from _styles(drawing)


def _nodes(drawing: Drawing, numbers: Mapping[str, str]) -> Iterator[str]:
    for index, title in enumerate(dict.fromkeys(node.cluster for node in drawing.nodes)):
        indent = "  "
        if title:
            yield f"  subgraph c{index} [{_quoted([title])}]"
            indent = "    "
        for node in drawing.nodes:
            if node.cluster == title:
                opening, closing = look.NODE_LOOKS[node.kind].mermaid
                css = (*(one for one in node.classes if one in look.CLASS_COLOURS), node.kind)[0]
                yield f"{indent}{numbers[node.key]}{opening}{_quoted(node.lines)}{closing}:::{css}"
        if title:
            yield "  end"


def _styles(drawing: Drawing) -> Iterator[str]:
    for kind in dict.fromkeys(node.kind for node in drawing.nodes):
        yield f"  classDef {kind} {_colours(look.NODE_LOOKS[kind].stroke, look.NODE_LOOKS[kind].fill)}"
    for css, colour in look.CLASS_COLOURS.items():
        yield f"  classDef {css} {_colours(colour, 'panel')},stroke-width:2px"
    for index, edge in enumerate(drawing.edges):
        for colour in [look.CLASS_COLOURS[one] for one in edge.classes if one in look.CLASS_COLOURS][:1]:
            yield f"  linkStyle {index} stroke:{look.light(colour)}"


def _arrow(edge: Edge) -> str:
    arrow = _ARROWS.get(look.EDGE_STYLES.get(edge.kind, ""), "-->")
    return f"{arrow}|{_quoted(edge.lines)}|" if edge.lines else arrow


def _colours(stroke: str, fill: str) -> str:
    return f"fill:{look.light(fill)},stroke:{look.light(stroke)},color:{look.light('ink')}"


def _quoted(lines: Sequence[str]) -> str:
    """Each character that Mermaid, Markdown or HTML might take for its own is written by its number."""
    text = "<br/>".join(
        "".join(one if one.isalnum() or one in " .,:()/_-+=" else f"#{ord(one)};" for one in shown(line))
        for line in lines
    )
    return f'"{text or " "}"'
