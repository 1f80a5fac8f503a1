"""Pieces of inline SVG. Colours are classes of static/report.css, so that they follow light and dark."""

from html import escape

from mauve_rt.trace.report.blocks import attribute


def svg(width: float, height: float, parts: str, *, css: str = "", described: str = "") -> str:
    """Return a drawing that scales with its place."""
    label = f' role="img" aria-label="{attribute(described)}"' if described else ""
    return f'<svg class="{css}" viewBox="0 0 {number(width)} {number(height)}"{label}>{parts}</svg>'


def rect(
    x: float, y: float, width: float, height: float, *, css: str = "", tip: str = "", round_: float = 0
) -> str:
    """Return a rectangle."""
    corner = f' rx="{number(round_)}"' if round_ else ""
    return (
        f'<rect x="{number(x)}" y="{number(y)}" width="{number(max(width, 0))}" '
        f'height="{number(max(height, 0))}"{corner} class="{css}"{_tip(tip)}/>'
    )


def line(x1: float, y1: float, x2: float, y2: float, *, css: str = "") -> str:
    """Return a straight line."""
    return f'<line x1="{number(x1)}" y1="{number(y1)}" x2="{number(x2)}" y2="{number(y2)}" class="{css}"/>'


def path(commands: str, *, css: str = "", tip: str = "", more: str = "") -> str:
    """Return a path."""
    return f'<path d="{commands}" class="{css}"{_tip(tip)}{more}/>'


def circle(x: float, y: float, radius: float, *, css: str = "", tip: str = "") -> str:
    """Return a disc."""
    return f'<circle cx="{number(x)}" cy="{number(y)}" r="{number(radius)}" class="{css}"{_tip(tip)}/>'


def label(x: float, y: float, text: str, *, css: str = "", anchor: str = "start", tip: str = "") -> str:
    """Return a line of text; `anchor` is start, middle or end."""
    return (
        f'<text x="{number(x)}" y="{number(y)}" text-anchor="{anchor}" class="{css}"{_tip(tip)}>'
        f"{escape(text)}</text>"
    )


def group(parts: str, *, css: str = "", tip: str = "") -> str:
    """Return parts as one."""
    return f'<g class="{css}"{_tip(tip)}>{parts}</g>'


def number(value: float) -> str:
    """Return a coordinate, as short as it may be."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def shortened(text: str, width: float, *, character: float = 6.6) -> str:
    """Return a text cut to a width, where a character is so wide on average."""
    most = max(3, int(width / character))
    return text if len(text) <= most else text[: most - 1] + "\N{HORIZONTAL ELLIPSIS}"


def _tip(text: str) -> str:
    return f' data-tip="{attribute(text)}"' if text else ""
