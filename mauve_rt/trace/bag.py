"""A rosbag2 directory around an MCAP file: metadata.yaml, message definitions, topics."""

import json
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from mauve_rt.trace.definitions import Definition, find_definition
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.mcap_chunk import Counts
from mauve_rt.trace.mcap_file import McapFile

_METADATA = "metadata.yaml"
_METADATA_VERSION = 9  # what Jazzy writes
_FOREVER = "{sec: 9223372036, nsec: 854775807}"  # RMW_DURATION_INFINITE


@dataclass(frozen=True, kw_only=True)
class TopicQos:
    """What `ros2 bag play` needs to offer a topic as it was offered."""

    depth: int = 10
    reliable: bool = True
    transient_local: bool = False

    def as_yaml(self) -> str:
        """A list of one profile on one line, in the form of rosbag2 metadata version 9."""
        reliability = "reliable" if self.reliable else "best_effort"
        durability = "transient_local" if self.transient_local else "volatile"
        return (
            f"[{{history: keep_last, depth: {self.depth}, reliability: {reliability}, "
            f"durability: {durability}, deadline: {_FOREVER}, lifespan: {_FOREVER}, liveliness: automatic, "
            f"liveliness_lease_duration: {_FOREVER}, avoid_ros_namespace_conventions: false}}]"
        )


@dataclass(frozen=True)
class _Topic:
    name: str
    definition: Definition
    qos: str
    channel_id: int


class BagWriter:
    """A bag that is a finished one at every flush. For one thread at a time.

    The MCAP file is written first, metadata.yaml replaced afterwards: one that is older than the file (a kill
    between the two) promises less than the file holds, and readers open both.
    """

    def __init__(self, directory: Path, *, ros_distro: str = "jazzy") -> None:
        """Create the folder (and its parents) with an empty, finished bag in it.

        Raises:
            TraceError: the folder exists already, or cannot be written.

        """
        self.directory = Path(directory)
        self._ros_distro = ros_distro
        self._custom_data: dict[str, str] = {}
        self._schemas: dict[str, tuple[int, Definition]] = {}
        self._topics: dict[str, _Topic] = {}
        self._stale = True  # metadata.yaml does not tell what the file holds
        if self.directory.exists():
            msg = f"bag folder {self.directory}: exists already; remove it or choose another name"
            raise TraceError(msg)
        # Made beside and renamed into place: nobody ever sees a bag folder without a finished bag in it.
        unfinished = self.directory.with_name(f".{self.directory.name}.{os.getpid()}")
        try:
            unfinished.mkdir(parents=True)
        except OSError as error:
            msg = f"bag folder {self.directory}: cannot be created ({error.strerror})"
            raise TraceError(msg) from error
        try:
            path = unfinished / f"{self.directory.name}_0.mcap"
            self._file = McapFile(path, profile="ros2", library="mauve_rt")
            self._write_metadata(unfinished)
            unfinished.rename(self.directory)
        except TraceError:
            shutil.rmtree(unfinished, ignore_errors=True)
            raise
        except OSError as error:
            self._file.abort()
            shutil.rmtree(unfinished, ignore_errors=True)
            msg = f"bag folder {self.directory}: cannot be created ({error.strerror})"
            raise TraceError(msg) from error
        self._file.path = self.directory / self._file.path.name

    @property
    def message_count(self) -> int:
        """Messages flushed so far."""
        return self._file.flushed.messages

    def add_topic(self, name: str, type_name: str, *, qos: TopicQos | None = None) -> None:
        """Declare a topic by absolute name and type (package/msg/Name); doing so again does nothing.

        Raises:
            TraceError: the name is relative, the topic has another type already, or the type is not
            installed.

        """
        known = self._topics.get(name)
        if known is not None:
            if known.definition.type_name != type_name:
                msg = f"topic {name}: is {known.definition.type_name} in this bag, not {type_name}"
                raise TraceError(msg)
            return
        if not name.startswith("/"):
            msg = f"topic {name}: expected an absolute name, e.g. /robot_1/{name}"
            raise TraceError(msg)
        if type_name not in self._schemas:
            definition = find_definition(type_name)
            schema_id = self._file.add_schema(
                definition.type_name, encoding="ros2msg", data=definition.text.encode()
            )
            self._schemas[type_name] = (schema_id, definition)
        schema_id, definition = self._schemas[type_name]
        offered = (qos or TopicQos()).as_yaml()
        channel_id = self._file.add_channel(
            name,
            schema_id=schema_id,
            encoding="cdr",
            metadata={"offered_qos_profiles": offered, "topic_type_hash": definition.type_hash},
        )
        self._topics[name] = _Topic(name, definition, offered, channel_id)

    def write(self, topic: str, log_time_ns: int, data: bytes) -> None:
        """Keep a message (CDR with its header) for the next flush; log time in ns of CLOCK_REALTIME.

        Raises:
            TraceError: the topic was not declared.

        """
        known = self._topics.get(topic)
        if known is None:
            msg = f"topic {topic}: not declared in this bag; call add_topic first"
            raise TraceError(msg)
        self._file.add_message(known.channel_id, log_time_ns, data)

    def set_custom_data(self, key: str, value: str) -> None:
        """Put a word about the recording into metadata.yaml at the next flush."""
        if self._custom_data.get(key) != value:
            self._custom_data[key] = value
            self._stale = True

    def flush(self) -> None:
        """Make the bag on disk hold everything written so far.

        Raises:
            TraceError: the system refused; the bag stays as the flush before left it. Call abort() then.

        """
        if self._file.pending_bytes:
            self._stale = True
        self._file.flush()
        if self._stale:
            try:
                self._write_metadata(self.directory)
            except OSError as error:
                msg = f"bag {self.directory}: {_METADATA} cannot be written ({error.strerror})"
                raise TraceError(msg) from error
            self._stale = False

    def close(self) -> None:
        """Flush and close.

        Raises:
            TraceError: as flush; the bag is closed all the same.

        """
        try:
            self.flush()
        finally:
            self.abort()

    def abort(self) -> None:
        """Close without writing what waits; the bag stays as the last flush left it. May be called again."""
        self._file.abort()

    def __enter__(self) -> Self:
        """Return the writer itself: the bag is open from its construction."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close, or abort when an exception passes through."""
        if kind is None:
            self.close()
        else:
            self.abort()

    def _write_metadata(self, directory: Path) -> None:
        temporary = directory / f".{_METADATA}.new"
        text = _metadata(self._file.path.name, self._file.flushed, self._topics, self._custom_data)
        temporary.write_text(text + f"  ros_distro: {self._ros_distro}\n", encoding="utf-8")
        temporary.replace(directory / _METADATA)


def _metadata(file_name: str, counts: Counts, topics: dict[str, _Topic], custom_data: dict[str, str]) -> str:
    """Text of metadata.yaml, written by hand: at every flush a YAML library would be most of the cost."""
    span = [
        f"starting_time: {{nanoseconds_since_epoch: {counts.start_ns}}}",
        f"duration: {{nanoseconds: {counts.end_ns - counts.start_ns}}}",
        f"message_count: {counts.messages}",
    ]
    lines = [
        "rosbag2_bagfile_information:",
        f"  version: {_METADATA_VERSION}",
        "  storage_identifier: mcap",
        *(f"  {line}" for line in span),
        "  topics_with_message_count:" if topics else "  topics_with_message_count: []",
    ]
    for topic in topics.values():
        lines += [
            "    - topic_metadata:",
            f"        name: {_quoted(topic.name)}",
            f"        type: {topic.definition.type_name}",
            "        serialization_format: cdr",
            f"        offered_qos_profiles: {topic.qos}",
            f"        type_description_hash: {_quoted(topic.definition.type_hash)}",
            f"      message_count: {counts.by_channel.get(topic.channel_id, 0)}",
        ]
    custom = ", ".join(f"{_quoted(key)}: {_quoted(value)}" for key, value in custom_data.items())
    lines += [
        '  compression_format: ""',
        '  compression_mode: ""',
        f"  relative_file_paths: [{_quoted(file_name)}]",
        "  files:",
        f"    - path: {_quoted(file_name)}",
        *(f"      {line}" for line in span),
        f"  custom_data: {{{custom}}}",
    ]
    return "\n".join(lines) + "\n"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a JSON string is a YAML string
