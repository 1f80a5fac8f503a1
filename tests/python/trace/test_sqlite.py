"""Bags whose storage is sqlite3, as others record them: read as ours are, within bounds."""

import random
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from synthetic_traces import deploy, record, run, swap

import mauve_rt.trace
from mauve_rt.cli.main import main
from mauve_rt.trace import TraceError
from mauve_rt.trace.bag.mcap_scan import McapScan
from mauve_rt.trace.bag.repair import examine_bag
from mauve_rt.trace.reading.check import check_bag
from mauve_rt.trace.recording.synthetic import SyntheticSource

MANY_TOPICS = """
INSERT INTO topics WITH RECURSIVE n(i) AS (SELECT 100 UNION ALL SELECT i + 1 FROM n LIMIT 5000)
SELECT i, '/t' || i, 't', 'cdr', '', '' FROM n
"""


@pytest.fixture
def ours(tmp_path: Path) -> Path:
    source = SyntheticSource(["a", "b"])
    deploy(source, "a")
    instant = run(source, "a", 5)
    swap(source, "a", instant)
    run(source, "a", 3, begin_ns=instant)
    return record(source, tmp_path / "ours")


@pytest.fixture
def sqlite_bag(ours: Path, tmp_path: Path) -> Path:
    """The same messages, as rosbags writes them."""
    bag = tmp_path / "sqlite"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer, ours_scan(ours) as scan:
        connections = {}
        for channel, message in scan.messages():
            if channel.id not in connections:
                schema = scan.schemas[channel.schema_id]
                connections[channel.id] = writer.add_connection(
                    channel.topic, schema.name, msgdef=schema.data.decode(), rihs01="RIHS01_" + "0" * 64
                )
            writer.write(connections[channel.id], message.log_time, message.data)
    return bag


def ours_scan(bag: Path) -> McapScan:
    (file,) = bag.glob("*.mcap")
    return McapScan(file)


def test_it_is_read_as_ours_is(ours: Path, sqlite_bag: Path):
    expected = mauve_rt.trace.open(ours)
    (file,) = sqlite_bag.glob("*.db3")
    for path in (sqlite_bag, file):
        trace = mauve_rt.trace.open(path)
        assert list(trace.typed()) == list(expected.typed())
        assert trace.losses == expected.losses
        assert trace.architecture == expected.architecture
        assert trace.topics == expected.topics
        assert (trace.clock_pairs == expected.clock_pairs).all()
        assert [one.whole_bytes for one in trace.files] == [file.stat().st_size]
        assert [str(one.msg) for one in trace.messages("mauve_msgs/msg/TraceNames")] == [
            str(one.msg) for one in expected.messages("mauve_msgs/msg/TraceNames")
        ]
    assert check_bag(sqlite_bag) == check_bag(ours)


def test_every_verb_reads_it(sqlite_bag: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    for words in (
        ["trace", "info", str(sqlite_bag)],
        ["trace", "check", str(sqlite_bag)],
        ["trace", "stats", str(sqlite_bag)],
        ["trace", "export", str(sqlite_bag), "--format", "csv", "--out", str(tmp_path / "csv")],
        ["report", str(sqlite_bag), "--out", str(tmp_path / "report.html")],
        ["trace", "info", str(sqlite_bag.parent / "sqlite")],
    ):
        assert main(words) == 0, capsys.readouterr().err
    assert "</html>" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert main(["trace", "repair", str(sqlite_bag)]) == 2
    assert "its storage is sqlite3; only MCAP files are" in capsys.readouterr().err
    with pytest.raises(TraceError, match="its storage is sqlite3"):
        examine_bag(sqlite_bag)


def test_a_folder_of_bags_of_both_storages_is_named_as_one(
    ours: Path, sqlite_bag: Path, capsys: pytest.CaptureFixture[str]
):
    assert main(["trace", "info", str(ours.parent)]) == 2
    assert f"found a folder of 2; name one of {ours}, {sqlite_bag}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ("CREATE VIEW more AS SELECT 1", "found that more is computed"),
        ("ALTER TABLE topics ADD COLUMN x BLOB AS (zeroblob(1000000000))", "found that topics is computed"),
        ("CREATE VIRTUAL TABLE v USING fts5(x)", "found that v is computed"),
        ("DROP TABLE messages", "missing tables"),
        ("UPDATE messages SET data = 1000000000", "a message is a int at a int"),
        ("UPDATE messages SET timestamp = 'now'", "cannot be read as a sqlite3 bag"),
        ("UPDATE message_definitions SET encoding = 'x'", "cannot be read as a sqlite3 bag"),
        ("UPDATE message_definitions SET encoded_message_definition = 'x'", "definition"),
        ("UPDATE message_definitions SET encoded_message_definition = x'00'", "has no attribute 'encode'"),
        ("UPDATE topics SET type = 5", "found no topic of type mauve_msgs/msg/TraceBatch"),
        (MANY_TOPICS, "expected at most 5,000 topics, found 5,00"),
    ],
)
def test_a_database_that_is_no_bag_is_refused(sqlite_bag: Path, words: str, why: str):
    (file,) = sqlite_bag.glob("*.db3")
    with closing(sqlite3.connect(file)) as database:
        database.execute(words)
        database.commit()
    with pytest.raises(TraceError, match=why) as refused:
        mauve_rt.trace.open(sqlite_bag)
    assert "\n" not in str(refused.value)


def test_a_page_in_two_places_is_refused(sqlite_bag: Path):
    """A tree of such pages has endless rows."""
    (file,) = sqlite_bag.glob("*.db3")
    with closing(sqlite3.connect(file)) as database:
        database.execute("PRAGMA writable_schema = ON")
        database.execute(
            "UPDATE sqlite_master SET rootpage = (SELECT rootpage FROM sqlite_master WHERE name = 'topics')"
            " WHERE name = 'messages'"
        )
        database.commit()
    with pytest.raises(TraceError, match="it is damaged: "):
        mauve_rt.trace.open(sqlite_bag)


@pytest.mark.parametrize("size", [0, 100, 4096, 5000])
def test_half_a_database_is_refused_in_a_line(sqlite_bag: Path, size: int):
    (file,) = sqlite_bag.glob("*.db3")
    file.write_bytes(file.read_bytes()[:size])
    with pytest.raises(TraceError, match="cannot be read as a sqlite3 bag") as refused:
        mauve_rt.trace.open(sqlite_bag)
    assert "\n" not in str(refused.value)


def test_a_database_with_bytes_flipped_is_read_or_refused_in_a_line(sqlite_bag: Path):
    (file,) = sqlite_bag.glob("*.db3")
    whole = file.read_bytes()
    errors = []
    for seed in range(150):
        chance = random.Random(seed)  # noqa: S311 - no cryptography
        changed = bytearray(whole)
        for _ in range(chance.choice([1, 2, 8])):
            changed[chance.randrange(len(changed))] = chance.choice([0, 1, 0x7F, 0xFF, chance.randrange(256)])
        file.write_bytes(changed)
        try:
            trace = mauve_rt.trace.open(sqlite_bag)
            list(trace.messages())
            check_bag(sqlite_bag)
        except TraceError as error:
            errors.append(str(error))
    assert all("\n" not in error for error in errors)
    assert 0 < len(errors) < 150
