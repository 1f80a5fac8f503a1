"""Puts entries into the text of a YAML file, and leaves all else as it is: comments, order, style."""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import yaml


class InsertionError(ValueError):
    """The text has no mapping there that an entry could be put into."""


def with_entry(text: str, place: Sequence[str], key: str, value: str, *, comment: str = "") -> str:
    """The text with `key: value` as the first entry of the mapping at `place`, a comment behind it.

    `value` is YAML in flow style, on one line. Keys of `place` that are not there are made.

    Raises:
        InsertionError: what is at a place is no mapping, or stands for several (an alias).
    """
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    used = Counter(id(node) for node in _nodes(root))
    node, depth = root, 0
    while depth < len(place) and (child := _child(node, place[depth])) is not None:
        node, depth = child, depth + 1
        if used[id(node)] > 1:
            raise InsertionError(f"{'.'.join(place[:depth])} is an alias: give it entries of its own")
    if not isinstance(node, yaml.MappingNode):
        raise InsertionError(f"{'.'.join(place[:depth]) or 'the file'} is no mapping")
    entry = f"{key}: {value}"
    for missing in reversed(place[depth:]):
        entry = f"{missing}: {{{entry}}}"
    comma = "," if node.flow_style and node.value else ""
    remark = f"  # {comment}" if comment else ""
    at = node.start_mark.index + bool(node.flow_style)
    column = node.start_mark.column + bool(node.flow_style)
    newline = "\r\n" if "\r\n" in text else "\n"
    return f"{text[:at]}{entry}{comma}{remark}{newline}{' ' * column}{text[at:]}"


def _child(node: Any, key: str) -> Any:
    if not isinstance(node, yaml.MappingNode):
        return None
    return next((value for name, value in node.value if name.value == key), None)


def _nodes(node: Any) -> Iterator[Any]:
    """Each node as often as the text has it; what is in an alias once."""
    seen: set[int] = set()
    waiting = [node]
    while waiting:
        one = waiting.pop()
        yield one
        if id(one) in seen or isinstance(one, yaml.ScalarNode) or one is None:
            continue
        seen.add(id(one))
        for part in one.value:
            waiting += part if isinstance(part, tuple) else (part,)
