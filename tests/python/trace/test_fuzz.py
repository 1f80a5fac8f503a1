"""A bag with bytes flipped or cut off: whoever reads it succeeds, or says in one class of error why not."""

import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from synthetic_traces import deploy, overrun, record, run, swap

from mauve_rt.cli.trace_views import info_values, statistics_values
from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.repair import examine_bag, repair_bag
from mauve_rt.trace.export.csv_files import export_csv
from mauve_rt.trace.export.perfetto import export_perfetto
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.reading.reader import open_trace
from mauve_rt.trace.reading.reconfigurations import reconfigurations
from mauve_rt.trace.reading.statistics import all_statistics
from mauve_rt.trace.recording.synthetic import SyntheticSource

ROUNDS = 60


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small bag with some of everything."""
    source = SyntheticSource(["a", "b"])
    deploy(source, "a")
    instant = run(source, "a", 5)
    instant = overrun(source, "a", instant)
    swap(source, "a", instant)
    run(source, "a", 3, begin_ns=instant)
    return record(source, tmp_path_factory.mktemp("fuzz") / "bag")


def read(bag: Path, out: Path) -> None:
    """All that reads only."""
    check_bag(bag)
    trace = open_trace(bag)
    info_values(trace)
    for statistics in all_statistics(trace).values():
        statistics_values(statistics)
    reconfigurations(trace)
    export_csv(trace, out / "csv")
    export_perfetto({"bag": trace}, out / "bag.pftrace")
    list(trace.messages())


def flipped(data: bytes, chance: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(chance.choice([1, 2, 8])):
        changed[chance.randrange(len(changed))] = chance.choice(
            [0, 1, 0x7F, 0x80, 0xFF, chance.randrange(256)]
        )
    return bytes(changed)


def without_crc(data: bytes, chance: random.Random) -> bytes:
    """Flipped behind the chunk's CRC, so that what reads the messages sees it."""
    changed = bytearray(data)
    begin = changed.find(b"MSG: ")  # of the definitions; the records come behind them
    for _ in range(chance.choice([1, 3])):
        changed[chance.randrange(max(begin, 9), len(changed))] = chance.randrange(256)
    at = 8
    while at + 9 <= len(changed):  # every chunk's CRC is set to 0: not told
        length = int.from_bytes(changed[at + 1 : at + 9], "little")
        if changed[at] == 0x06 and at + 37 <= len(changed):
            changed[at + 33 : at + 37] = bytes(4)
        at += 9 + length
    return bytes(changed)


def cut(data: bytes, chance: random.Random) -> bytes:
    return data[: chance.randrange(len(data))]


def error_of(action: Callable[..., object], *arguments: Path) -> str:
    try:
        action(*arguments)
    except TraceError as error:
        return str(error)
    return ""


def repair(bag: Path) -> None:
    repair_bag(examine_bag(bag))


@pytest.mark.parametrize("damage", [flipped, without_crc, cut])
def test_a_damaged_bag(
    whole: Path,
    tmp_path: Path,
    damage: Callable[[bytes, random.Random], bytes],
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr("mauve_rt.trace.bag.mcap_scan._PAUSE_S", 0.0)
    errors = []
    for seed in range(ROUNDS):
        chance = random.Random(seed)  # noqa: S311 - no cryptography
        bag, out = tmp_path / "bag", tmp_path / "out"
        shutil.copytree(whole, bag)
        out.mkdir()
        victim = chance.choice([*sorted(bag.glob("*.mcap")) * 3, bag / "metadata.yaml"])
        victim.write_bytes(damage(victim.read_bytes(), chance))
        errors += [error_of(read, bag, out), error_of(repair, bag)]
        shutil.rmtree(bag)
        shutil.rmtree(out)
    assert all("\n" not in error for error in errors)
    assert 0 < len(list(filter(None, errors))) < len(errors)
