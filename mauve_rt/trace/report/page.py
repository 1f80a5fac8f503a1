"""The page: one HTML document that needs nothing but itself."""

from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from mauve_rt.graph.look import colours_css, graph_css
from mauve_rt.trace.report.blocks import Section, attribute

STYLES = ("report.css", "figures.css", "timeline.css")
SCRIPTS = (
    "base.js", "columns.js", "tracks.js", "axis.js", "decisions.js", "draw.js", "timeline.js", "input.js",
    "hover.js", "values.js", "jumps.js", "page.js",
)  # fmt: skip
"""In this order: each uses what those before it define."""
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
"""The browser itself sees to it that nothing is loaded from elsewhere."""


def page(
    title: str, outcome: str, parts: Iterable[str], *, sections: Sequence[Section] = (), data: str = ""
) -> str:
    """Return the document.

    Args:
        title: of the window.
        outcome: HTML that stands before everything else, the navigation included.
        parts: HTML.
        sections: those that the navigation names.
        data: script elements with data.
    """
    links = "".join(
        f'<a href="#{attribute(one.anchor)}">{escape(one.heading)}</a>' for one in sections if one.anchor
    )
    style = "\n".join([colours_css(), *map(_static, STYLES), graph_css()])
    script = "\n".join(_static(name) for name in SCRIPTS)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{attribute(_POLICY)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}\n</style></head>\n<body>\n"
        f"<header>{outcome}</header>\n"
        f'<nav><div>{links}<button type="button" id="theme" title="light or dark">'
        '<span aria-hidden="true"></span>Theme</button></div></nav>\n'
        f'<main>\n{chr(10).join(parts)}\n</main>\n<div id="tip" role="status" hidden></div>\n'
        f"{data}\n<script>\n{script}\n</script>\n</body></html>\n"
    )


def data_element(identity: str, kind: str, text: str) -> str:
    """Return an element that holds data for the script; `text` must not be able to close it."""
    return f'<script type="{kind}" id="{identity}">{text}</script>'


def write_page(path: Path, html: str) -> None:
    """Write the page in one go: a reader sees the old one or the new one.

    Raises:
        OSError: it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.new")
    temporary.write_text(html, encoding="utf-8")
    temporary.replace(path)


def _static(name: str) -> str:
    return (files("mauve_rt.trace.report") / "static" / name).read_text(encoding="utf-8").strip()
