"""A topic of a bag that is being written, as each of its files declares it."""

from collections.abc import Sequence
from dataclasses import dataclass

from mauve_rt.trace.bag.mcap_file import McapFile
from mauve_rt.trace.bag.metadata import BagFileCounts, BagTopic
from mauve_rt.trace.format.definitions import Definition


@dataclass(frozen=True)
class WrittenTopic:
    """A topic, and its channel, which has the same number in each file."""

    name: str
    definition: Definition
    qos: str
    channel_id: int


def counted_topic(topic: WrittenTopic, files: Sequence[BagFileCounts]) -> BagTopic:
    """Return the topic with its messages in these files."""
    messages = sum(file.counts.by_channel.get(topic.channel_id, 0) for file in files)
    return BagTopic(topic.name, topic.definition.type_name, topic.qos, topic.definition.type_hash, messages)


def declare_schema(file: McapFile, definition: Definition) -> int:
    """Declare a type in a file; returns the number of its schema."""
    return file.add_schema(definition.type_name, encoding="ros2msg", data=definition.text.encode())


def declare_channel(file: McapFile, topic: WrittenTopic, schema_id: int) -> None:
    """Declare the channel of a topic in a file."""
    metadata = {"offered_qos_profiles": topic.qos, "topic_type_hash": topic.definition.type_hash}
    file.add_channel(topic.name, schema_id=schema_id, encoding="cdr", metadata=metadata)
