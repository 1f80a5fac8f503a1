"""metadata.yaml, by which rosbag2 knows a bag."""

import json
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mauve_rt.trace.format.mcap_chunk import Counts

CUSTOM_DATA = "mauve_rt"
"""Name of the record by which each MCAP file tells the custom data of metadata.yaml, as of its last flush."""
_VERSION = 9  # what Jazzy writes


class BagFileCounts(NamedTuple):
    """One of a bag's files."""

    name: str
    counts: Counts
    size: int = 0
    """Bytes; 0: not known."""


class BagTopic(NamedTuple):
    """A topic as it is in all of a bag's files."""

    name: str
    type_name: str
    qos: str
    """YAML: the profiles that were offered."""
    type_hash: str
    messages: int


def named_files(files: Sequence[BagFileCounts]) -> Sequence[BagFileCounts]:
    """Those of a bag's files that metadata.yaml names: among others, none without messages.

    rosbag2 looks for a time by the files' times, and does not find its way past one that has none. A kill in
    a split leaves one: begun, and not yet named.
    """
    return [file for file in files if file.counts.messages] or files


def metadata_text(
    files: Sequence[BagFileCounts],
    topics: Sequence[BagTopic],
    *,
    custom_data: Mapping[str, str],
    ros_distro: str,
    room_bytes: int = 0,
    size: int = 0,
) -> bytes:
    """Write it by hand: at every flush a YAML library would be most of the cost.

    `room_bytes`: blanks behind it, so that more can be written over it on a full disk; `size`: or as many as
    it takes to be of that size.
    """
    total = Counts()
    for file in files:
        total = total.plus(file.counts)
    lines = [
        "rosbag2_bagfile_information:",
        f"  version: {_VERSION}",
        "  storage_identifier: mcap",
        *(f"  {line}" for line in _span(total)),
        "  topics_with_message_count:" if topics else "  topics_with_message_count: []",
    ]
    for topic in topics:
        lines += [
            "    - topic_metadata:",
            f"        name: {_quoted(topic.name)}",
            f"        type: {topic.type_name}",
            "        serialization_format: cdr",
            f"        offered_qos_profiles: {topic.qos}",
            f"        type_description_hash: {_quoted(topic.type_hash)}",
            f"      message_count: {topic.messages}",
        ]
    custom = ", ".join(f"{_quoted(key)}: {_quoted(value)}" for key, value in custom_data.items())
    lines += [
        '  compression_format: ""',
        '  compression_mode: ""',
        f"  relative_file_paths: [{', '.join(_quoted(file.name) for file in files)}]",
        "  files:",
    ]
    for file in files:
        lines += [f"    - path: {_quoted(file.name)}", *(f"      {line}" for line in _span(file.counts))]
    lines += [f"  custom_data: {{{custom}}}", f"  ros_distro: {ros_distro}"]
    text = ("\n".join(lines) + "\n").encode()
    blanks = max(room_bytes, size - len(text))
    return text + b" " * (blanks - 1) + b"\n" if blanks > 0 else text


def _span(counts: Counts) -> list[str]:
    return [
        f"starting_time: {{nanoseconds_since_epoch: {counts.start_ns}}}",
        f"duration: {{nanoseconds: {counts.end_ns - counts.start_ns}}}",
        f"message_count: {counts.messages}",
    ]


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a JSON string is a YAML string
