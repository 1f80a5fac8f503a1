"""Each message and service of the common packages through its generated C++ struct and back."""

import ctypes
import fcntl
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from compiled_plugins import BUILD, INSTALLED, PLUGINS, compile_source, link
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser import definition as idl

PACKAGES = [
    "builtin_interfaces",
    "std_msgs",
    "geometry_msgs",
    "sensor_msgs",
    "nav_msgs",
    "trajectory_msgs",
    "diagnostic_msgs",
    "shape_msgs",
    "stereo_msgs",
    "visualization_msgs",
    "lifecycle_msgs",
    "std_srvs",
]
ROS = [Path(path) for path in os.environ["AMENT_PREFIX_PATH"].split(os.pathsep) if path]
GENERATOR = INSTALLED / "share" / "mauve_rt" / "cmake" / "mauve_generate_types.py"
ERRORS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")
CAPACITY = 2  # elements of each sequence without a bound
TEXT_CAPACITY = 255
HEADER_BYTES = 4
SIZES = {"boolean": 1, "octet": 1, "float": 4, "double": 8} | {
    f"{sign}int{bits}": bits // 8 for sign in ("", "u") for bits in (8, 16, 32, 64)
}
RoundTrip = Callable[[str, bytes], bytes | None]


def type_names() -> Iterator[str]:
    for package in PACKAGES:
        share = next(share for prefix in ROS if (share := prefix / "share" / package).is_dir())
        yield from (f"{package}/msg/{path.stem}" for path in sorted(share.glob("msg/*.idl")))
        for path in sorted(share.glob("srv/*.idl")):
            yield from (f"{package}/srv/{path.stem}_{part}" for part in ("Request", "Response"))


TYPES = list(type_names())


def message_class(name: str) -> Any:
    package, kind, message = name.split("/")
    found: Any = import_module(f"{package}.{kind}")
    for part in message.split("_"):
        found = getattr(found, part)
    return found


def compile_round_trips(folder: Path) -> Path:
    """A library with all structs, of two units; only what has changed is compiled."""
    include = folder / "include"
    words = ["--target", "all", "--output", include, "--prefixes", *ROS, "--interfaces", *PACKAGES]
    subprocess.run([sys.executable, GENERATOR, *words], check=True, stdout=subprocess.DEVNULL)
    headers = [include / name for name in json.loads((folder / "all.json").read_text("utf-8"))["written"]]
    objects = []
    for number, some in enumerate((headers[::2], headers[1::2])):
        structs = [
            struct
            for header in some
            for struct in re.findall(r"^MAUVE_TYPE\(([\w:]+)", header.read_text("utf-8"), re.MULTILINE)
        ]
        unit = folder / f"unit_{number}.cpp"
        lines = [
            '#include "round_trip.hpp"',
            *(f"#include <{header.relative_to(include)}>" for header in some),
            f"extern const bool kAdded{number}[];",
            f"const bool kAdded{number}[]{{",
            *(f"    round_trip::add<{struct}>()," for struct in structs),
            "};",
        ]
        unit.write_text("\n".join(lines) + "\n", encoding="utf-8")
        objects.append(folder / f"unit_{number}.o")
        compile_source(unit, objects[-1], f"-I{include}", f"-I{PLUGINS}", *ERRORS)
    objects.append(folder / "round_trip.o")
    compile_source(PLUGINS / "round_trip.cpp", objects[-1], f"-I{PLUGINS}", *ERRORS)
    library = folder / "round_trip.so"
    link(objects, library)
    return library


@pytest.fixture(scope="module")
def round_trip() -> RoundTrip:
    folder = BUILD / "round_trips"  # in the clone, for ccache
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        function = ctypes.CDLL(str(compile_round_trips(folder))).mauve_round_trip
    function.restype = ctypes.c_long
    function.argtypes = [
        ctypes.c_char_p,
        ctypes.c_char_p,
        ctypes.c_size_t,
        ctypes.c_char_p,
        ctypes.c_size_t,
        ctypes.c_size_t,
    ]

    def go(name: str, message: bytes) -> bytes | None:
        """None: refused."""
        room = ctypes.create_string_buffer(2 * len(message) + 64)
        size = function(name.encode(), message, len(message), room, len(room), CAPACITY)
        assert size >= -1, (name, size)
        return None if size < 0 else room.raw[:size]

    return go


# ---- random messages ----


def values(field: Any) -> st.SearchStrategy[Any]:
    """Of a field's type."""
    if isinstance(field, idl.AbstractNestedType):
        least, most = (
            (field.size, field.size) if isinstance(field, idl.Array) else (0, bound(field, CAPACITY))
        )
        return st.lists(values(field.value_type), min_size=least, max_size=most)
    if isinstance(field, idl.AbstractString):
        text = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=4)
        return text | st.just("m" * bound(field, TEXT_CAPACITY))
    if isinstance(field, idl.NamespacedType):
        return messages("/".join(field.namespaced_name()))
    return numbers(field.typename)


def bound(field: Any, otherwise: int) -> int:
    return int(field.maximum_size) if field.has_maximum_size() else otherwise


def numbers(typename: str) -> st.SearchStrategy[Any]:
    bits = 8 * SIZES[typename]
    if typename in ("float", "double"):
        return st.floats(allow_nan=False, width=bits)
    if typename.startswith("int"):
        return st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    others = {"boolean": st.booleans(), "octet": st.binary(min_size=1, max_size=1)}
    return others.get(typename, st.integers(0, 2**bits - 1))


def messages(name: str) -> st.SearchStrategy[Any]:
    definition = message_class(name)
    fields = dict(zip(definition.get_fields_and_field_types(), definition.SLOT_TYPES, strict=True))
    return st.builds(definition, **{field: values(slot) for field, slot in fields.items()})


# ---- bytes ----


class Layout:
    """Finds the padding of a message in plain CDR, by a walk of its values."""

    def __init__(self, message: Any) -> None:
        self.size = 0
        self.padding: set[int] = set()
        self._message(message)

    def _add(self, size: int, alignment: int) -> None:
        while self.size % alignment:
            self.padding.add(HEADER_BYTES + self.size)
            self.size += 1
        self.size += size

    def _message(self, message: Any) -> None:
        for field, slot in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
            self._value(slot, getattr(message, field))
        if not message.SLOT_TYPES:
            self._add(1, 1)

    def _value(self, slot: Any, value: Any) -> None:
        if isinstance(slot, idl.AbstractSequence):
            self._add(4, 4)
        if isinstance(slot, idl.AbstractNestedType):
            for each in value:
                self._value(slot.value_type, each)
        elif isinstance(slot, idl.AbstractString):
            self._add(4, 4)
            self._add(len(value.encode()) + 1, 1)
        elif isinstance(slot, idl.NamespacedType):
            self._message(value)
        else:
            self._add(SIZES[slot.typename], SIZES[slot.typename])

    def without_padding(self, message: bytes) -> bytes:
        return bytes(byte for place, byte in enumerate(message) if place not in self.padding)


@pytest.mark.parametrize("name", TYPES)
def test_values_and_bytes_are_equal(name: str, round_trip: RoundTrip) -> None:
    @settings(max_examples=5, database=None)
    @given(messages(name))
    def check(message: Any) -> None:
        given_bytes = serialize_message(message)
        written = round_trip(name, given_bytes)
        assert written is not None
        assert deserialize_message(written, type(message)) == message
        layout = Layout(message)
        assert len(written) == HEADER_BYTES + layout.size
        assert layout.without_padding(written) == layout.without_padding(given_bytes[: len(written)])

    check()


def make_excessive(message: Any) -> bool:
    """Give the first list or text without a bound one element more than its struct holds."""
    for field, slot in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        if isinstance(slot, idl.UnboundedString):
            setattr(message, field, "m" * (TEXT_CAPACITY + 1))
        elif isinstance(slot, idl.UnboundedSequence):
            item = slot.value_type
            is_message = isinstance(item, idl.NamespacedType)
            first = message_class("/".join(item.namespaced_name()))() if is_message else zero(item)
            setattr(message, field, [first] * (CAPACITY + 1))
        elif not isinstance(slot, idl.NamespacedType) or not make_excessive(getattr(message, field)):
            continue
        return True
    return False


def zero(item: Any) -> Any:
    if isinstance(item, idl.AbstractString):
        return ""
    return {"boolean": False, "octet": b"\0", "float": 0.0, "double": 0.0}.get(item.typename, 0)


EXCESSIVE = [name for name in TYPES if make_excessive(message_class(name)())]


@pytest.mark.parametrize("name", EXCESSIVE)
def test_one_element_more_than_a_struct_holds_is_refused(name: str, round_trip: RoundTrip) -> None:
    message = message_class(name)()
    assert round_trip(name, serialize_message(message)) is not None
    make_excessive(message)
    assert round_trip(name, serialize_message(message)) is None
