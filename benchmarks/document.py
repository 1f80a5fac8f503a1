"""The figures in the documentation: made from the result of one run, kept beside them, never typed."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rows import Row, markdown

PAGE = Path(__file__).parents[1] / "docs" / "concepts" / "performance.md"
RESULT = PAGE.with_suffix(".json")
BEGIN = "<!-- figures: scripts/bench --write-docs writes what stands from here on -->\n"
END = "<!-- end of the figures -->\n"


def write_docs(result: Mapping[str, Any], *, page: Path = PAGE, kept: Path = RESULT) -> None:
    """Keep the result of a run, without its single rounds, and write it into the page.

    Raises:
        ValueError: the page has no place for it.
    """
    rows = [{name: value for name, value in row.items() if name != "rounds"} for row in result["rows"]]
    told = {**result, "rows": rows}
    text = with_figures(page.read_text(encoding="utf-8"), told)
    kept.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    page.write_text(text, encoding="utf-8")


def with_figures(page: str, result: Mapping[str, Any]) -> str:
    """The page with the figures of a result in the place of those that it has.

    Raises:
        ValueError: the page has no place for it.
    """
    before, after = around_figures(page)
    return f"{before}\n{_figures(result)}\n\n{after}"


def around_figures(page: str) -> tuple[str, str]:
    """What stands before and after the figures of the page, with the lines that mark their place.

    Raises:
        ValueError: the page has no place for figures.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{PAGE.name}: expected the lines {BEGIN.strip()} and {END.strip()}, found not both")
    return before + begin, end + after


def _figures(result: Mapping[str, Any]) -> str:
    table = markdown([Row.from_json(row) for row in result["rows"]])
    told = f"`scripts/bench --{result['mode']}`, steal time {result['steal_percent']:.2f} %"
    return f"{result['machine_line']}; {told}.\n\n{table}"
