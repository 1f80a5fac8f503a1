"""Runs a tutorial as its reader would: writes the files that the page shows, and types its commands.

A block below a paragraph that ends with "`path/file`:" is a file. A `console` block has commands, which begin
with "$ ", and the output that follows them. In the output "..." stands for any text, on a line of its own for
any number of lines. A command that ends with "&" runs on. A block that is marked `not run` is only shown.
Links to other tutorials in the section "What you need" name the pages that the reader has done before.
"""

import os
import re
import subprocess
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Self

from page_blocks import Block, blocks

PATIENCE_S = 300.0  # a busy computer compiles for a minute
PAGES = Path(__file__).parents[1] / "docs" / "tutorials"
FILE = re.compile(r"`([\w./-]+)`:$")


def file_of(block: Block, page: str) -> str:
    """The file that a block is; empty: the block is no file."""
    above = [line.strip() for line in page.splitlines()[: block.lines.start]]
    while above and not above[-1]:
        above.pop()
    found = FILE.search(above[-1]) if above and block.language != "console" else None
    return found[1] if found else ""


def is_run(block: Block, page: str) -> bool:
    """Whether a block is a file or commands."""
    return not block.not_run and (block.language == "console" or bool(file_of(block, page)))


def needed(page: str) -> list[str]:
    """The tutorials that a reader has done before, by their files' names."""
    section = re.search(r"^## What you need\n(.*?)^## ", page, re.MULTILINE | re.DOTALL)
    return re.findall(r"\]\((\d\d_\w+\.md)\)", section[1]) if section else []


def commands(text: str) -> Iterator[tuple[str, str]]:
    """Each command of a console block with the output shown below it."""
    assert text.startswith("$ "), f"expected '$ ' and a command, found: {text}"
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command, _, rest = part.partition("\n")
        while command.endswith("\\"):
            line, _, rest = rest.partition("\n")
            command = f"{command[:-1].rstrip()} {line.strip()}"
        yield command.strip(), rest


def pattern(shown: str) -> re.Pattern[str]:
    """Matches the output that a page shows; empty lines and the number of spaces do not count."""
    lines = []
    for line in shown.split("\n"):
        if line.strip() == "...":
            lines.append(r"(?:.*\n)*?")
        elif line.strip():
            words = [re.escape(word).replace(r"\.\.\.", ".*?") for word in line.split()]
            lines.append(r"[ \t]*" + r"[ \t]+".join(words) + r"[ \t]*\n")
    return re.compile("".join(lines))


class Reader:
    """Does tutorials in one folder, each page once, after those that it needs."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self._folder = folder
        self._environment = dict(environment)
        self._done: dict[str, bool] = {}  # by page: whether all of it was as shown

    def do(self, name: str) -> None:
        """Do the page, unless it is done."""
        if name in self._done:
            assert self._done[name], f"{name} has failed"
            return
        self._done[name] = False
        page = (PAGES / name).read_text(encoding="utf-8")
        for other in needed(page):
            self.do(other)
        with Terminal(self._folder, self._environment) as terminal:
            for block in filter(lambda block: is_run(block, page), blocks(page)):
                where = f"{name}, line {block.lines.start + 1}"
                if file := file_of(block, page):
                    path = self._folder / file
                    path.parent.mkdir(parents=True, exist_ok=True)
                    path.write_text(block.text, encoding="utf-8")
                else:
                    for command, shown in commands(block.text):
                        terminal.type(command, shown, where)
        self._done[name] = True


class Terminal:
    """A shell; ends with all that it has started."""

    def __init__(self, folder: Path, environment: Mapping[str, str]) -> None:
        self._logs = folder / ".logs"
        self._logs.mkdir(exist_ok=True)
        self._count = len(list(self._logs.iterdir()))
        self._shell = subprocess.Popen(
            ["bash", "--norc"],
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._send("set -m")  # job control: %1 is a job, with all its processes

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._send("for job in $(jobs -p); do kill -- -$job; done; wait; exit")
        try:
            self._shell.wait(20)
        except subprocess.TimeoutExpired:
            self._shell.kill()
            self._shell.wait()

    def type(self, command: str, shown: str, where: str) -> None:
        """Type a command, and hold its output against what is shown; of one that runs on, until that came."""
        self._count += 1
        log, status_file = self._logs / f"{self._count}.log", self._logs / f"{self._count}.status"
        if runs_on := command.endswith("&"):
            self._send(f"{{ {command[:-1]}; }} >{log} 2>&1 &")
        else:
            self._send(f"{{ {command}\n}} >{log} 2>&1; echo $? >{status_file}")
        expected = pattern(shown)
        deadline = time.monotonic() + PATIENCE_S
        while True:
            status = status_file.read_text("ascii").strip() if status_file.exists() else ""
            output = re.sub(r"^\s*\n", "", log.read_text("utf-8") if log.exists() else "", flags=re.MULTILINE)
            if status or (runs_on and expected.match(output)):
                break
            assert time.monotonic() < deadline, f"{where}: {command}:\n{output}\nexpected:\n{shown}"
            time.sleep(0.02)
        fits = expected.fullmatch(output) if shown.strip() not in ("", "...") else status == "0"
        assert runs_on or fits, f"{where}: {command}: status {status}\n{output}\nexpected:\n{shown}"

    def _send(self, line: str) -> None:
        assert self._shell.stdin is not None
        self._shell.stdin.write(line + "\n")
        self._shell.stdin.flush()
