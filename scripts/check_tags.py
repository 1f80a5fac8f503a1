#!/usr/bin/env python3
"""Check that public headers say where each function may be called, also to compilers.

The tags [rt], [non-rt] and [setup] are defined in mauve_rt/base/rt.hpp. A function has the tag of its own
comment, or of the function right above it, whose comment it shares, or of its class ("All functions [rt].").
Some need none: an override has that of what it overrides; constructors and destructors are for ordinary
threads; what is = default or = delete. What is [rt] is declared MAUVE_RT, which compilers check. Nothing else
is, nor what is so with a reserve: "[rt] as far as the core is", "[rt] but for the first time".

    scripts/check_tags.py [ROOT]

Prints one line per function that breaks a rule and exits 1 when there is one.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

HEADERS = "mauve_rt/*/include/mauve_rt"
MACRO = re.compile(r"\bMAUVE_RT\b")

TAG = re.compile(r"\[(?:rt|non-rt|setup)\](?:,? (?:as far as|but for))?")
CLASS_TAG = re.compile(r"\bAll functions (\[(?:rt|non-rt|setup)\])")

# What is no declaration: preprocessor lines, comments, strings, characters (and no digit separators).
NO_CODE = re.compile(
    r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*|//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|(?<!\w)'(?:\\.|[^'\\\n])'",
    re.MULTILINE | re.DOTALL,
)
MACRO_CALL = re.compile(r"^MAUVE_\w+\([^;{]*?\)$", re.MULTILINE)  # MAUVE_TYPE(...), at global scope
TYPE = re.compile(r"^(?:class|struct|union)\b\s*(?:MAUVE_\w+\s+)?(\w*)")
NO_FUNCTION = re.compile(
    r"^(?:using|typedef|friend|static_assert|extern\s+template|template\s+class|concept|enum|class|struct)\b"
)
NAME = re.compile(r"(\boperator\b\s*(?:\(\s*\)|[^(]*)|~?\b[A-Za-z_]\w*)\s*\((?!\s*(?:\w+\s*::\s*)*\*)")
TEMPLATE = re.compile(r"^template\s+")
ACCESS = re.compile(r"^\s*(public|protected|private)\s*$")
OPERATOR = re.compile(r"\boperator\s*(?:<=>|<<=?|>>=?|<=?|>=?|->|==|!=|\+=|-=|=)")


@dataclass(frozen=True)
class Function:
    """A function as its header declares it."""

    line: int  # of its first word, from 1
    start: int  # of its head, in the text
    end: int  # of its head: where its body or ; begins
    name: str
    head: str
    is_public: bool
    is_made: bool  # a constructor or destructor
    own_tag: str  # "", where neither its comment nor that which it shares has one
    tag: str


@dataclass(frozen=True)
class Scope:
    """Where a declaration stands: the innermost class, or a namespace."""

    name: str = ""
    tag: str = ""
    is_visible: bool = True  # from outside
    is_public: bool = True  # at this place of it


@dataclass
class Header:
    """One header, its comments apart from its code."""

    text: str
    code: str = ""
    comments: dict[int, str] = field(default_factory=dict)  # by line, from 1

    def __post_init__(self) -> None:
        def blank(match: re.Match[str]) -> str:
            if match[0].startswith("//"):
                self.comments[self.text.count("\n", 0, match.start()) + 1] = match[0]
            return re.sub(r"[^\n]", " ", match[0])

        self.code = MACRO_CALL.sub(blank, NO_CODE.sub(blank, self.text))

    def functions(self) -> list[Function]:
        """Return every function declared in a class or namespace that is not detail or unnamed."""
        found: list[Function] = []
        self._scan(0, Scope(), found)
        return found

    def _scan(self, position: int, scope: Scope, found: list[Function]) -> int:
        """Read declarations up to the scope's closing brace; return what is behind it."""
        start, depth, i, before = position, 0, position, None
        while i < len(self.code):
            character = self.code[i]
            depth += (character in "([") - (character in ")]")
            if depth == 0 and character == "}":
                return i + 1
            if depth == 0 and character == ":" and (access := ACCESS.match(self.code[start:i])):
                scope, start = replace(scope, is_public=scope.is_visible and access[1] == "public"), i + 1
            elif depth == 0 and character == "{":
                head = plain(self.code[start:i])
                if inner := self._inner(head, start, scope):
                    start = i = self._scan(i + 1, inner, found)
                    continue
                end, i = i, self._closing(i)
                if not declares_function(head) or re.match(r"\s*[,{]", self.code[i + 1 :]):
                    i += 1
                    continue  # a value in braces: the declaration goes on
                before = self._add(start, end, scope, before, found)
                start = i + 1
            elif depth == 0 and character == ";":
                if declares_function(plain(self.code[start:i])):
                    before = self._add(start, i, scope, before, found)
                start = i + 1
            i += 1
        return i

    def _inner(self, head: str, start: int, scope: Scope) -> Scope | None:
        """Return the scope that the braces after this head open; nothing when they are none."""
        if head.startswith(("namespace", "inline namespace", "extern")):
            is_visible = scope.is_visible and not re.search(r"^namespace$|\bdetail$", head)
            return Scope(is_visible=is_visible, is_public=is_visible)
        if (match := TYPE.match(head)) is None:
            return None
        comment = self._comment_above(self._first_line(start))
        tag = CLASS_TAG.search(comment)
        return Scope(
            name=match[1],
            tag=tag[1] if tag else "",
            is_visible=scope.is_public,
            is_public=scope.is_public and not head.startswith("class"),
        )

    def _closing(self, i: int) -> int:
        """Return where the brace at i is closed."""
        depth = 0
        for match in re.compile(r"[{}]").finditer(self.code, i):
            depth += 1 if match[0] == "{" else -1
            if depth == 0:
                return match.start()
        return len(self.code)

    def _first_line(self, start: int) -> int:
        blanks = len(self.code[start:]) - len(self.code[start:].lstrip())
        return self.code.count("\n", 0, start + blanks) + 1

    def _comment_above(self, line: int) -> str:
        """Return the comment that ends on the line before, if that has nothing else."""
        lines = self.code.splitlines()
        first = line
        while first - 1 in self.comments and not lines[first - 2].strip():
            first -= 1
        return " ".join(self.comments[number].lstrip("/ ") for number in range(first, line))

    def _add(
        self, start: int, end: int, scope: Scope, before: tuple[int, str] | None, found: list[Function]
    ) -> tuple[int, str]:
        """Note a function; return its last line and the tag that the next one may share."""
        head = plain(self.code[start:end])
        name = name_of(head)
        line = self._first_line(start)
        last = self.code.count("\n", 0, end) + 1
        comment = self._comment_above(line)
        beside = "".join(self.comments.get(number, "") for number in range(line, last + 1))
        match = TAG.search(comment) or TAG.search(beside)
        own = match[0] if match else ""
        if not comment and not own and before is not None and before[0] == line - 1:
            own = before[1]
        is_made = name.removeprefix("~") == scope.name
        found.append(Function(line, start, end, name, head, scope.is_public, is_made, own, own or scope.tag))
        closing = self._closing(end) if self.code[end : end + 1] == "{" else end
        return self.code.count("\n", 0, closing) + 1, own


def plain(head: str) -> str:
    """Return a declaration's head without templates, attributes and what else hides its name."""
    head = OPERATOR.sub("operator", re.sub(r"\s+", " ", head).strip())
    while (shorter := re.sub(r"\{[^{}]*\}", "", head)) != head:
        head = shorter
    while "<" in head and (shorter := re.sub(r"<[^<>]*>", " ", head)) != head:
        head = shorter
    head = re.sub(r"\[\[.*?\]\]|\balignas\s*\([^()]*\)|\bdecltype\s*\([^()]*\)", " ", head)
    head = re.sub(r"\brequires\s*\((?:[^()]|\([^()]*\))*\)", " ", head)
    head = TEMPLATE.sub("", re.sub(r"\s+", " ", head).strip())
    return TEMPLATE.sub("", head)


def name_of(head: str) -> str:
    """Return the declared function's name; empty when the head declares none."""
    match = NAME.search(head)
    if match is None or NO_FUNCTION.match(head):
        return ""
    is_value = "=" in head[: match.start()]
    return "" if is_value else match[1].strip()


def declares_function(head: str) -> bool:
    """Say whether a plain head declares a function."""
    return bool(name_of(head))


def needs_tag(function: Function) -> bool:
    """Say whether a function must tell where it may be called."""
    is_given = re.search(r"= ?(?:default|delete)$|\boverride\b", function.head)
    return function.is_public and not function.is_made and not is_given


def faults(function: Function) -> Iterator[str]:
    """Yield what is wrong with a function's tag, if anything."""
    has_macro = MACRO.search(function.head) is not None
    tag = function.tag if function.is_public else function.own_tag
    if needs_tag(function) and not tag:
        yield f"{function.name}() has no tag: [rt], [non-rt] or [setup]"
    elif tag == "[rt]" and not has_macro and needs_tag(function):
        yield f"{function.name}() is [rt], but not declared MAUVE_RT"
    elif has_macro and tag and tag != "[rt]":
        yield f"{function.name}() is declared MAUVE_RT, but tagged {tag}"


def violations(root: Path) -> list[str]:
    """Return one line per function whose tag is missing or at odds with its declaration."""
    return [
        f"{path.relative_to(root)}:{function.line}: {fault}"
        for path in sorted(root.glob(f"{HEADERS}/**/*.hpp"))
        for function in Header(path.read_text(encoding="utf-8")).functions()
        for fault in faults(function)
    ]


def main() -> int:
    """Check the tree and return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parent.parent)
    found = violations(parser.parse_args().root)
    for line in found:
        sys.stdout.write(line + "\n")
    sys.stdout.write(f"{len(found)} functions whose tag is missing or untrue\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
