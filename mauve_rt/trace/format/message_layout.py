"""Where the numbers of a message are in its bytes, so that many messages of one shape are read as columns.

Messages of a type have one layout while their texts and sequences have the same lengths. `layout_of` walks
through one message as `Decoder` does; `Layout` says of others whether they have the same layout.
"""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mauve_rt.trace.errors import libraries_missing

try:
    from rosbags.interfaces import Nodetype
except ImportError as error:
    raise libraries_missing(error) from error

Bytes = npt.NDArray[np.uint8]
"""(n, size): n messages of one size."""

TIME_FIELDS = ("sec", "nanosec")
"""Of a time stamp, whose numbers are no values."""
_BEGIN = 4  # bytes of encapsulation; alignments count from behind it
_LENGTH = struct.Struct("<I")
_NUMBERS = {
    "bool": "?", "byte": "<i1", "char": "<u1", "int8": "<i1", "uint8": "<u1", "int16": "<i2", "uint16": "<u2",
    "int32": "<i4", "uint32": "<u4", "int64": "<i8", "uint64": "<u8", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
_FEWEST_NOT_ASCII = 128
_MOST_PLACES = 1 << 16  # characters or messages; more of them take longer to compare than to read


@dataclass(frozen=True)
class Layout:
    """Of the messages of one size that have the same lengths inside."""

    numbers: Mapping[str, tuple[int, np.dtype[Any]]]
    """Place and type of each number by its path, as `pose.position.x`, `ranges[3]`."""
    fixed: npt.NDArray[np.intp]
    """Places of the lengths and of the ends of texts."""
    fixed_bytes: npt.NDArray[np.uint8]
    """What is there."""
    texts: npt.NDArray[np.intp]
    """Places of characters: not read, but they have to be valid ones, and ASCII always is."""

    def matches(self, messages: Bytes) -> npt.NDArray[np.bool_]:
        """Tell of each message whether it has this layout, and nothing but ASCII in its texts."""
        same = (messages[:, self.fixed] == self.fixed_bytes).all(axis=1)
        return np.asarray(same & (messages[:, self.texts] < _FEWEST_NOT_ASCII).all(axis=1), np.bool_)

    def column(self, path: str, messages: Bytes) -> npt.NDArray[np.float64] | None:
        """Return a number of each message; None where messages of this layout have no such number."""
        place = self.numbers.get(path)
        if place is None:
            return None
        at, kind = place
        data = np.ascontiguousarray(messages[:, at : at + kind.itemsize])
        values = (data != 0) if kind == np.bool_ else data.view(kind)
        return np.asarray(values[:, 0], np.float64)


def layout_of(store: Any, type_name: str, data: bytes, *, most_elements: int) -> Layout | None:
    """Return the layout of a message, by the types of a rosbags store; None where it cannot be told.

    Of an array, `most_elements` are numbers with a path.
    """
    walk = _Walk(store, data, most_elements)
    try:
        walk.message(type_name, "", is_named=True)
    except (KeyError, IndexError, struct.error, RecursionError):
        return None  # no whole message, or of a type that this file does not know
    if walk.at > len(data):
        return None
    fixed = np.array(walk.fixed, np.intp)
    values = np.frombuffer(data, np.uint8)[fixed]
    return Layout(walk.numbers, fixed, values, np.array(walk.texts, np.intp))


class _Walk:
    """The place in a message, and what was found before it."""

    def __init__(self, store: Any, data: bytes, most_elements: int) -> None:
        self.at = _BEGIN
        self.numbers: dict[str, tuple[int, np.dtype[Any]]] = {}
        self.fixed = [*range(_BEGIN)]
        self.texts: list[int] = []
        self._store = store
        self._data = data
        self._most = most_elements
        self._steps = 0

    def message(self, type_name: str, path: str, *, is_named: bool) -> None:
        """Pass over the fields of a message."""
        self._steps += 1
        if self.at > len(self._data) or self._steps > _MOST_PLACES:
            raise IndexError  # many small messages, maybe not even there
        fields = self._store.fielddefs[type_name][1]
        is_named = is_named and tuple(name for name, _ in fields) != TIME_FIELDS
        for name, kind in fields:
            self._field(kind, f"{path}.{name}" if path else name, is_named=is_named)

    def _field(self, kind: Any, path: str, *, is_named: bool) -> None:
        node, inner = kind
        if node == Nodetype.NAME:
            self.message(inner, path, is_named=is_named)
        elif node == Nodetype.ARRAY:
            self._elements(inner[0], inner[1], path, is_named=is_named)
        elif node == Nodetype.SEQUENCE:
            self._elements(inner[0], self._length(), path, is_named=is_named)
        elif inner[0] == "string":
            self._text()
        else:
            self._number(np.dtype(_NUMBERS[inner[0]]), path, is_named=is_named)

    def _elements(self, kind: Any, count: int, path: str, *, is_named: bool) -> None:
        node, inner = kind
        skipped = 0
        if node == Nodetype.BASE and inner[0] != "string":
            skipped = max(count - self._most, 0)
        for index in range(count - skipped):
            self._field(kind, f"{path}[{index}]", is_named=is_named and index < self._most)
        if skipped:
            self.at += skipped * np.dtype(_NUMBERS[inner[0]]).itemsize

    def _number(self, kind: np.dtype[Any], path: str, *, is_named: bool) -> None:
        self._align(kind.itemsize)
        if is_named:
            self.numbers[path] = (self.at, kind)
        self.at += kind.itemsize

    def _text(self) -> None:
        length = self._length()
        if not length or length + len(self.texts) > _MOST_PLACES or len(self.fixed) > _MOST_PLACES:
            raise IndexError  # the end of a text counts
        self.texts += range(self.at, self.at + length - 1)
        self.at += length
        self.fixed.append(self.at - 1)

    def _length(self) -> int:
        self._align(_LENGTH.size)
        (length,) = _LENGTH.unpack_from(self._data, self.at)
        self.fixed += range(self.at, self.at + _LENGTH.size)
        self.at += _LENGTH.size
        if length > len(self._data):
            raise IndexError
        return int(length)

    def _align(self, size: int) -> None:
        self.at += (_BEGIN - self.at) % size
