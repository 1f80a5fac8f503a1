"""The messages of a chunk as columns: what they hold, and which damage is reported."""

from pathlib import Path

import pytest

from mauve_rt.trace.bag.mcap_columns import NO_MESSAGES
from mauve_rt.trace.bag.mcap_file import MAGIC
from mauve_rt.trace.bag.mcap_library import Channel, Chunk, Header, McapRecord, Message, serialized
from mauve_rt.trace.bag.mcap_scan import Found, McapScan
from mauve_rt.trace.format.mcap_records import HEAD, Opcode

ONE, TWO = (Channel(number, f"/{number}", "cdr", {}, 0) for number in (1, 2))


@pytest.fixture(autouse=True)
def _no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mauve_rt.trace.bag.mcap_scan._PAUSE_S", 0)


def message(channel: int, number: int, data: bytes = b"data") -> Message:
    return Message(channel, 100 + number, data, 200 + number, number)


def scanned(path: Path, *records: McapRecord) -> tuple[list[Found], str]:
    path.write_bytes(MAGIC + serialized(Header("", "test"), *records))
    with McapScan(path) as scan:
        return list(scan.found()), scan.damage.partition(": ")[2]


def chunk(inside: bytes) -> Chunk:
    return Chunk("", inside, 0, 0, 0, len(inside))


AT_THE_END = "the file ends in the middle of a record"


def test_the_columns_are_the_messages(tmp_path: Path) -> None:
    sent = [message(2, 0), message(1, 1, b""), message(2, 2, b"longer"), message(2, 3)]
    (found,), damage = scanned(tmp_path / "a.mcap", chunk(serialized(TWO, ONE, *sent)))
    assert damage == AT_THE_END
    columns = found.messages
    assert list(columns.messages()) == sent
    assert list(columns.messages([1])) == [sent[1]]
    assert list(columns.counts().items()) == [(2, 3), (1, 1)], "in the order in which they first come"
    assert columns.firsts == {2: 0, 1: 1}
    assert columns.of_channel(2).tolist() == [0, 2, 3]
    assert columns.sizes.tolist() == [4, 0, 6, 4]
    assert [one.id for one in found.definitions] == [2, 1]


def test_a_message_outside_of_chunks_is_a_column_of_one(tmp_path: Path) -> None:
    found, _ = scanned(tmp_path / "a.mcap", ONE, message(1, 7, b"seven"))
    assert [len(one.messages) for one in found] == [0, 1]
    assert list(found[1].messages.messages()) == [message(1, 7, b"seven")]
    assert found[1].messages.counts() == {1: 1}


def test_no_messages_have_no_channels() -> None:
    assert (len(NO_MESSAGES), dict(NO_MESSAGES.counts()), list(NO_MESSAGES.messages())) == (0, {}, [])


UNKNOWN = "a message of channel 2, of which the file has not told before"
TORN = HEAD.pack(Opcode.MESSAGE, 500) + b"short"
SHORT = HEAD.pack(Opcode.MESSAGE, 3) + b"abc"


@pytest.mark.parametrize(
    ("inside", "damage"),
    [
        (serialized(ONE, message(1, 0), message(2, 1)), UNKNOWN),
        (serialized(ONE, message(1, 0), message(2, 1), TWO), UNKNOWN),
        (serialized(ONE, message(2, 0)) + TORN, UNKNOWN),
        (serialized(ONE, message(2, 0)) + SHORT, UNKNOWN),
        (
            serialized(ONE, message(1, 0)) + TORN + serialized(message(2, 1)),
            "a record of 500 bytes does not fit",
        ),
        (serialized(ONE, message(1, 0)) + SHORT, "a Message of 3 bytes is shorter than its head"),
        (serialized(ONE, message(1, 0)) + b"tail", "4 bytes behind the last record are none"),
    ],
)
def test_the_first_damage_of_a_chunk_is_reported(tmp_path: Path, inside: bytes, damage: str) -> None:
    found, reported = scanned(tmp_path / "a.mcap", chunk(inside))
    assert (found, reported[: len(damage)]) == ([], damage)


def test_a_channel_may_be_defined_again_behind_its_messages(tmp_path: Path) -> None:
    found, damage = scanned(tmp_path / "a.mcap", chunk(serialized(ONE, message(1, 0), ONE, message(1, 1))))
    assert (len(found[0].messages), damage) == (2, AT_THE_END)
