"""A drawing as SVG, laid out by Graphviz: one unit is one pixel, and colours follow the reader's theme."""

import shutil
import subprocess
from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree as ET

from mauve_rt.graph.dot import dot_text
from mauve_rt.graph.drawing import Drawing, Edge, Node
from mauve_rt.graph.look import file_css
from mauve_rt.graph.text import plain, shown, width_px

WIDEST_PX = 1400
INSTALL = "apt-get install graphviz"
_TIMEOUT_S = 120  # for one layout; one of 30 components takes 0.1 s
_SVG = "http://www.w3.org/2000/svg"


class GraphError(Exception):
    """A drawing cannot be laid out. str() is one line: what is wrong, and the remedy."""


class Layout(NamedTuple):
    """One way to let Graphviz place the nodes."""

    graph: Mapping[str, str]
    clusters: bool = True
    spread: int = 1
    """Over how many ranks arrows of equal nodes reach."""


_DOWN, _RIGHT = ({"rankdir": direction, "ranksep": "0.35", "pad": "0.15"} for direction in ("TB", "LR"))
_ROOMY, _DENSE, _ALL_RANKS = {"nodesep": "0.2"}, {"nodesep": "0.1"}, {"newrank": "true"}
_LAYOUTS = (
    Layout({**_DOWN, **_ROOMY, **_ALL_RANKS}),
    Layout({**_DOWN, **_DENSE, **_ALL_RANKS}),
    Layout({**_RIGHT, **_DENSE, **_ALL_RANKS}),
    Layout({**_DOWN, **_ROOMY}, clusters=False),
    Layout({**_DOWN, **_DENSE}, clusters=False),
    Layout({**_DOWN, **_DENSE}, clusters=False, spread=3),
    Layout({**_DOWN, **_DENSE, **_ALL_RANKS}, clusters=False, spread=2),
)
"""Tried in this order until a drawing is narrow enough: by measure, few are needed."""


def svg_text(drawing: Drawing, *, widest_px: int = WIDEST_PX) -> str:
    """Return an SVG file.

    Raises:
        GraphError: Graphviz is not installed, or fails.
    """
    root = _laid_out(drawing, widest_px, "title")
    root.set("xmlns", _SVG)
    style = ET.Element("style")
    style.text = file_css()
    root.insert(0, style)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def svg_element(drawing: Drawing, *, widest_px: int = WIDEST_PX, tip: str = "data-tip") -> str:
    """Return an SVG element for a page with the style sheets of `look`; `tip`: attribute, or `title`.

    Raises:
        GraphError: Graphviz is not installed, or fails.
    """
    return ET.tostring(_laid_out(drawing, widest_px, tip), encoding="unicode")


def _laid_out(drawing: Drawing, widest_px: int, tip: str) -> ET.Element:
    """The first layout that is narrow enough; else the narrowest one."""
    found: list[ET.Element] = []
    for layout in _LAYOUTS:
        text = dot_text(drawing, layout.graph, clusters=layout.clusters, spread=layout.spread)
        root = ET.fromstring(_run("dot", text))  # noqa: S314 - Graphviz wrote it from our text
        found.append(root)
        if _width(root) <= widest_px:
            break
    root = min(found, key=_width)
    width, height = root.get("viewBox", "0 0 0 0").split()[2:]
    for element in root.iter():
        element.tag = element.tag.removeprefix(f"{{{_SVG}}}")
    root.attrib = {
        "class": "mauve-graph",
        "width": width,
        "height": height,
        "style": f"width:{width}px;height:{height}px",
        "viewBox": root.get("viewBox", ""),
        "role": "img",
        "aria-label": shown(drawing.title),
    }
    _finish(root, drawing, tip)
    return root


def _width(root: ET.Element) -> float:
    return float(root.get("viewBox", "0 0 0 0").split()[2])


def _finish(root: ET.Element, drawing: Drawing, tip: str) -> None:
    """Give nodes and edges their tips, and place the labels of edges by their middles."""
    parts: dict[str, Node | Edge] = {f"n{index}": node for index, node in enumerate(drawing.nodes)}
    parts |= {f"e{index}": edge for index, edge in enumerate(drawing.edges)}
    for group in root.iter("g"):
        part = parts.get(group.attrib.pop("id", ""))
        title = group.find("title")
        if title is not None:
            group.remove(title)
        if part is None:
            continue
        if tip == "title":
            title = ET.Element("title")
            title.text = plain(part.tip)
            group.insert(0, title)
        elif part.tip:
            group.set(tip, plain(part.tip))
        if isinstance(part, Edge):
            wide = max(map(width_px, map(shown, part.lines)), default=0.0)
            for text in group.iter("text"):
                text.set("x", f"{float(text.get('x', '0')) + wide / 2:.2f}")
                text.set("text-anchor", "middle")


def _run(program: str, text: str) -> str:
    if shutil.which(program) is None:
        raise GraphError(f"`{program}` of Graphviz is not installed. Install it: {INSTALL}")
    try:
        done = subprocess.run(
            [program, "-Tsvg"], input=text, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        raise GraphError(
            f"`{program}` of Graphviz gave no layout within {_TIMEOUT_S} s. Draw a smaller part."
        ) from None
    if done.returncode or not done.stdout:
        lines = done.stderr.strip().splitlines() or ["no reason given"]
        raise GraphError(f"`{program}` of Graphviz failed: {lines[-1]}. Reinstall it: {INSTALL}")
    return done.stdout
