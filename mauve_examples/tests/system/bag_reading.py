"""Reading a mission's bags with rosbags alone, as somebody else would."""

from collections import Counter
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader


def topics(bag: Path) -> Counter[str]:
    """How many messages of each topic a bag holds."""
    with AnyReader([bag]) as reader:
        return Counter(connection.topic for connection, _, _ in reader.messages())


def messages(bag: Path, topic: str) -> list[Any]:
    """The messages of a topic, deserialised by the definitions in the bag."""
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topic]
        return [
            reader.deserialize(data, connection.msgtype)
            for connection, _, data in reader.messages(connections)
        ]
