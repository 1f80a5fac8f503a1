"""The error codes of the kernel, the codes of replies, and the classes of errors in Python."""

import re
from typing import NamedTuple

from _reference import ROOT
from _reference.messages import parsed
from _reference.python_source import doc_of, tree_of
from _reference.tables import table
from mauve_rt.file_schema.setting_words import sentence

_HEADER = ROOT / "mauve_rt/kernel/include/mauve_rt/base/error.hpp"
_REPLIES = ROOT / "mauve_msgs/msg/ReplyCode.msg"
_PYTHON = ("mauve_rt/errors.py", "mauve_rt/trace/errors.py", "mauve_rt/analysis/errors.py")


class ErrorCode(NamedTuple):
    """A line of the enumeration in error.hpp, and the code of the reply to a request that it refuses."""

    name: str
    meaning: str
    remedy: str
    reply: str


def error_codes() -> list[ErrorCode]:
    """All codes in their order.

    Raises:
        ValueError: a code has no comment with its meaning and its remedy.
    """
    text = _HEADER.read_text(encoding="utf-8")
    body = text[text.index("enum class ErrorCode") :]
    body = body[body.index("{") + 1 : body.index("};")]
    replies = dict(re.findall(r'\{ErrorCode::\w+, "(\w+)", "(\w+)"\}', text))
    codes = []
    for comment, name in re.findall(r"(?:/// (.*)\n\s*)?(\w+),\n", body):
        meaning, _, remedy = comment.partition(". ")
        if not remedy:
            raise ValueError(
                f"error.hpp: {name}: expected `/// meaning. Remedy.` above it, found '{comment}'"
            )
        codes.append(ErrorCode(name, f"{meaning}.", remedy, replies[name]))
    return codes


def text() -> str:
    """Three tables."""
    codes = error_codes()
    return "\n".join(
        [
            "## Error codes\n",
            "The `code` of a `MauveError` in Python, and `mauve::ErrorCode` in C++.\n",
            table(
                ("code", "meaning", "remedy", "reply code"),
                [(f"`{each.name}`", each.meaning, each.remedy, f"`{each.reply}`") for each in codes],
            ),
            "## Reply codes\n",
            "The `code` of replies and of `ReconfigurationEvent`, in `mauve_msgs/msg/ReplyCode`.\n",
            table(("code", "number", "error codes", "meaning"), _replies(codes)),
            "## Exception classes of Python\n",
            table(("class", "module", "meaning"), _classes()),
        ]
    )


def _replies(codes: list[ErrorCode]) -> list[tuple[str, str, str, str]]:
    _, [constants] = parsed(_REPLIES.read_text(encoding="utf-8"))
    rows = []
    for each in constants:
        if not each.comment:
            raise ValueError(f"ReplyCode.msg: {each.name}: expected a comment behind it, found none")
        causes = ", ".join(f"`{code.name}`" for code in codes if code.reply == each.name)
        rows.append((f"`{each.name}`", each.value, causes, sentence(each.comment)))
    return rows


def _classes() -> list[tuple[str, str, str]]:
    return [
        (f"`{name}`", f"`{path.removesuffix('.py').replace('/', '.')}`", doc_of(node))
        for path in _PYTHON
        for node in tree_of(ROOT / path).body
        if (name := getattr(node, "name", "")).endswith("Error")
    ]
