"""Bags written by a seed: writes fail at the n-th, some half done, and the keeper is killed between two.

The bag holds what the last flush that succeeded left, whole, and nothing else. A seed gives one bag.
"""

import errno
import os
import random
import shutil
import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from bag_kills import KEEPER, TEXT, has_ended, until
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.disk import Disk, KeptDisk
from mauve_rt.trace.bag.writer import BagWriter

SEEDS = 60
T0 = 1_700_000_000_000_000_000
TOPIC = "/robot/words"


pytestmark = pytest.mark.usefixtures("test_messages")


class WorldDisk(Disk):
    """The keeper's, in a world where one write fails, or where the keeper is killed before one."""

    def __init__(self, dice: random.Random) -> None:
        self.kept = KeptDisk(KEEPER, on_error=lambda _: None)
        self._writes = 0
        self._fails_at = dice.randrange(3, 60) if dice.random() < 0.7 else 0
        self._is_torn = dice.random() < 0.5
        self._killed_at = dice.randrange(1, 40) if dice.random() < 0.5 else 0

    def write(self, descriptor: int, parts: Sequence[bytes | bytearray], offset: int, **options: Any) -> None:
        self._writes += 1
        if self._writes == self._killed_at and (process := self.kept._process):
            os.kill(process, signal.SIGKILL)
            until(lambda: has_ended(process), "the keeper's end")
        if self._writes == self._fails_at:
            if self._is_torn:  # as where the disk is full in the middle
                data = b"".join(parts)
                os.pwrite(descriptor, data[: len(data) // 2], offset)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self.kept.write(descriptor, parts, offset, **options)

    def close(self) -> None:
        self.kept.close()


def _message(number: int, length: int) -> bytes:
    word = f"{number} ".encode() * length + b"\0"
    return b"\0\1\0\0" + len(word).to_bytes(4, "little") + word


def _written(folder: Path, seed: int) -> tuple[list[int], bool]:
    """Write a bag; the numbers of what it is to hold, and whether a write failed."""
    dice = random.Random(seed)  # noqa: S311 - no secret
    waiting: list[int] = []
    flushed: list[int] = []
    bag = BagWriter(folder, disk=WorldDisk(dice))
    bag.add_topic(TOPIC, TEXT)
    try:
        for number in range(dice.randrange(5, 120)):
            bag.write(TOPIC, T0 + number, _message(number, dice.choice([1, 10, 5000])))
            waiting.append(number)
            if dice.random() < 0.1:
                bag.set_custom_data("said", str(number))
            if dice.random() < 0.4:
                (bag.split if dice.random() < 0.2 else bag.flush)()
                flushed, waiting = flushed + waiting, []
        bag.close()
    except TraceError:
        bag.abort()
        return flushed, True
    return flushed + waiting, False


def _read(folder: Path) -> list[int]:
    with Reader(folder) as reader:
        by_folder = [time - T0 for _, time, _ in reader.messages()]
    by_file = []
    for file in sorted(folder.glob("*.mcap"), key=lambda each: int(each.stem.rpartition("_")[2])):
        with file.open("rb") as stream:
            messages = make_reader(stream, validate_crcs=True).iter_messages()
            by_file += [message.log_time - T0 for _, _, message in messages]
    assert by_folder == by_file
    return by_file


@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_bag_holds_what_its_last_flush_left_whatever_fails(seed: int, tmp_path: Path) -> None:
    expected, has_failed = _written(tmp_path / "bag", seed)
    found = _read(tmp_path / "bag")
    # A split that fails after its flush leaves what that has flushed.
    assert found[: len(expected)] == expected
    assert has_failed or len(found) == len(expected)
    assert found == list(range(len(found)))


def test_a_seed_gives_the_same_bag_twice(tmp_path: Path) -> None:
    for seed in range(5):
        folders = [tmp_path / f"{seed}_{turn}" for turn in ("one", "two")]
        told = [_written(folder, seed) for folder in folders]
        assert told[0] == told[1]
        assert _read(folders[0]) == _read(folders[1])
        for folder in folders:
            shutil.rmtree(folder)
