"""Values read as columns of bytes: equal to those that the decoder reads message by message."""

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from mauve_rt.trace import open as open_trace
from mauve_rt.trace.bag.mcap_file import MAGIC
from mauve_rt.trace.bag.mcap_library import Channel, DataEnd, Header, Message, Schema, serialized
from mauve_rt.trace.format.message_decoding import Decoder
from mauve_rt.trace.recording.recorder import Recorder
from mauve_rt.trace.recording.synthetic import SyntheticSource

TYPES = get_typestore(Stores.ROS2_JAZZY)
MS = 1_000_000
WORDS = ("", "a", "frame", "base_link", "Größe", "\N{SNOWMAN}")


def made(type_name: str, **fields: Any) -> Any:
    return TYPES.types[type_name](**fields)


def header(chance: random.Random) -> Any:
    stamp = made("builtin_interfaces/msg/Time", sec=chance.randrange(9), nanosec=7)
    return made("std_msgs/msg/Header", stamp=stamp, frame_id=chance.choice(WORDS))


def flag(chance: random.Random) -> Any:
    return made("std_msgs/msg/Bool", data=chance.random() < 0.5)


def large(chance: random.Random) -> Any:
    return made("std_msgs/msg/UInt64", data=chance.choice([0, 2**53 + 1, 2**64 - 1]))


def joints(chance: random.Random) -> Any:
    count = chance.choice([1, 2, 2, 2, 3])
    numbers = {name: np.array([chance.gauss(0, 1) for _ in range(count)]) for name in ("position", "effort")}
    names = [chance.choice(WORDS) for _ in range(count)]
    none = np.empty(0)
    return made("sensor_msgs/msg/JointState", header=header(chance), name=names, velocity=none, **numbers)


def polygon(chance: random.Random) -> Any:
    points = [
        made("geometry_msgs/msg/Point32", x=chance.random(), y=np.inf, z=np.nan)
        for _ in range(chance.choice([1, 3, 3, 40]))
    ]
    return made("geometry_msgs/msg/Polygon", points=points)


def odometry(chance: random.Random) -> Any:
    def vector() -> Any:
        return made("geometry_msgs/msg/Vector3", x=chance.random(), y=-1.0, z=0.0)

    turn = made("geometry_msgs/msg/Twist", linear=vector(), angular=vector())
    covariance = np.arange(36.0)
    with_covariance = made("geometry_msgs/msg/TwistWithCovariance", twist=turn, covariance=covariance)
    return made("geometry_msgs/msg/TwistWithCovarianceStamped", header=header(chance), twist=with_covariance)


def battery(chance: random.Random) -> Any:
    """Numbers of many sizes, texts among and behind them."""
    floats = ("voltage", "temperature", "current", "charge", "capacity", "design_capacity", "percentage")
    cells = np.array([chance.random() for _ in range(chance.choice([0, 3]))], np.float32)
    return made(
        "sensor_msgs/msg/BatteryState",
        header=header(chance),
        power_supply_status=1,
        power_supply_health=2,
        power_supply_technology=chance.randrange(6),
        present=chance.random() < 0.5,
        cell_voltage=cells,
        cell_temperature=cells,
        location=chance.choice(WORDS),
        serial_number=chance.choice(WORDS),
        **{name: chance.random() for name in floats},
    )


KINDS = (flag, large, joints, polygon, odometry, battery)


def record(folder: Path, makers: Sequence[Callable[[random.Random], Any]]) -> Path:
    """A message by each of these, 1 ms apart; the topic is called by what made it."""
    chance = random.Random(7)  # noqa: S311
    recorder = Recorder(SyntheticSource(["c"]), folder / "bag", node_name="/executor")
    recorder.start()
    for number, make in enumerate(makers):
        message = make(chance)
        kind = message.__msgtype__
        data = bytes(TYPES.serialize_cdr(message, kind))
        assert recorder.record(f"/{make.__name__}", kind, data, monotonic_ns=number * MS)
    recorder.stop()
    return folder / "bag"


def stored(bag: Path) -> list[tuple[Schema | None, Channel, Message]]:
    with next(bag.glob("*.mcap")).open("rb") as file:
        return list(make_reader(file).iter_messages(log_time_order=False))


def rewritten(bag: Path, **options: Any) -> Path:
    """The same messages as the package mcap writes them."""
    path = bag.parent / "rewritten.mcap"
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start()
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for schema, channel, message in stored(bag):
            assert schema is not None
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, "cdr", schemas[schema.id])
            number = channels[channel.id]
            writer.add_message(number, message.log_time, message.data, message.publish_time)
        writer.finish()
    return path


def with_one_number(bag: Path) -> Path:
    """Every topic has the channel number 1, told again before each message."""
    parts = [MAGIC, serialized(Header("ros2", "test"))]
    for schema, channel, message in stored(bag):
        assert schema is not None
        parts.append(serialized(schema, replace(channel, id=1), replace(message, channel_id=1)))
    path = bag.parent / "numbers.mcap"
    path.write_bytes(b"".join([*parts, serialized(DataEnd(0))]))
    return path


def as_recorded(bag: Path) -> Path:
    return bag


def without_chunks(bag: Path) -> Path:
    return rewritten(bag, use_chunking=False)


def compressed(bag: Path) -> Path:
    return rewritten(bag, compression=CompressionType.ZSTD, chunk_size=4096)


@pytest.mark.parametrize("form", [as_recorded, without_chunks, compressed, with_one_number])
def test_columns_are_what_the_decoder_reads(tmp_path: Path, form: Callable[[Path], Path]) -> None:
    makers = random.Random(3).choices(KINDS, k=900)  # noqa: S311
    trace = open_trace(form(record(tmp_path, makers)))
    found = trace.values
    expected = replace(trace, payload_source=None).values
    assert found.names == expected.names
    assert {name.partition(".")[0] for name in found.names} == {f"/{kind.__name__}" for kind in KINDS}
    for field, samples in expected.samples.items():
        np.testing.assert_array_equal(found.samples[field].monotonic_ns, samples.monotonic_ns)
        np.testing.assert_array_equal(found.samples[field].values, samples.values, strict=True)


def test_messages_of_one_layout_are_not_decoded_one_by_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trace = open_trace(record(tmp_path, [flag] * 100))
    decoded: list[bytes] = []
    decode = Decoder.decode

    def counted(self: Decoder, data: bytes) -> Any:
        decoded.append(data)
        return decode(self, data)

    monkeypatch.setattr(Decoder, "decode", counted)
    assert len(trace.values["/flag.data"]) == 100
    assert 0 < len(decoded) < 10


def test_a_pass_leaves_out_chunks_without_the_wanted_topic(tmp_path: Path) -> None:
    bag = record(tmp_path, [*[flag] * 100, large])
    path = rewritten(bag, compression=CompressionType.NONE, chunk_size=512)
    trace = open_trace(path)
    damaged = bytearray(path.read_bytes())
    begin = damaged.index(b"/flag")  # in the first chunk that has the topic
    damaged[begin : begin + 200] = bytes(200)
    path.write_bytes(damaged)
    assert len(list(trace.messages("/large"))) == 1
    assert len(trace.values["/large.data"]) == 1
