"""What pages are made of: sections, cards, tables, lists. Texts are escaped here, and only `html` is not."""

import base64
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import NamedTuple

from mauve_rt.trace.report.units import digits

_KEPT_TOGETHER = ("wake-up", "wake\N{NON-BREAKING HYPHEN}up")
_BEFORE_A_UNIT = re.compile(
    r"(?<=\d) (?=(?:[num\N{MICRO SIGN}]?s|min|h|k?Hz|[kMG]?B|%|\N{MULTIPLICATION SIGN})(?!\w))"
)
_FILLERS = '<i aria-hidden="true"></i>' * 7
"""In the last row of cards: without height, so that its cards are as wide as those above."""
_WORDY = 26  # characters from which a column of words may break
_WORDS = ' class="words"'


@dataclass(frozen=True)
class Section:
    """A part of a page with a heading."""

    heading: str
    html: str
    note: str = ""
    """A remark in small print below the heading."""
    anchor: str = ""
    """Its id, for links within the page."""
    wide: bool = False
    """Takes the whole width of the window."""

    def render(self) -> str:
        """Return its HTML."""
        identity = f' id="{attribute(self.anchor)}"' if self.anchor else ""
        css = ' class="wide"' if self.wide else ""
        remark = f'<p class="note">{prose(self.note)}</p>' if self.note else ""
        return f"<section{identity}{css}><h2>{escape(self.heading)}</h2>{remark}{self.html}</section>"


class Card(NamedTuple):
    """One figure, large."""

    value: str
    meaning: str
    level: str = ""
    """good, attention, bad, or empty"""


class Cell(NamedTuple):
    """A cell of a table that is more than its text."""

    text: str
    level: str = ""
    tip: str = ""
    html: str = ""
    """Instead of the text."""
    number: bool = True


def attribute(text: str) -> str:
    """Return a text as the value of an attribute in double quotes."""
    return escape(text, quote=True)


def prose(text: str) -> str:
    """Return a text as HTML in which no line ends between a number and its unit."""
    return escape(_BEFORE_A_UNIT.sub("\N{NARROW NO-BREAK SPACE}", text))


def _label(text: str) -> str:
    """Return a text for where there is little room as HTML."""
    return prose(text.replace(*_KEPT_TOGETHER))


def cards(figures: Iterable[Card]) -> str:
    """Return key figures side by side."""
    inside = "".join(
        f'<div class="card {one.level}"><b>{prose(one.value)}</b><span>{_label(one.meaning)}</span></div>'
        for one in figures
    )
    return f'<div class="cards">{inside}{_FILLERS}</div>'


def bullets(lines: Iterable[str], *, css: str = "") -> str:
    """Return a list of texts."""
    items = "".join(f"<li>{prose(line)}</li>" for line in lines)
    return f'<ul class="{css}">{items}</ul>'


def paragraph(text: str, *, css: str = "") -> str:
    """Return a paragraph of text."""
    return f'<p class="{css}">{prose(text)}</p>' if css else f"<p>{prose(text)}</p>"


def picture(path: Path, described: str) -> str:
    """Return a PNG as part of the page."""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img src="data:image/png;base64,{data}" alt="{attribute(described)}">'


def details(summary: str, html: str, *, opened: bool = False) -> str:
    """Return HTML that unfolds."""
    return f"<details{' open' if opened else ''}><summary>{escape(summary)}</summary>{html}</details>"


def table(columns: Sequence[str], rows: Iterable[Sequence[object]], *, css: str = "") -> str:
    """Return a table. Columns with numbers are set to the right; None is a dash.

    On a narrow screen a table with a column of words shows each row as a list, with the columns' names.
    """
    body = [list(row) for row in rows]
    kinds = [_column_css([row[index] for row in body]) for index in range(len(columns))]
    head = "".join(f"<th{kinds[index]}>{_label(text)}</th>" for index, text in enumerate(columns))
    attributes = kinds
    if _WORDS in kinds:
        css = f"{css} stacks".strip()
        attributes = [
            f'{kind} data-label="{attribute(text)}"' for kind, text in zip(kinds, columns, strict=True)
        ]
    lines = "".join(
        "<tr>" + "".join(_cell(value, attributes[index]) for index, value in enumerate(row)) + "</tr>"
        for row in body
    )
    inside = f"<thead><tr>{head}</tr></thead><tbody>{lines}</tbody>"
    return f'<div class="scroll"><table class="{css}">{inside}</table></div>'


def _column_css(values: list[object]) -> str:
    if any(isinstance(one, int | float) or (isinstance(one, Cell) and one.number) for one in values):
        return ' class="number"'
    return _WORDS if any(len(_text(one)) > _WORDY for one in values) else ""


def _cell(value: object, css: str) -> str:
    if not isinstance(value, Cell):
        return f"<td{css}>{prose(_text(value))}</td>"
    tip = f' data-tip="{attribute(value.tip)}"' if value.tip else ""
    level = f' data-level="{attribute(value.level)}"' if value.level else ""
    return f"<td{css}{level}{tip}>{value.html or escape(value.text)}</td>"


def _text(value: object) -> str:
    if value is None:
        return "\N{EN DASH}"
    if isinstance(value, Cell):
        return value.text
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    if isinstance(value, float):
        return digits(value) if value >= 0 else f"\N{MINUS SIGN}{digits(-value)}"
    return str(value)
