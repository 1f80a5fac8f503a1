"""Messages read by the definitions in a bag, held against rclpy."""

import dataclasses
import random
import string
from importlib import import_module
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import serialize_message

from mauve_msgs.action import DriveTo
from mauve_rt.trace.format.definitions import find_definition
from mauve_rt.trace.format.message_decoding import Decoder

TYPES = (
    "builtin_interfaces/msg/Time",
    "diagnostic_msgs/msg/DiagnosticArray",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "mauve_msgs/msg/ArchitectureState",
    "mauve_msgs/msg/ReconfigurationEvent",
    "mauve_msgs/msg/SupervisorDecision",
    "mauve_msgs/msg/TraceArchitecture",
    "mauve_msgs/msg/TraceBatch",
    "mauve_msgs/msg/TraceNames",
    "nav_msgs/msg/OccupancyGrid",
    "sensor_msgs/msg/BatteryState",
    "sensor_msgs/msg/LaserScan",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/Bool",
    "std_msgs/msg/Char",
    "std_msgs/msg/Empty",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/String",
    "mauve_msgs/action/DriveTo_Feedback",
    "mauve_msgs/action/DriveTo_Goal",
    "mauve_msgs/action/DriveTo_Result",
)
BITS = {f"{sign}int{bits}": bits for sign in ("", "u") for bits in (8, 16, 32, 64)} | {"char": 8}


def message_class(type_name: str) -> Any:
    package, _, name = type_name.rpartition("/")
    if package == "mauve_msgs/action":
        return getattr(DriveTo, name.removeprefix("DriveTo_"))
    return getattr(import_module(f"{package.removesuffix('/msg')}.msg"), name)


def filled(message: Any, dice: random.Random) -> Any:
    """A message with random fields, built by its own class."""
    for name, kind in message.get_fields_and_field_types().items():
        setattr(message, name, value_of(kind, dice))
    return message


def value_of(kind: str, dice: random.Random) -> Any:
    if kind.startswith("sequence<"):
        element = kind.removeprefix("sequence<").removesuffix(">").partition(",")[0]
        return [single_value_of(element, dice) for _ in range(dice.choice([0, 1, 5]))]
    base, is_array, rest = kind.partition("[")
    if is_array:
        values = [single_value_of(base, dice) for _ in range(int(rest[:-1]))]
        return values if "/" in base or base == "string" else np.array(values)
    return single_value_of(kind, dice)


def single_value_of(kind: str, dice: random.Random) -> Any:
    if kind in BITS:
        least = -(2 ** (BITS[kind] - 1)) if kind.startswith("int") else 0
        return least + dice.randrange(2 ** BITS[kind])
    given = {
        "boolean": lambda: dice.random() < 0.5,
        "octet": lambda: bytes([dice.randrange(128)]),  # rosbags has a sign for it
        "float": lambda: float(np.float32(dice.uniform(-1e6, 1e6))),
        "double": lambda: dice.uniform(-1e6, 1e6),
        "string": lambda: "".join(dice.choices(string.ascii_letters + "äöü漢", k=dice.randrange(12))),
    }
    return given[kind]() if kind in given else filled(message_class(kind)(), dice)


def plain(value: Any) -> Any:
    """A message of either as numbers, texts, lists and mappings."""
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bytes):
        return value[0]
    if dataclasses.is_dataclass(value):
        return {one.name: plain(getattr(value, one.name)) for one in dataclasses.fields(value)}
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    return [plain(one) for one in value] if hasattr(value, "typecode") else value


@pytest.mark.parametrize("type_name", TYPES)
def test_it_reads_what_rclpy_writes(type_name: str):
    decoder = Decoder(type_name, find_definition(type_name).text)
    dice = random.Random(type_name)  # noqa: S311 - no cryptography
    for _ in range(30):
        message = filled(message_class(type_name)(), dice)
        found = decoder.decode(serialize_message(message))
        assert without_dummy(plain(found)) == plain(message)


def without_dummy(message: dict[str, Any]) -> dict[str, Any]:
    """Without what DDS has of a message that has no field; rclpy does not show it."""
    return {name: value for name, value in message.items() if name != "structure_needs_at_least_one_member"}


def test_what_cannot_be_read_says_why():
    text = Decoder("a/msg/Text", "string data\n")
    assert text.decode(b"\0\1\0\0\3\0\0\0hi\0").data == "hi"
    assert text.decode(b"\0\0\0\0\0\0\0\3hi\0").data == "hi", "big-endian"
    for data, message in (
        (b"\0\3\0\0", r"expected plain CDR \(00 00 or 00 01\), found 00 03"),
        (b"\0\1\0\0\3\0\0\0h", "9 bytes are no whole message"),
        (b"\0\1\0\0\3\0", "no whole message"),
        (b"\0\1\0\0\2\0\0\0\xff\0", "no whole message"),
    ):
        with pytest.raises(ValueError, match=message):
            text.decode(data)
    with pytest.raises(ValueError, match="does not tell the type b/msg/Other"):
        Decoder("a/msg/M", "b/Other other\n")
    constants = Decoder("a/msg/M", "uint8 ONE=1\nint32 x # = a number\nstring[<=2] s\nfloat32[<=3] f 1.0\n")
    said = constants.decode(b"\0\1\0\0\7\0\0\0\1\0\0\0\2\0\0\0a\0\0\0\0\0\0\0")
    assert (said.x, said.s, list(said.f)) == (7, ["a"], [])
    assert [one.name for one in dataclasses.fields(said)] == ["x", "s", "f"]
