"""Messages of any type, from CDR, by the definition that a bag stores beside them.

Not by rosbags: no distribution packages it. Not by installed message classes: a bag can be read where none
are. The tests hold what is read here against rosbags and against rclpy.
"""

import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import make_dataclass
from typing import Any

import numpy as np

from mauve_rt.trace.format.definitions import SEPARATOR

_NUMBERS: Mapping[str, str] = {
    "bool": "?", "byte": "B", "char": "B", "float32": "f", "float64": "d", "int8": "b", "uint8": "B",
    "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q",
}  # fmt: skip
_FIELD = re.compile(
    r"\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?P<count>(?:<=)?\d*)\])?"
    r"\s+(?P<name>[A-Za-z]\w*)\s*(?P<is_constant>=)?"
)
_SECTION = re.compile(r"MSG:\s*(\S+)\s*\n")
_ORDERS = {b"\0\0": ">", b"\0\1": "<"}
_ENCAPSULATION_BYTES = 4
_MAX_DEPTH = 100  # of types that use each other
_MAX_FIELDS = 10_000  # of one type
_EMPTY = ("structure_needs_at_least_one_member", "uint8", None)  # what DDS has of a message without a field

_Fields = list[tuple[str, str, str | None]]
"""Name, type, and count of an array: '' or '<=n' of one of any length; None: not an array."""


class Decoder:
    """Reads messages of one type. Objects have the message's fields; arrays of numbers are numpy's."""

    def __init__(self, type_name: str, definition: str) -> None:
        """Take in a definition: the .msg file, and those of the types it uses.

        Raises:
            ValueError: it does not tell all types that it uses, or one is not read (wstring).

        """
        self._definitions = _split(type_name, definition)
        self._readers: dict[str, Callable[[_Cdr], Any]] = {}
        self._used_by: list[str] = []
        self._read = self._reader(type_name)

    def decode(self, data: bytes) -> Any:
        """Return a message.

        Raises:
            ValueError: the bytes are no such message.

        """
        order = _ORDERS.get(bytes(data[:2]))
        if order is None:
            msg = f"expected plain CDR (00 00 or 00 01), found {data[:2].hex(' ')}"
            raise ValueError(msg)
        try:
            return self._read(_Cdr(memoryview(data)[_ENCAPSULATION_BYTES:], order))
        except (struct.error, UnicodeDecodeError) as error:
            msg = f"{len(data)} bytes are no whole message ({error})"
            raise ValueError(msg) from error

    def _reader(self, type_name: str) -> Callable[["_Cdr"], Any]:
        if type_name in _NUMBERS:
            code = _NUMBERS[type_name]
            return lambda cdr: cdr.number(code)
        if type_name == "string":
            return _Cdr.text
        if type_name not in self._readers:
            self._readers[type_name] = self._message_reader(type_name)
        return self._readers[type_name]

    def _message_reader(self, type_name: str) -> Callable[["_Cdr"], Any]:
        if type_name not in self._definitions:
            msg = f"the definition does not tell the type {type_name}"
            raise ValueError(msg)
        if type_name in self._used_by or len(self._used_by) > _MAX_DEPTH:
            msg = f"the type {type_name} is defined by itself, or nested too deeply"
            raise ValueError(msg)
        fields = self._definitions[type_name]
        if len(fields) > _MAX_FIELDS:
            msg = f"the type {type_name} has {len(fields):,} fields, expected at most {_MAX_FIELDS:,}"
            raise ValueError(msg)
        try:
            kind = make_dataclass(type_name.rpartition("/")[2], [name for name, _, _ in fields])
        except TypeError as error:  # a field given twice, or named by a word of Python
            msg = f"the type {type_name} cannot be read ({error})"
            raise ValueError(msg) from error
        self._used_by.append(type_name)
        readers = [self._field_reader(of, count) for _, of, count in fields]
        self._used_by.pop()
        return lambda cdr: kind(*[read(cdr) for read in readers])

    def _field_reader(self, type_name: str, count: str | None) -> Callable[["_Cdr"], Any]:
        if count is None:
            return self._reader(type_name)
        fixed = int(count) if count.isdigit() else None
        if fixed == 0:
            msg = "the definition has an array of no elements"
            raise ValueError(msg)
        if type_name in _NUMBERS:
            code = _NUMBERS[type_name]
            return lambda cdr: cdr.numbers(code, cdr.number("I") if fixed is None else fixed)
        read = self._reader(type_name)
        return lambda cdr: [read(cdr) for _ in range(cdr.count() if fixed is None else cdr.fitting(fixed))]


class _Cdr:
    """Bytes, and how far they were read."""

    def __init__(self, data: memoryview, order: str) -> None:
        self._data = data
        self._order = order
        self._at = 0

    def number(self, code: str) -> Any:
        size = self._align(code)
        (value,) = struct.unpack_from(self._order + code, self._data, self._at)
        self._at += size
        return value

    def count(self) -> int:
        """The length of a sequence."""
        return self.fitting(self.number("I"))

    def fitting(self, count: int) -> int:
        """A number of elements, none of which is shorter than a byte."""
        if count > len(self._data) - self._at:
            msg = f"{count:,} elements were expected at byte {self._at} of {len(self._data)}"
            raise struct.error(msg)
        return count

    def numbers(self, code: str, count: int) -> Any:
        dtype = np.dtype(self._order + code)
        if not count:
            return np.array([], dtype)
        size = self._align(code) * count
        return np.frombuffer(self._take(size), dtype)

    def text(self) -> str:
        return str(self._take(self.number("I"))[:-1], "utf-8")

    def _align(self, code: str) -> int:
        size = struct.calcsize(f"={code}")
        self._at += -self._at % size
        return size

    def _take(self, size: int) -> memoryview:
        taken = self._data[self._at : self._at + size]
        if len(taken) < size:
            msg = f"{size} bytes were expected at byte {self._at}, there are {len(taken)}"
            raise struct.error(msg)
        self._at += size
        return taken


def _split(type_name: str, definition: str) -> dict[str, _Fields]:
    """Return the fields of each type that a definition tells."""
    main, *others = definition.split(SEPARATOR)
    found = {type_name: _fields(main, type_name)}
    for section in others:
        head = _SECTION.match(section.lstrip("=\n"))
        if head:
            package, _, name = head[1].rpartition("/")
            full = f"{package.removesuffix('/msg')}/msg/{name}"
            found[full] = _fields(section.lstrip("=\n")[head.end() :], full)
    return found


def _fields(text: str, type_name: str) -> _Fields:
    package = type_name.partition("/")[0]
    fields: _Fields = []
    for line in text.splitlines():
        match = _FIELD.match(line)
        if match is None or match["is_constant"]:
            continue
        fields.append((match["name"], _full_name(match["type"], package), match["count"]))
    return fields or [_EMPTY]


def _full_name(name: str, package: str) -> str:
    if name in _NUMBERS or name in ("string", "wstring"):
        return name
    owner, _, short = name.rpartition("/")
    return f"{owner.removesuffix('/msg') or package}/msg/{short}"
