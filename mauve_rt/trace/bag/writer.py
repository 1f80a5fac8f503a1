"""A rosbag2 directory around MCAP files: metadata.yaml, message definitions, topics."""

import os
import shutil
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import mauve_rt
from mauve_rt.trace.bag.compression import compressor
from mauve_rt.trace.bag.disk import METADATA, Disk, Metadata, sync_folder
from mauve_rt.trace.bag.mcap_file import McapFile
from mauve_rt.trace.bag.metadata import CUSTOM_DATA, BagFileCounts, metadata_text, named_files
from mauve_rt.trace.bag.recorded import ReceivedBatch, TopicQos
from mauve_rt.trace.bag.written_topic import WrittenTopic, counted_topic, declare_channel, declare_schema
from mauve_rt.trace.errors import DiskError, TraceError
from mauve_rt.trace.format.definitions import Definition, find_definition
from mauve_rt.unfinished import beside, discard

_FILE_ROOM_BYTES, _METADATA_ROOM_BYTES = 8192, 4096
"""Kept in a file, and in metadata.yaml, for the reason of an interruption and the counts of a hundred topics
that came just before it."""


class BagWriter:
    """A bag that is a finished one at every flush, in one file or, by split(), in several.

    The MCAP file is written first, metadata.yaml replaced afterwards, both in one order to the disk: with a
    keeper, a kill leaves none of both newer than the other. Where metadata.yaml cannot be replaced (a full
    disk), the file goes back to what it tells. For one thread at a time.

    Chunks are in order of log time: a message that waited elsewhere while an earlier flush took later ones
    gets the log time of that flush. Its publish time stays its own.
    """

    def __init__(
        self,
        directory: Path,
        *,
        ros_distro: str = "jazzy",
        disk: Disk | None = None,
        keeps_room: bool = False,
        compression: str = "none",
    ) -> None:
        """Create the folder (and its parents) with an empty, finished bag in it; closes `disk` with the bag.

        `keeps_room`: until the end, for write_into_room(); `compression`: of the chunks, one of COMPRESSIONS.

        Raises:
            TraceError: the folder exists already, or cannot be written; or the compression is not installed.

        """
        self.directory = Path(directory)
        self._ros_distro = ros_distro
        self._disk = disk or Disk()
        self._keeps_room = keeps_room
        self._custom_data: dict[str, str] = {}
        self._schemas: dict[str, tuple[int, Definition]] = {}
        self._topics: dict[str, WrittenTopic] = {}
        self._complete: list[BagFileCounts] = []  # files that were split off
        self._removed: list[BagFileCounts] = []  # of these, no longer named by the next metadata.yaml
        self._to_delete: list[BagFileCounts] = []  # metadata.yaml names them no longer
        self._number = 0  # of the present file
        self._stale = True  # metadata.yaml does not tell what the files hold
        self._told: set[str] = set()  # the files that metadata.yaml names
        self._opened = ExitStack()
        self._flushed_ns = 0  # latest log time of all that was flushed
        try:
            self._compress = compressor(compression)
            self._create()
        except TraceError:
            self._disk.close()
            raise

    def _create(self) -> None:
        """Made beside and renamed into place: nobody ever sees a bag folder without a finished bag in it."""
        unfinished = beside(self.directory)
        try:
            exists = self.directory.exists()
            if not exists:
                unfinished.mkdir(parents=True)
        except OSError as error:
            msg = f"bag folder {self.directory}: cannot be created ({error.strerror})"
            raise TraceError(msg) from error
        if exists:
            msg = f"bag folder {self.directory}: exists already; remove it or choose another name"
            raise TraceError(msg)
        try:
            self._folder = os.open(unfinished, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            self._opened.callback(os.close, self._folder)
            self._file = self._new_file(unfinished, 0)
            self._opened.callback(lambda: self._file.abort())  # noqa: PLW0108 - the present one
            self._flush(sync=True)
            unfinished.rename(self.directory)
        except (TraceError, OSError) as error:
            self._opened.close()
            shutil.rmtree(unfinished, ignore_errors=True)
            if isinstance(error, TraceError):
                raise
            msg = f"bag folder {self.directory}: cannot be created ({error.strerror})"
            raise TraceError(msg) from error
        self._file.path = self.directory / self._file.path.name
        sync_folder(self.directory.parent)

    @property
    def message_count(self) -> int:
        """Messages flushed so far."""
        return sum(file.counts.messages for file in self._files())

    @property
    def file_bytes(self) -> int:
        """Bytes of the present file."""
        return self._file.size

    @property
    def total_bytes(self) -> int:
        """Bytes of all files that the next metadata.yaml names."""
        return self._file.size + sum(file.size for file in self._complete)

    @property
    def file_name(self) -> str:
        """Name of the present file."""
        return self._file.path.name

    @property
    def file_start_ns(self) -> int:
        """Log time of the present file's first flushed message; 0 when there is none."""
        return self._file.flushed.start_ns

    def add_topic(
        self, name: str, type_name: str, *, qos: TopicQos | None = None, definition: str = ""
    ) -> None:
        """Declare a topic by absolute name and type (package/msg/Name); doing so again does nothing.

        `definition`: the .msg text of a type that no installed package has.

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
            defined = Definition(type_name, definition, "") if definition else find_definition(type_name)
            self._schemas[type_name] = (declare_schema(self._file, defined), defined)
        schema_id, defined = self._schemas[type_name]
        topic = WrittenTopic(name, defined, (qos or TopicQos()).as_yaml(), len(self._topics) + 1)
        declare_channel(self._file, topic, schema_id)
        self._topics[name] = topic
        self._stale = True

    def write(self, topic: str, log_time_ns: int, data: bytes, *, publish_time_ns: int | None = None) -> None:
        """Keep a message (CDR with its header) for the next flush; times in ns of CLOCK_REALTIME.

        Raises:
            TraceError: the topic was not declared.

        """
        known = self._topics.get(topic)
        if known is None:
            msg = f"topic {topic}: not declared in this bag; call add_topic first"
            raise TraceError(msg)
        published_ns = log_time_ns if publish_time_ns is None else publish_time_ns
        log_time_ns = max(log_time_ns, self._flushed_ns)
        self._file.add_message(known.channel_id, log_time_ns, data, publish_time_ns=published_ns)

    def write_batch(
        self, batch: ReceivedBatch, topics: Sequence[str | None], *, ahead_ns: tuple[int, int]
    ) -> None:
        """Keep the messages of a batch for the next flush; `ahead_ns`: of log and of publish times.

        `topics`: the declared topic of each number in the batch; None leaves its messages out.
        """
        channels = [self._topics[topic].channel_id if topic is not None else 0 for topic in topics]
        self._file.add_batch(batch, channels, ahead_ns=ahead_ns, earliest_ns=self._flushed_ns)

    def set_custom_data(self, key: str, value: str) -> None:
        """Put a word about the recording into metadata.yaml and the present file at the next flush."""
        if self._custom_data.get(key) != value:
            self._custom_data[key] = value
            self._stale = True

    def split(self) -> None:
        """Go on in a new file, which declares the same topics. What waits is flushed before.

        Raises:
            TraceError: as flush; or the new file cannot be created.

        """
        self._flush(sync=True)
        before, self._file = self._file, self._new_file(self.directory, self._number + 1)
        self._number += 1
        self._complete.append(BagFileCounts(before.path.name, before.flushed, before.size))
        self._declare()
        before.close()

    def remove_oldest(self) -> BagFileCounts | None:
        """Leave out the oldest file with the next flush, which names it no longer; None: there is no other.

        Then delete_removed() deletes it. A kill between both leaves a file that metadata.yaml does not name.
        """
        if not self._complete or not (self._file.is_waiting or self._file.flushed.messages):
            return None
        removed = self._complete.pop(0)
        self._removed.append(removed)
        self._stale = True
        return removed

    def messages_in(self, file: BagFileCounts) -> dict[str, int]:
        """How many messages of each topic a file holds."""
        by_channel = file.counts.by_channel
        return {name: by_channel.get(topic.channel_id, 0) for name, topic in self._topics.items()}

    def delete_removed(self) -> None:
        """Delete the files that a flush left out.

        Raises:
            DiskError: one cannot be deleted; the next call tries again.

        """
        while self._to_delete:
            path = self.directory / self._to_delete[0].name
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                msg = f"bag file {path}: cannot be deleted ({error.strerror})"
                raise DiskError(msg) from error
            del self._to_delete[0]

    def drop_waiting(self) -> dict[str, int]:
        """Give up what no flush could write; how many messages it was, by topic. Only go_on() helps then."""
        by_channel = self._file.drop_waiting().by_channel
        return {
            name: by_channel[topic.channel_id]
            for name, topic in self._topics.items()
            if topic.channel_id in by_channel
        }

    def write_into_room(self) -> None:
        """Write custom data into the room that was kept: a full disk takes it, too.

        Raises:
            DiskError: it does not fit, or the disk failed.

        """
        self._file.set_metadata(CUSTOM_DATA, self._custom_data)
        size = os.stat(METADATA, dir_fd=self._folder).st_size
        metadata = self._metadata(in_place=True, size=size)
        if len(metadata.data) > size:
            msg = f"bag {self.directory}: {METADATA} has no room left for last words"
            raise DiskError(msg)
        self._file.write_into_room(metadata)

    def go_on(self, begin: Callable[[], None]) -> None:
        """Go on in a new file, behind a flush that failed; `begin` writes what it begins with.

        Raises:
            DiskError: as flush; the bag is as before.

        """
        self._file.put_back()  # else it may hold a flush that no metadata.yaml counts
        before, self._file = self._file, self._new_file(self.directory, self._number + 1)
        self._complete.append(BagFileCounts(before.path.name, before.flushed, before.size))
        try:
            self._declare()
            begin()
            self._flush(sync=True)
        except TraceError:
            self._file.abort()
            discard(self._file.path)
            self._complete.pop()
            self._file = before
            raise
        self._number += 1
        before.abort()

    def _declare(self) -> None:
        for _, definition in self._schemas.values():  # in the same order: they get the same numbers
            declare_schema(self._file, definition)
        for topic in self._topics.values():
            declare_channel(self._file, topic, self._schemas[topic.definition.type_name][0])
        self._stale = True

    def flush(self) -> None:
        """Make the bag on disk hold everything written so far.

        Raises:
            TraceError: the system refused; the bag stays as the flush before left it. Call abort() then.

        """
        self._flush(sync=False)

    def finish(self) -> None:
        """Flush for the last time: no room is kept any longer, and all of it is on the disk.

        Raises:
            TraceError: as flush.

        """
        self._stale = self._stale or self._keeps_room
        self._keeps_room = False
        self._flush(sync=True, is_last=True)

    def _flush(self, *, sync: bool, is_last: bool = False) -> None:
        if self._file.is_waiting:
            self._stale = True
        if self._custom_data:
            self._file.set_metadata(CUSTOM_DATA, self._custom_data)
        metadata = self._metadata if self._stale else None
        try:
            if is_last:
                self._file.finish(metadata=metadata)
            else:
                # What names a file no longer is on the disk before the file is deleted.
                self._file.flush(metadata=metadata, sync=sync or bool(self._removed))
        except TraceError:
            self._complete[:0], self._removed = self._removed, []  # as on the disk
            raise
        self._to_delete += self._removed
        self._removed = []
        if self._stale:
            self._told = {file.name for file in self._files()}
        self._stale = False
        self._flushed_ns = max(self._flushed_ns, self._file.flushed.end_ns)

    def close(self) -> None:
        """Flush, have all of it on the disk, and close.

        Raises:
            TraceError: as flush; the bag is closed all the same.

        """
        try:
            self.finish()
        finally:
            self.abort()

    def abort(self) -> None:
        """Close without writing what waits; the bag stays as the last flush left it. May be called again."""
        self._opened.close()
        if self._complete and self._file.path.name not in self._told:  # new and empty
            discard(self._file.path)
        self._disk.close()

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

    def _files(self) -> Sequence[BagFileCounts]:
        return named_files([*self._complete, BagFileCounts(self._file.path.name, self._file.flushed)])

    def _new_file(self, directory: Path, number: int) -> McapFile:
        path = directory / f"{self.directory.name}_{number}.mcap"
        library = f"mauve_rt {mauve_rt.__version__}"
        room_bytes = _FILE_ROOM_BYTES if self._keeps_room else 0
        return McapFile(
            path,
            profile="ros2",
            library=library,
            disk=self._disk,
            room_bytes=room_bytes,
            compress=self._compress,
        )

    def _metadata(self, *, in_place: bool = False, size: int = 0) -> Metadata:
        files = self._files()
        data = metadata_text(
            files,
            [counted_topic(topic, files) for topic in self._topics.values()],
            custom_data=self._custom_data,
            ros_distro=self._ros_distro,
            room_bytes=_METADATA_ROOM_BYTES if self._keeps_room and not in_place else 0,
            size=size,
        )
        return Metadata(self._folder, data, in_place)
