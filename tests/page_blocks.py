"""The blocks of commands and code in a page of Markdown, as CommonMark finds them."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from markdown_it import MarkdownIt

# Of MyST: they have no code in them. Other directives begin with :::, so that code in them is found.
WITHOUT_CODE = ("{toctree}", "{glossary}", "{include}")
MARKER = re.compile(r"<!-- not run: (\S.*) -->\n")


@dataclass(frozen=True)
class Block:
    """What stands in a fence, or is indented by four."""

    text: str
    lines: range
    """Lines of the page, from 0 on, fences included."""
    is_fenced: bool
    language: str
    not_run: str
    """The reason in the marker directly above, `<!-- not run: REASON -->`; empty where there is none."""

    @property
    def first_line(self) -> str:
        """The first line, without its indent."""
        return self.text.split("\n", 1)[0].strip()


def blocks(page: str) -> Iterator[Block]:
    """Yield the blocks of a page, in its order."""
    reason, marked = "", -1
    for token in MarkdownIt("commonmark").parse(page):
        marker = MARKER.fullmatch(token.content) if token.type == "html_block" else None
        if marker is not None and token.map is not None:
            reason, marked = marker[1], token.map[1]
        if token.type not in {"fence", "code_block"} or token.info.startswith(WITHOUT_CODE):
            continue
        begin, end = token.map or (0, 0)
        yield Block(
            text=token.content,
            lines=range(begin, end),
            is_fenced=token.type == "fence",
            language=token.info,
            not_run=reason if begin == marked else "",
        )
