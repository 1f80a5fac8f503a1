"""A drawing as one HTML page that needs nothing but itself."""

from html import escape

from mauve_rt.graph.drawing import Drawing
from mauve_rt.graph.look import CLASS_COLOURS, file_css
from mauve_rt.graph.svg import svg_element
from mauve_rt.graph.text import plain

_POLICY = "default-src 'none'; style-src 'unsafe-inline'"
_STYLE = """body { margin: 24px; color: var(--ink); font: 15px/1.5 system-ui, Arial, sans-serif; }
h1 { font-size: 1.3rem; } .key span { margin-right: 1.5em; } .scroll { overflow-x: auto; }"""


def page_text(drawing: Drawing) -> str:
    """Return an HTML page with the drawing.

    Raises:
        GraphError: Graphviz is not installed, or fails.
    """
    title = escape(plain(drawing.title))
    classes = [*(node.classes for node in drawing.nodes), *(edge.classes for edge in drawing.edges)]
    present = {css for each in classes for css in each}
    key = "".join(
        f'<span style="color: var(--{colour})">{css}</span>'
        for css, colour in CLASS_COLOURS.items()
        if css in present
    )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{escape(_POLICY)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{title}</title>\n<style>\n{file_css()}\n{_STYLE}\n</style></head>\n<body>\n"
        f'<h1>{title}</h1>\n<p class="key">{key}</p>\n'
        f'<div class="scroll">{svg_element(drawing, tip="title")}</div>\n</body></html>\n'
    )
