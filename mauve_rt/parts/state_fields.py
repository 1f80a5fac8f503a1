"""State fields: the values of a core in Python that its successor takes over, laid out as in C++.

    class Pid(Core[ControlShell]):
        state_fields = {"integral": "float64", "window": "float64[8]", "mode": "string<=16"}

A core that replaces it takes over each field that it declares by the same name and type, whether it is
written in Python, or in C++ with `MAUVE_STATE(integral_, ...)`. The values are those of the attributes of the
same names.
"""

import re
import struct
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mauve_rt.errors import MauveError

_CODES = {
    "bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
    "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
_TYPE = re.compile(r"(?P<item>[a-z]+\d*)(?:<=(?P<text>\d+))?(?:\[(?P<most><=)?(?P<count>\d+)\])?")
_LENGTH = struct.Struct("<I")
_ALIGNMENT = 8
_EXPECTED = "a number's type of .msg files, an array such as float64[3] or float64[<=16], or string<=32"


@dataclass(frozen=True)
class _Field:
    """One field: how its value is packed, as BoundedVector, BoundedString and std::array have it."""

    name: str
    type: str
    size: int
    pack: Callable[[Any], bytes]
    unpack: Callable[[bytes], Any]


class StateCells:
    """The state fields of one core object, packed into one block of memory. Under the interpreter's lock."""

    def __init__(self, core: object) -> None:
        """Read `state_fields` of the core.

        Raises:
            MauveError: one of its types cannot be a state field.
        """
        declared: Mapping[str, str] = getattr(core, "state_fields", None) or {}
        self._core = core
        self._fields = [_field(name, text, type(core).__qualname__) for name, text in declared.items()]
        self._values = [b"\0" * field.size for field in self._fields]

    @property
    def fields(self) -> list[tuple[str, str, int]]:
        """Name, type and bytes of each; the next begins at a multiple of 8."""
        return [(field.name, field.type, field.size) for field in self._fields]

    def store(self) -> tuple[bytes, bool]:
        """The block, from the attributes; False: one could not be packed, and has its value of before."""
        is_whole = True
        for number, field in enumerate(self._fields):
            try:
                self._values[number] = field.pack(getattr(self._core, field.name)).ljust(field.size, b"\0")
            except (AttributeError, TypeError, ValueError, OverflowError, struct.error):
                is_whole = False
        return b"".join(_padded(value) for value in self._values), is_whole

    def load(self, block: bytes) -> None:
        """Set the attributes from a block."""
        begin = 0
        for field in self._fields:
            value = field.unpack(block[begin : begin + field.size])
            setattr(self._core, field.name, _as_before(getattr(self._core, field.name, None), value))
            begin += len(_padded(b"\0" * field.size))


def _padded(value: bytes) -> bytes:
    return value.ljust(-(-len(value) // _ALIGNMENT) * _ALIGNMENT, b"\0")


def _as_before(before: Any, value: Any) -> Any:
    """A sequence in the type that the attribute has."""
    if not isinstance(value, list):
        return value
    if isinstance(before, tuple):
        return tuple(value)
    numpy = sys.modules.get("numpy")
    if numpy is not None and isinstance(before, numpy.ndarray):
        return numpy.asarray(value, dtype=before.dtype)
    return value


def _field(name: str, text: str, core: str) -> _Field:
    found = _TYPE.fullmatch(text)
    if found is not None and found["item"] == "string" and found["text"] and found["count"] is None:
        return _string(name, text, int(found["text"]))
    if found is None or found["item"] not in _CODES or found["text"]:
        raise MauveError(f"{core}.state_fields: field '{name}': expected {_EXPECTED}, found '{text}'")
    code = _CODES[found["item"]]
    if found["count"] is None:
        one = struct.Struct(f"<{code}")
        return _Field(name, text, one.size, one.pack, lambda block: one.unpack(block)[0])
    return _array(name, text, code, int(found["count"]), is_bounded=found["most"] is not None)


def _string(name: str, text: str, capacity: int) -> _Field:
    def pack(value: str) -> bytes:
        encoded = value.encode()
        if len(encoded) > capacity:
            raise ValueError(text)
        return _LENGTH.pack(len(encoded)) + encoded

    def unpack(block: bytes) -> str:
        (length,) = _LENGTH.unpack_from(block)
        return block[_LENGTH.size : _LENGTH.size + length].decode(errors="replace")

    size = -(-(_LENGTH.size + capacity) // _LENGTH.size) * _LENGTH.size
    return _Field(name, text, size, pack, unpack)


def _array(name: str, text: str, code: str, count: int, *, is_bounded: bool) -> _Field:
    item = struct.calcsize(f"<{code}")
    alignment = max(item, _LENGTH.size) if is_bounded else item
    begin = alignment if is_bounded else 0
    size = -(-(begin + count * item) // alignment) * alignment

    def pack(value: Any) -> bytes:
        if len(value) > count or (not is_bounded and len(value) != count):
            raise ValueError(text)
        head = _LENGTH.pack(len(value)).ljust(begin, b"\0") if is_bounded else b""
        return head + struct.pack(f"<{len(value)}{code}", *value)

    def unpack(block: bytes) -> list[Any]:
        length = min(_LENGTH.unpack_from(block)[0], count) if is_bounded else count
        return list(struct.unpack_from(f"<{length}{code}", block, begin))

    return _Field(name, text, size, pack, unpack)
