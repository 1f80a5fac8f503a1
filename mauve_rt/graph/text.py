"""Texts of a drawing: names may hold any character, and take the room that any usual font needs."""

import unicodedata
from collections.abc import Sequence

from mauve_rt.graph.look import FONT_PX, NAME_PX

_EM_PER_CHARACTER = 0.62
"""Of a usual font without serifs; a wide character takes a whole em."""
_MOST_CHARACTERS = 34
LINE_PX = 16


def shown(text: str, most: int = _MOST_CHARACTERS) -> str:
    """Return one line without control characters, shortened to what a box holds."""
    line = " ".join(plain(text).split())
    return line if len(line) <= most else f"{line[: most - 1]}\N{HORIZONTAL ELLIPSIS}"


def width_px(text: str, size_px: float = FONT_PX) -> float:
    """Return the room that a text needs."""
    ems = sum(1.0 if unicodedata.east_asian_width(one) in "WF" else _EM_PER_CHARACTER for one in text)
    return ems * size_px


def block_px(lines: Sequence[str]) -> tuple[float, float]:
    """Return width and height of the lines of a node, the first of which is its name."""
    sizes = [NAME_PX, *[FONT_PX] * len(lines)]
    wide = max((width_px(line, size) for line, size in zip(lines, sizes, strict=False)), default=0.0)
    return wide, LINE_PX * len(lines)


def plain(text: str) -> str:
    """Return a text without control characters but ends of lines: SVG cannot hold them."""
    return "".join(" " if one != "\n" and unicodedata.category(one).startswith("C") else one for one in text)
