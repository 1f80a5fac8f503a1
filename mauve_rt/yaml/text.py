"""YAML as this project reads it: 1.2, one document, no key twice, no more than it can stand for.

PyYAML splits the text into events, by libyaml where it has it. What the events mean is decided here, with the
place of every value and key, so that errors point at it. Keys are text, whatever they look like. PyYAML
refuses a little of YAML 1.2's syntax, such as the text `:a` without quotes in `[:a]`.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import yaml
from yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    StreamEndEvent,
)

from mauve_rt.yaml.scalars import is_tag_of, plain_value, tagged_value

MAX_BYTES = 1_000_000
MAX_DEPTH = 100  # of nesting
BYTES_PER_VALUE = 5  # aliases of aliases may not make more values of a text than so many bytes could write
_VERSION = (1, 2)
_LINE = 64  # characters of text that count for one value
_LONG = 100_000  # characters: Python's own parser takes a second for so many
# A class of its own for each range: one for all of them takes 4 ms to compile.
_NO_TEXT = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f]|[\ud800-\udfff]|\ufeff|[\ufffe-\uffff]")

Place = tuple[int, int]  # line and column, from 1
_NO_PLACES: Mapping[str, Place] = {}


class YamlError(ValueError):
    """Text that cannot be read as YAML, or is too much."""

    def __init__(self, what: str, place: Place = (1, 1), *, remedy: str = "", code: str = "") -> None:
        super().__init__(f"{what}; {remedy}" if remedy else what)
        self.what = what
        self.line, self.column = place
        self.remedy = remedy
        self.code = code or "invalid_argument"


class Node:
    """A value, in plain Python, and where it stands."""

    __slots__ = ("children", "key_places", "place", "size", "value")
    size: int  # of what it stands for: values behind aliases counted each time, long texts for more than one

    def __init__(
        self,
        value: Any,
        place: Place,
        children: "dict[str, Node] | Sequence[Node] | None" = None,
        key_places: Mapping[str, Place] | None = None,
    ) -> None:
        self.value = value
        self.place = place
        self.children = children  # of a mapping by key, of a list by index; None: a scalar
        self.key_places = _NO_PLACES if key_places is None else key_places
        self.size = 1 + (len(value) // _LINE if isinstance(value, str) else 0)
        if isinstance(children, dict):
            self.size += sum(len(key) // _LINE for key in children)
            self.size += sum(part.size for part in children.values())
        elif children is not None:
            self.size += sum(part.size for part in children)


def read_yaml(text: str, *, max_bytes: int = MAX_BYTES) -> Any:
    """The value of a text in plain Python: dict, list, str, bool, int, float, None.

    Raises:
        YamlError: no YAML 1.2, more than one document, a key given twice, or too much.
    """
    return parse_yaml(text, max_bytes=max_bytes).value


def parse_yaml(text: str, *, max_bytes: int = MAX_BYTES) -> Node:
    """As read_yaml(), with the places.

    Raises:
        YamlError: likewise.
    """
    if len(text) > max_bytes:
        raise YamlError(f"the text is too large: expected at most {max_bytes} bytes", code="io")
    if match := _NO_TEXT.search(text):
        line = text.count("\n", 0, match.start()) + 1
        place = (line, match.start() - text.rfind("\n", 0, match.start()))
        raise YamlError(f"not YAML: the character U+{ord(match[0]):04X} is not allowed", place)
    try:
        return _Composer(_events(text), max_values=max_bytes // BYTES_PER_VALUE).document()
    except yaml.MarkedYAMLError as error:
        raise _syntax_error(_in_pythons_words(text, error)) from None
    except yaml.YAMLError as error:
        raise YamlError(f"not YAML: {str(error).splitlines()[0]}") from None


def plain_scalar(text: str) -> str | None:
    """The text of a document that is one scalar without quotes and tag; None: it is another one.

    Raises:
        YamlError: as read_yaml().
    """
    read_yaml(text)
    events = [event for event in _events(text) if isinstance(event, NodeEvent)]
    is_plain = len(events) == 1 and isinstance(events[0], ScalarEvent) and events[0].implicit[0]
    return str(events[0].value) if is_plain else None


def _events(text: str) -> Iterator[Any]:
    yield from yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))


def _in_pythons_words(text: str, error: Any) -> Any:
    """What PyYAML's parser in Python says, so that the words are the same with and without libyaml."""
    mark = error.problem_mark
    if mark is None or len(text) > _LONG:
        return error
    try:
        for event in yaml.parse(text, Loader=yaml.SafeLoader):
            if event.start_mark.index > mark.index:
                break  # it would go on
    except yaml.MarkedYAMLError as same:
        return same
    return error


def _syntax_error(error: Any) -> YamlError:
    mark = error.problem_mark or error.context_mark
    problem = error.problem or ""
    reasons = (error.context, problem) if problem.startswith("but ") else (problem,)
    reason = " ".join(reason for reason in reasons if reason) or "bad syntax"
    remedy = "indent by spaces: YAML takes no tabs there" if "'\\t'" in reason else ""
    return YamlError(
        f"not YAML: {reason}", (mark.line + 1, mark.column + 1) if mark else (1, 1), remedy=remedy
    )


class _Composer:
    """Makes a tree of the events of one text."""

    def __init__(self, events: Iterator[Any], *, max_values: int) -> None:
        self._events = events
        self._max_values = max_values
        self._merged = 0  # values that were looked at to merge them
        self._anchors: dict[str, Node] = {}

    def document(self) -> Node:
        next(self._events)  # the stream's start
        start = next(self._events)
        if isinstance(start, StreamEndEvent):
            return Node(None, (1, 1))
        if isinstance(start, DocumentStartEvent) and start.version not in (None, _VERSION):
            found = ".".join(map(str, start.version))
            raise YamlError(f"not YAML 1.2, but {found}", _place(start), remedy="remove the line %YAML")
        root = self._node(next(self._events), depth=0)
        next(self._events)  # the document's end
        after = next(self._events)
        if not isinstance(after, StreamEndEvent):
            reason = "expected a single document in the stream but found another document"
            raise YamlError(f"not YAML: {reason}", _place(after))
        return root

    def _node(self, event: Any, depth: int) -> Node:
        mark = event.start_mark
        place = (mark.line + 1, mark.column + 1)
        if isinstance(event, ScalarEvent) and event.anchor is None and depth <= MAX_DEPTH:
            return Node(_scalar(event, place), place)  # most of them: shortest way
        if isinstance(event, AliasEvent):
            if event.anchor not in self._anchors:
                raise YamlError(f"not YAML: found undefined alias '{event.anchor}'", place)
            return self._anchors[event.anchor]
        if depth > MAX_DEPTH:
            raise YamlError("nested too deeply", place, code="io")
        if event.anchor is not None:
            self._anchors[event.anchor] = Node(None, place)  # what an alias inside of it stands for: nothing
        if isinstance(event, MappingStartEvent):
            node = self._mapping(event, place, depth)
        elif isinstance(event, SequenceStartEvent):
            node = self._list(event, place, depth)
        else:
            node = Node(_scalar(event, place), place)
        if node.size > self._max_values or self._merged > self._max_values:
            raise YamlError("nested too deeply", place, remedy="do its aliases refer to each other?")
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _list(self, start: Any, place: Place, depth: int) -> Node:
        if not is_tag_of(start.tag, "seq"):
            raise YamlError(f"not YAML: unknown tag {start.tag}", place)
        children = []
        while not isinstance(event := next(self._events), SequenceEndEvent):
            children.append(self._node(event, depth + 1))
        return Node([child.value for child in children], place, children)

    def _mapping(self, start: Any, place: Place, depth: int) -> Node:
        if not is_tag_of(start.tag, "map"):
            raise YamlError(f"not YAML: unknown tag {start.tag}", place)
        children: dict[str, Node] = {}
        key_places: dict[str, Place] = {}
        merged: list[Node] = []
        while not isinstance(event := next(self._events), MappingEndEvent):
            key, is_merge = self._key(event)
            if key in key_places:
                remedy = f"remove one; the first is in line {key_places[key][0]}"
                what = f"key '{key}' given twice"
                raise YamlError(what, _place(event), remedy=remedy, code="duplicate_name")
            key_places[key] = _place(event)
            node = self._node(next(self._events), depth + 1)
            if is_merge:
                merged = _merged(node)
            else:
                children[key] = node
        self._merged += sum(node.size for node in merged)
        for node in merged:  # own keys come before merged ones, and of these the first
            for key, child in _items(node):
                children.setdefault(key, child)
                key_places.setdefault(key, node.key_places[key])
        value = {key: child.value for key, child in children.items()}
        return Node(value, place, children, key_places)

    def _key(self, event: Any) -> tuple[str, bool]:
        """The text of a key, and whether it is the sign `<<`."""
        if isinstance(event, AliasEvent) and event.anchor in self._anchors:
            value = self._anchors[event.anchor].value
            if isinstance(value, str):
                return value, False
        if not isinstance(event, ScalarEvent):
            raise YamlError("not YAML: expected text as a key", _place(event))
        if event.anchor is not None:
            self._anchors[event.anchor] = Node(event.value, _place(event))
        return str(event.value), event.value == "<<" and event.implicit[0]


def _items(node: Node) -> Iterator[tuple[str, Node]]:
    yield from node.children.items() if isinstance(node.children, Mapping) else ()


def _merged(node: Node) -> list[Node]:
    nodes = [node] if node.children is None or isinstance(node.children, Mapping) else [*node.children]
    for each in nodes:
        if not isinstance(each.children, Mapping):
            reason = "expected a mapping or list of mappings for merging"
            raise YamlError(f"not YAML: {reason}", each.place)
    return nodes


def _scalar(event: Any, place: Place) -> Any:
    try:
        if event.tag not in (None, "!"):
            return tagged_value(event.value, event.tag)
        return plain_value(event.value) if event.implicit[0] else event.value
    except ValueError as error:
        raise YamlError(f"not YAML: {error}", place) from None


def _place(event: Any) -> Place:
    return event.start_mark.line + 1, event.start_mark.column + 1
