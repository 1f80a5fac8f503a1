"""The skeleton of the report's page: style, tables, embedded pictures. Nothing is loaded from elsewhere."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

STYLE = """
:root { --ink: #263238; --muted: #667781; --line: #dfe5e8;
        --accent: #1f6fb4; --good: #2f8f5b; --bad: #b3432b; }
* { box-sizing: border-box; }
body { margin: 0; background: #eef2f4; color: var(--ink);
       font: 16px/1.55 system-ui, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1160px; margin: 0 auto; padding: 28px 24px 60px; }
header { border-left: 6px solid var(--good); padding: 2px 0 2px 18px; margin: 8px 0 22px; }
header.failed { border-color: var(--bad); }
header p.state { margin: 0; font-weight: 700; color: var(--good); letter-spacing: .02em; }
header.failed p.state { color: var(--bad); }
h1 { font-size: 1.55rem; line-height: 1.3; margin: 2px 0 0; font-weight: 650; }
h2 { font-size: 1.15rem; margin: 0 0 6px; }
h3 { font-size: .98rem; margin: 18px 0 2px; }
section { background: #fff; border-radius: 10px; padding: 20px 24px; margin: 18px 0;
          box-shadow: 0 1px 3px rgba(38, 50, 56, .09); }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(132px, 1fr)); gap: 12px; }
.figures div { background: #fff; border-radius: 10px; padding: 14px 16px;
               box-shadow: 0 1px 3px rgba(38, 50, 56, .09); }
.figures b { display: block; font-size: 1.5rem; line-height: 1.2; font-variant-numeric: tabular-nums; }
.figures span, p.note { color: var(--muted); font-size: .88rem; }
p.note { margin: 2px 0 12px; max-width: 75ch; }
img { width: 100%; height: auto; display: block; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: .88rem; font-variant-numeric: tabular-nums; }
td { min-width: 3.2em; white-space: nowrap; }
td.words { min-width: 11em; white-space: normal; }
th { text-align: left; color: var(--muted); font-weight: 600; }
th, td { padding: 6px 14px 6px 0; border-bottom: 1px solid var(--line); vertical-align: top; }
td.number, th.number { text-align: right; }
ol.story { list-style: none; margin: 8px 0 0; padding: 0; }
ol.story li { display: grid; grid-template-columns: 5.5em 1fr; padding: 5px 0; }
ol.story time { color: var(--accent); font-weight: 600; font-variant-numeric: tabular-nums; }
ul { margin: 4px 0; padding-left: 20px; }
.bad { color: var(--bad); }
footer { color: var(--muted); font-size: .82rem; }
@media print { body { background: #fff; } section, .figures div { box-shadow: none; break-inside: avoid; } }
"""

_ONE_DECIMAL = 10  # from here on
_WORDY = 22  # characters from which a column gets room


def page(title: str, parts: Iterable[str]) -> str:
    """Return a whole HTML document; `parts` are HTML."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style></head>\n<body><main>\n"
        + "\n".join(parts)
        + "\n</main></body></html>\n"
    )


def section(heading: str, note: str, *parts: str) -> str:
    """Return a white box with a heading (text), a remark in small print (text), and HTML."""
    remark = f'<p class="note">{escape(note)}</p>' if note else ""
    return f"<section><h2>{escape(heading)}</h2>{remark}{''.join(parts)}</section>"


def picture(path: Path, described: str) -> str:
    """Return a PNG as part of the page."""
    data = base64.b64encode(path.read_bytes()).decode()
    return f'<img src="data:image/png;base64,{data}" alt="{escape(described, quote=True)}">'


def bullets(lines: Iterable[str], *, css: str = "") -> str:
    """Return a list of texts."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f'<ul class="{css}">{items}</ul>'


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table. Columns with numbers are set to the right; None is a dash."""
    body = [list(row) for row in rows]
    numeric = [any(isinstance(row[i], int | float) for row in body) for i in range(len(columns))]
    wordy = [any(len(str(row[i])) > _WORDY for row in body) for i in range(len(columns))]
    kinds = ["number" if one else "words" if long else "" for one, long in zip(numeric, wordy, strict=True)]
    css = [f' class="{kind}"' if kind else "" for kind in kinds]
    head = "".join(f"<th{css[i]}>{escape(text)}</th>" for i, text in enumerate(columns))
    lines = [
        "<tr>" + "".join(f"<td{css[i]}>{escape(_cell(value))}</td>" for i, value in enumerate(row)) + "</tr>"
        for row in body
    ]
    inside = f"<thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody>"
    return f'<div class="scroll"><table>{inside}</table></div>'


def _cell(value: object) -> str:
    if value is None:
        return "\N{EN DASH}"
    if isinstance(value, float):
        return f"{value:,.{1 if abs(value) >= _ONE_DECIMAL else 2}f}"
    if isinstance(value, int):
        return f"{value:,}"
    return str(value)
