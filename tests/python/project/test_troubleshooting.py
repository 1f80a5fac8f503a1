"""docs/howto/troubleshooting.md: each message that it quotes stands in the sources."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from pages import PAGES

ROOT = Path(__file__).parents[3]
PAGE = PAGES["docs/howto/troubleshooting.md"]
MESSAGES = re.findall(r"^Message: (`+)(.*)\1$", PAGE, re.MULTILINE)
VARIES = "..."


def _of_python(file: Path) -> Iterator[str]:
    """The texts of a module; the values in f-strings are left open."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def _of_others(file: Path) -> str:
    """The source, with literals that stand one after the other put together."""
    text = re.sub(r'"\s*\n\s*"', "", file.read_text(encoding="utf-8"))
    return text.replace('\\"', '"')


@cache
def _texts() -> str:
    python = [file for folder in ("mauve_rt", "mauve_examples") for file in (ROOT / folder).rglob("*.py")]
    others = [file for end in ("cpp", "hpp") for file in (ROOT / "mauve_rt").rglob(f"*.{end}")]
    others += [file for file in (ROOT / "scripts").iterdir() if file.suffix in {"", ".sh"} and file.is_file()]
    return "\n".join([*(text for file in python for text in _of_python(file)), *map(_of_others, others)])


def _missing(message: str) -> list[str]:
    pieces = [piece.strip(" ;:,()") for piece in message.split(VARIES)]
    return [piece for piece in pieces if re.search(r"\w", piece) and piece not in _texts()]


@pytest.mark.parametrize("message", [message for _, message in MESSAGES])
def test_each_message_is_one_of_the_programs(message: str) -> None:
    assert _missing(message) == [], "no program says so any more: correct the page"


def test_each_heading_is_in_its_message_and_has_a_cause_and_a_remedy() -> None:
    entries = re.findall(
        r"^### (.*)\n\nMessage: `+(.*?)`+\n\n- Cause: .+\n- Remedy: .+\n", PAGE, re.MULTILINE
    )
    assert len(entries) == len(MESSAGES) == PAGE.count("\n### ") > 25
    assert len({heading for heading, _ in entries}) == len(entries), "an anchor each"


def test_a_message_that_no_program_has_is_found() -> None:
    assert _missing("no executor ... is seen in a blue moon") == ["is seen in a blue moon"]
