"""A drawing in the language of Graphviz. Each text has a place of a fixed size, whatever fonts there are."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from mauve_rt.graph import look
from mauve_rt.graph.drawing import Drawing, Edge, Node
from mauve_rt.graph.text import LINE_PX, block_px, shown, width_px

_PX_PER_INCH = 72  # one unit of the SVG that Graphviz writes is one pixel
_MARGIN_PX = 10
_CIRCLE_ROOM = 1.2  # of the diameter, for the corners of the text in it
_POINT_PX = 10


def dot_text(
    drawing: Drawing, graph: Mapping[str, str] | None = None, *, clusters: bool = True, spread: int = 1
) -> str:
    """Return the text of a .dot file.

    Args:
        drawing: the drawing.
        graph: attributes of the whole graph, such as rankdir.
        clusters: draw frames; otherwise each component has the title of its frame as a line.
        spread: let arrows reach over 1, 2 ... up to so many ranks in turn.
    """
    numbers = {node.key: f"n{index}" for index, node in enumerate(drawing.nodes)}
    settings = {
        "fontname": look.FONT,
        "fontsize": str(look.FONT_PX),
        "fontcolor": look.light("muted"),
        "bgcolor": "transparent",
        **(graph or {}),
    }
    lines = [
        f"digraph {quoted(shown(drawing.title))} {{",
        f"  graph [{_attributes(settings)}]",
        f"  node [{_attributes(_text('ink'))}]",
        f"  edge [{_attributes({**_text('ink'), 'arrowsize': '0.7'})}]",
    ]
    nodes = drawing.nodes if clusters else [*map(_without_frame, drawing.nodes)]
    for index, title in enumerate(dict.fromkeys(node.cluster for node in nodes)):
        inside = [
            f"{numbers[node.key]} [{_attributes({'id': numbers[node.key], **_node(node)})}]"
            for node in nodes
            if node.cluster == title
        ]
        if title:
            frame = {
                "label": shown(title),
                "labeljust": "l",
                "style": "rounded",
                "color": look.light("line-strong"),
            }
            inside.insert(0, f"graph [{_attributes(frame)}]")
            lines += [f"  subgraph cluster_{index} {{", *(f"    {line}" for line in inside), "  }"]
        else:
            lines += [f"  {line}" for line in inside]
    ends = {(edge.start, edge.end) for edge in drawing.edges}
    for index, edge in enumerate(drawing.edges):
        reach = {"minlen": str(1 + index % spread)} if spread > 1 else {}
        if (edge.end, edge.start) in ends and edge.start > edge.end:
            reach |= {"tailport": "e", "headport": "e"}  # else it lies on the arrow of the other direction
        values = _attributes({"id": f"e{index}", **_edge(edge), **reach})
        lines.append(f"  {numbers[edge.start]} -> {numbers[edge.end]} [{values}]")
    return "\n".join([*lines, "}", ""])


def quoted(text: str) -> str:
    """Return a text as Graphviz takes it literally: in quotes, with no escape of its own."""
    return '"{}"'.format(text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n"))


def _without_frame(node: Node) -> Node:
    """A component says by itself where it runs."""
    lines = (*node.lines, node.cluster) if node.cluster and node.kind == "component" else node.lines
    return replace(node, cluster="", lines=lines)


def _attributes(values: Mapping[str, str]) -> str:
    return ", ".join(
        f"{name}={value if value.startswith('<<') else quoted(value)}" for name, value in values.items()
    )


def _text(colour: str) -> dict[str, str]:
    return {"fontname": look.FONT, "fontsize": str(look.FONT_PX), "fontcolor": look.light(colour)}


def _node(node: Node) -> dict[str, str]:
    kind = look.NODE_LOOKS[node.kind]
    lines = [*map(shown, node.lines)]
    wide, high = block_px(lines)
    if kind.shape == "circle":
        wide = high = _CIRCLE_ROOM * (wide**2 + high**2) ** 0.5
    elif kind.shape == "ellipse":
        wide, high = wide * _CIRCLE_ROOM, high * 1.5
    size = (_POINT_PX, _POINT_PX) if kind.shape == "point" else (wide + 2 * _MARGIN_PX, high + _MARGIN_PX)
    outline = [look.CLASS_COLOURS[one] for one in node.classes if one in look.CLASS_COLOURS]
    return {
        "label": "\n".join(lines),
        "class": " ".join((node.kind, *node.classes)),
        "shape": kind.shape,
        "style": kind.style,
        "fixedsize": "true",
        "width": f"{size[0] / _PX_PER_INCH:.3f}",
        "height": f"{size[1] / _PX_PER_INCH:.3f}",
        "fillcolor": look.light(kind.fill),
        "color": look.light((outline or [kind.stroke])[0]),
        "penwidth": "2" if outline else "1",
    }


def _edge(edge: Edge) -> dict[str, str]:
    outline = [look.CLASS_COLOURS[one] for one in edge.classes if one in look.CLASS_COLOURS]
    found = {
        "class": " ".join((edge.kind, *edge.classes)),
        "color": look.light((outline or [look.EDGE_COLOURS[edge.kind]])[0]),
    }
    if style := look.EDGE_STYLES.get(edge.kind):
        found["style"] = style
    return {**found, "label": _label([*map(shown, edge.lines)])} if edge.lines else found


def _label(lines: Sequence[str]) -> str:
    """The label of an edge: cells of a fixed size, whose text begins at their left."""
    return (
        f'<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="0" CELLPADDING="0">{"".join(_rows(lines))}</TABLE>>'
    )


def _rows(lines: Sequence[str]) -> Iterator[str]:
    wide = max(map(width_px, lines))
    for line in lines:
        size = f'FIXEDSIZE="TRUE" WIDTH="{wide + 8:.0f}" HEIGHT="{LINE_PX}" ALIGN="LEFT"'
        yield f"<TR><TD {size}>{_entities(line) or ' '}</TD></TR>"


def _entities(line: str) -> str:
    """Graphviz takes some characters for its own also where HTML does not, as a bracket before a tag."""
    return "".join(one if one.isalnum() or one in " _" else f"&#{ord(one)};" for one in line)
