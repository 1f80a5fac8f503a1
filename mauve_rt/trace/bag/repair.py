"""Whole bags: what is wrong with one, and making it right."""

import contextlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mauve_rt.counts import counted
from mauve_rt.trace.bag.deletion import deleted_of
from mauve_rt.trace.bag.disk import METADATA, Disk, Metadata
from mauve_rt.trace.bag.files import is_sqlite, own_and_other_files
from mauve_rt.trace.bag.mcap_repair import FileState, examine
from mauve_rt.trace.bag.metadata import BagFileCounts, BagTopic, metadata_text, named_files
from mauve_rt.trace.bag.read_metadata import file_names, read_metadata
from mauve_rt.trace.errors import TraceError
from mauve_rt.trace.progress import Progress, part, silent
from mauve_rt.yaml.text import YamlError, read_yaml


@dataclass(frozen=True)
class BagState:
    """What a pass over all files of a bag found."""

    path: Path
    files: tuple[FileState, ...]
    metadata_damage: str
    """What is wrong with metadata.yaml; empty when nothing is, or when a single file was asked about."""
    custom_data: Mapping[str, str]
    """What the last file, which is never older than metadata.yaml, tells beside; else that."""
    unreadable: Mapping[Path, str]
    """Files of which nothing can be read, beside others, and why."""
    removed: tuple[Path, ...] = ()
    """Files that the recorder took out of the bag for its size, and a kill came before it deleted them."""
    others: tuple[Path, ...] = ()
    """Files of another bag that lie in the folder: they are not read."""

    @property
    def is_finished(self) -> bool:
        """Whether every reader opens it."""
        files_are = all(file.is_finished for file in self.files)
        return files_are and not self.metadata_damage and not self.unreadable

    def topics(self) -> list[BagTopic]:
        """Each topic, with its messages in all files."""
        return _topics(self.files)

    def damages(self) -> list[str]:
        """What is wrong, a line for each file."""
        lines = [_damage(file) for file in self.files if not file.is_finished]
        lines += [f"{path.name}: nothing of it can be read ({why})" for path, why in self.unreadable.items()]
        return [*lines, *([f"{METADATA}: {self.metadata_damage}"] if self.metadata_damage else [])]


def examine_bag(path: Path, *, progress: Progress = silent) -> BagState:
    """Read a whole bag (a folder, or one MCAP file), and tell what is wrong with it.

    Raises:
        TraceError: it is no bag, or cannot be read.

    """
    if is_sqlite(path):
        msg = f"bag {path}: its storage is sqlite3; only MCAP files are examined and repaired here"
        raise TraceError(msg)
    files, others = own_and_other_files(path)
    states, unreadable = [], {}
    for index, file in enumerate(files):
        progress_here = part(progress, index / len(files), (index + 1) / len(files))
        try:
            states.append(examine(file, progress=progress_here))
        except TraceError as error:
            if len(files) == 1:
                raise
            if not file.exists():  # the recorder has just deleted it: the bag has a limit of size
                continue
            unreadable[file] = str(error).removeprefix(f"bag file {file}: ")
    custom_data: Mapping[str, str] = {}
    for state in states:
        custom_data = state.custom_data or custom_data
    if not path.is_dir():
        return BagState(path, tuple(states), "", custom_data, {})
    if not custom_data:
        with contextlib.suppress(TraceError):
            custom_data = _custom_data(read_metadata(path))
    removed = _removed(path, states, custom_data)
    states = [state for state in states if state.path not in removed]
    damage = _metadata_damage(path, states)
    return BagState(path, tuple(states), damage, custom_data, unreadable, removed, tuple(others))


def repair_bag(state: BagState) -> None:
    """Make a finished bag of it: what is whole stays, what a kill left half-written is cut off.

    A file of which nothing can be read gets another ending, so that no reader takes it for one of the bag.
    A file that the recorder was about to delete is deleted.

    Raises:
        TraceError: it cannot be written.

    """
    for file in state.files:
        if not file.is_finished:
            file.repair()
    try:
        for path in state.unreadable:
            path.rename(path.with_name(f"{path.name}.unreadable"))
        for path in state.removed:
            path.unlink(missing_ok=True)
    except OSError as error:
        msg = f"bag {state.path}: a file cannot be renamed or deleted ({error.strerror})"
        raise TraceError(msg) from error
    if not state.is_finished and state.path.is_dir():
        _write_metadata(state)


def _damage(file: FileState) -> str:
    found = f"{file.path.name}: {'' if file.is_closed else 'no finished MCAP file: '}{file.damage}"
    if file.is_data_whole:
        return f"{found}; all of its messages are whole ({file.counts.messages:,})"
    whole = f"its first {file.whole_bytes:,} bytes are whole, with {counted(file.counts.messages, 'message')}"
    return f"{found}; {whole}, not the {file.left_out_bytes:,} bytes after them"


def _removed(path: Path, states: Sequence[FileState], custom_data: Mapping[str, str]) -> tuple[Path, ...]:
    """Return the files that both the custom data and metadata.yaml tell to be no longer part of the bag."""
    deleted = deleted_of(custom_data)
    if deleted is None:
        return ()
    try:
        named = file_names(read_metadata(path))
    except TraceError:
        return ()
    files = [state.path for state in states]
    return tuple(file for file in files if deleted.is_of(file.name) and named and file.name not in named)


def _metadata_damage(path: Path, files: Sequence[FileState]) -> str:
    """Tell where metadata.yaml promises other than the files hold."""
    try:
        told = read_metadata(path)
    except TraceError as error:
        return str(error)
    names = file_names(told)
    found = [file.name for file in _named(files)]
    if names != found:
        return f"names the files {', '.join(names) or '(none)'}, there are {', '.join(found)}"
    messages = sum(file.counts.messages for file in files)
    if told.get("message_count") != messages:
        return f"tells of {told.get('message_count')} messages, there are {messages}"
    return ""


def _named(files: Sequence[FileState]) -> Sequence[BagFileCounts]:
    return named_files([BagFileCounts(file.path.name, file.counts) for file in files])


def _write_metadata(state: BagState) -> None:
    try:
        before = read_metadata(state.path)
    except TraceError:
        before = {}
    text = metadata_text(
        _named(state.files),
        _topics(state.files),
        custom_data=state.custom_data,
        ros_distro=str(before.get("ros_distro") or "jazzy"),
    )
    try:
        folder = os.open(state.path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            Disk().write(folder, (), 0, metadata=Metadata(folder, text), sync=True)
        finally:
            os.close(folder)
    except OSError as error:
        msg = f"bag {state.path}: {METADATA} cannot be written ({error.strerror})"
        raise TraceError(msg) from error


def _custom_data(metadata: Mapping[str, Any]) -> dict[str, str]:
    told = metadata.get("custom_data")
    return {str(key): str(value) for key, value in told.items()} if isinstance(told, dict) else {}


def _topics(files: Sequence[FileState]) -> list[BagTopic]:
    found: dict[str, BagTopic] = {}
    for file in files:
        types = {schema.id: schema.name for schema in file.schemas}
        for channel in file.channels:
            count = file.counts.by_channel.get(channel.id, 0)
            before = found.get(channel.topic)
            found[channel.topic] = BagTopic(
                channel.topic,
                types.get(channel.schema_id, ""),
                _one_line(channel.metadata.get("offered_qos_profiles", "")),
                channel.metadata.get("topic_type_hash", ""),
                count + (before.messages if before else 0),
            )
    return list(found.values())


def _one_line(yaml: str) -> str:
    """Return the profiles as flow YAML on one line, as they go into metadata.yaml."""
    try:
        read = read_yaml(yaml)
    except YamlError:  # whoever wrote it did not mean it to be read
        return "[]"
    if "\n" not in yaml.strip():
        return yaml.strip() or "[]"
    return json.dumps(read)  # JSON is flow YAML
