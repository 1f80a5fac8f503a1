"""ROS messages as CDR, equal bytes for equal messages: between fields rclpy leaves what was in memory."""

import struct
from collections.abc import Sequence
from typing import Any

from rosidl_parser.definition import AbstractSequence, AbstractString, Array, BasicType

_ENCAPSULATION = b"\0\1\0\0"  # little-endian, plain
_FORMATS = {
    "boolean": "?",
    "octet": "c",
    "float": "f",
    "double": "d",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
}


def serialize(message: Any) -> bytes:
    """CDR with its header, of a message with at least one field and without wide strings."""
    out = bytearray()
    _write_message(out, message)
    return _ENCAPSULATION + bytes(out)


def _write_message(out: bytearray, message: Any) -> None:
    for name, kind in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        _write(out, kind, getattr(message, name))


def _write(out: bytearray, kind: Any, value: Any) -> None:
    if isinstance(kind, BasicType):
        _write_numbers(out, kind, (value,))
    elif isinstance(kind, AbstractString):
        text = value.encode() + b"\0"
        _write_length(out, len(text))
        out += text
    elif isinstance(kind, Array | AbstractSequence):
        if isinstance(kind, AbstractSequence):
            _write_length(out, len(value))
        if isinstance(kind.value_type, BasicType):
            _write_numbers(out, kind.value_type, value)
            return
        for element in value:
            _write(out, kind.value_type, element)
    else:
        _write_message(out, value)


def _write_numbers(out: bytearray, kind: BasicType, values: Sequence[Any]) -> None:
    if len(values):
        code = _FORMATS[kind.typename]
        _align(out, struct.calcsize(code))
        out += struct.pack(f"<{len(values)}{code}", *values)


def _write_length(out: bytearray, length: int) -> None:
    _align(out, 4)
    out += struct.pack("<I", length)


def _align(out: bytearray, alignment: int) -> None:
    out += bytes(-len(out) % alignment)
