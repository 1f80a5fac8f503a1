"""The figures in the documentation: the table of one run, written by a program, never typed."""

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from rows import Row, markdown

PAGE = Path(__file__).parents[1] / "docs" / "concepts" / "performance.md"
BEGIN = "<!-- figures: scripts/bench --write-docs writes what stands from here on -->\n"
END = re.compile(r"<!-- end of the figures, sha256 ([0-9a-f]{64}|) ?-->\n")


def write_docs(rows: Sequence[Row], heading: str, *, page: Path = PAGE) -> None:
    """Write the rows of a run into the page, below its heading: computer and kind of run.

    Raises:
        ValueError: the page has no place for it.
    """
    before, _, after, _ = figures_of(page.read_text(encoding="utf-8"))
    figures = f"\n{heading}\n\n{markdown(rows)}\n\n"
    end = f"<!-- end of the figures, sha256 {checksum(figures)} -->\n"
    page.write_text(f"{before}{figures}{end}{after}", encoding="utf-8")


def figures_of(page: str) -> tuple[str, str, str, str]:
    """What stands before the figures of a page, the figures, what stands after them, and their checksum.

    Raises:
        ValueError: the page has no place for figures.
    """
    before, begin, rest = page.partition(BEGIN)
    end = END.search(rest)
    if not begin or end is None:
        raise ValueError(
            f"{PAGE.name}: expected the lines {BEGIN.strip()} and <!-- end of the figures, sha256 ... -->, "
            "found not both"
        )
    return before + begin, rest[: end.start()], rest[end.end() :], end[1]


def checksum(figures: str) -> str:
    """The checksum by which a figure that was typed into the page is found."""
    return hashlib.sha256(figures.encode()).hexdigest()
