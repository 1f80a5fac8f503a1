"""Reads a file of a bag whose storage is sqlite3, as rosbag2 up to Humble makes them: rosbags reads it.

Bounds stay ours: a database can compute endless rows, or hold one page in many places. So only tables as
rosbag2 makes them are read, of a file that sqlite3 itself finds whole.
"""

import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Self
from urllib.parse import quote

from mauve_rt.trace.bag.mcap_library import Channel, Message, Schema
from mauve_rt.trace.errors import TraceError, libraries_missing

try:
    from rosbags.interfaces import ConnectionExtRosbag2, MessageDefinitionFormat
    from rosbags.rosbag2 import Reader
except ImportError as error:
    raise libraries_missing(error) from error

_MAX_TOPICS = 5_000  # rosbags looks for the definition of each among all
_COMPUTED = """
SELECT name FROM sqlite_master WHERE type IN ('view', 'trigger') OR sql LIKE 'CREATE VIRTUAL%'
UNION ALL
SELECT tables.name FROM sqlite_master AS tables, pragma_table_xinfo(tables.name) AS columns
WHERE tables.type = 'table' AND columns.hidden
"""


class SqliteScan:
    """One pass over a file, as `McapScan`: its topics are channels, their types schemas."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            TraceError: it cannot be read, or is no database of rosbag2.

        """
        self.path = path
        self.size = path.stat().st_size
        self.library = "rosbag2 (sqlite3)"
        self.whole_bytes = 0
        self.damage = ""
        self.custom_data: Mapping[str, str] = {}
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        try:
            _refuse_bombs(path)
            self._reader = Reader(path)
            self._reader.open()
            self._declare()
        except Exception as error:  # rosbags, apsw and sqlite3 raise what they meet in foreign tables
            raise self._unreadable(error) from error

    def __enter__(self) -> Self:
        """Return the pass itself: the file is open from its construction."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the file."""
        self._reader.close()

    def messages(self) -> Iterator[tuple[Channel, Message]]:
        """Yield all messages by the time they were received.

        Raises:
            TraceError: one cannot be read.

        """
        count = self._reader.message_count
        try:
            rows = self._reader.messages()
            for number, (connection, time_ns, data) in enumerate(rows, start=1):
                self.whole_bytes = self.size * number // count
                yield self.channels[connection.id], _message(connection.id, time_ns, data)
        except Exception as error:
            raise self._unreadable(error) from error
        self.whole_bytes = self.size

    def type_of(self, channel: Channel) -> str:
        """Type of a channel's messages, package/msg/Name."""
        return str(self.schemas[channel.schema_id].name)

    def _declare(self) -> None:
        """Take in the topics and their types."""
        for one in self._reader.connections:
            is_msg = one.msgdef.format == MessageDefinitionFormat.MSG
            encoding = one.ext.serialization_format if isinstance(one.ext, ConnectionExtRosbag2) else ""
            definition = one.msgdef.data.encode()
            self.schemas[one.id] = Schema(one.id, definition, "ros2msg" if is_msg else "", str(one.msgtype))
            self.channels[one.id] = Channel(one.id, str(one.topic), encoding, {}, one.id)

    def _unreadable(self, error: Exception) -> TraceError:
        reason = " ".join(str(error).split()) or type(error).__name__
        return TraceError(f"bag file {self.path}: cannot be read as a sqlite3 bag ({reason})")


def _message(channel_id: int, time_ns: object, data: object) -> Message:
    if not isinstance(time_ns, int) or not isinstance(data, bytes):  # sqlite3 takes any value in any column
        msg = f"a message is a {type(data).__name__} at a {type(time_ns).__name__}"
        raise TypeError(msg)
    return Message(channel_id, time_ns, data, time_ns, 0)


def _refuse_bombs(path: Path) -> None:
    with closing(sqlite3.connect(f"file:{quote(str(path))}?immutable=1", uri=True)) as database:
        database.execute("PRAGMA trusted_schema = OFF")
        database.execute("PRAGMA ignore_check_constraints = ON")
        if computed := database.execute(_COMPUTED).fetchone():
            msg = f"expected tables only, found that {computed[0]} is computed"
            raise ValueError(msg)
        (found,) = database.execute("PRAGMA quick_check(1)").fetchone()
        if found != "ok":
            msg = f"it is damaged: {found}"
            raise ValueError(msg)
        (topics,) = database.execute("SELECT count(*) FROM topics").fetchone()
        if topics > _MAX_TOPICS:
            msg = f"expected at most {_MAX_TOPICS:,} topics, found {topics:,}"
            raise ValueError(msg)
