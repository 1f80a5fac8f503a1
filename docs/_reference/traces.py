"""The kinds of trace records, the topics and metadata keys of a bag, and the kinds of plug-ins."""

import ast
import re

from _reference import ROOT
from _reference.messages import parsed
from _reference.python_source import find, tree_of
from _reference.tables import table
from mauve_rt.file_schema.setting_words import sentence

_FIELD = re.compile(r"\b(name|a|b|c): ((?:\w+)(?: \([^)]*\))?)")
_MESSAGES = ROOT / "mauve_msgs" / "msg"
_RECORD = _MESSAGES / "TraceRecord.msg"


def records() -> str:
    """The fields of a record, then the kinds with the meanings of their fields."""
    _, [declared] = parsed(_RECORD.read_text(encoding="utf-8"))
    kinds = [each for each in declared if each.value]
    fields = [(f"`{each.name}`", f"`{each.type}`", each.comment) for each in declared if not each.value]
    rows = []
    for kind in kinds:
        if not kind.comment:
            raise ValueError(f"TraceRecord.msg: {kind.name}: expected a comment with its fields, found none")
        meanings = dict(_FIELD.findall(kind.comment))
        rest = _FIELD.sub("", kind.comment).strip(" ,;")
        lines = "<br>".join(f"`{name}`: {what}" for name, what in meanings.items())
        rows.append((f"`{kind.name}`", kind.value, lines, rest))
    return "\n".join(
        [
            "## Fields of a record\n",
            table(("field", "type", "meaning"), fields),
            "## Kinds of records\n",
            table(("kind", "number", "fields", "notes"), rows),
        ]
    )


def bag() -> str:
    """The topics that each bag has, and the keys of the custom data."""
    [own] = [
        node
        for node in tree_of(ROOT / "mauve_rt/node/executor/topic_choice.py").body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "_OWN"
    ]
    topics = ast.literal_eval(own.value)
    rows = [(f"`{name}`", f"`{kind}`", _first_sentence(kind)) for name, kind in topics.items()]
    return "\n".join(
        [
            "## Topics of a bag\n",
            "`~` is the node of the executor.\n",
            table(("topic", "type", "contents"), rows),
            "## Keys of the custom data\n",
            "`metadata.yaml` has these keys in its `custom_data`.\n",
            table(
                ("key", "meaning"),
                [_key("DROPPED_MESSAGES"), _key("LEDGER"), _key("DELETED", "bag.deletion")],
            ),
            "Each entry of `mauve_topics` has these numbers, in this order:\n",
            table(("number", "meaning"), _ledger()),
        ]
    )


def _first_sentence(kind: str) -> str:
    head, _ = parsed((_MESSAGES / f"{kind.rpartition('/')[2]}.msg").read_text(encoding="utf-8"))
    return " ".join(head.split()).partition(". ")[0].rstrip(".") + "."


def _key(name: str, module_name: str = "recording.ledger") -> tuple[str, str]:
    from _reference.python_api import below  # noqa: PLC0415

    module, nodes = find(f"mauve_rt.trace.{module_name}", name)
    [node] = nodes
    assert isinstance(node, ast.Assign)  # noqa: S101 - a constant
    meaning = below(module, nodes).removeprefix("Key in the custom data of metadata.yaml: ")
    return f"`{ast.literal_eval(node.value)}`", sentence(meaning.strip())


def _ledger() -> list[tuple[str, str]]:
    [entry] = find("mauve_rt.trace.recording.ledger", "Entry")[1]
    assert isinstance(entry, ast.ClassDef)  # noqa: S101
    rows = []
    for field, text in zip(entry.body, entry.body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
            rows.append((f"`{ast.unparse(field.target)}`", str(ast.literal_eval(text.value))))
    return rows


def plugin_kinds() -> str:
    """The kinds of plug-ins."""
    from mauve_rt.model.plugins import KINDS  # noqa: PLC0415

    return table(("kind", "meaning"), [(f"`{kind}`", what) for kind, what in KINDS.items()])
