"""ROS messages as Python parts name them: by class or by type name; and their serialized form."""

import copy
from functools import cache
from typing import Any

from mauve_rt.parts.message_types import PARTS_OF_ACTIONS, action_class, is_promised, message_class

__all__ = [
    "action_name",
    "deserialize",
    "frame_ids",
    "in_frames",
    "message_class",
    "serialize",
    "service_name",
    "type_name",
    "zero",
    "zeros",
]


_EMPTY = b"\0\1\0\0"  # CDR's header alone


def type_name(type_or_name: Any) -> str:
    """`geometry_msgs/msg/Point` of that class, `mauve_msgs/action/DriveTo_Goal` of DriveTo.Goal.

    A name is returned as it is.

    Raises:
        TypeError: neither a name nor a class of ROS messages.
    """
    if isinstance(type_or_name, str):
        return type_or_name
    if not isinstance(type_or_name, type) or not hasattr(type_or_name, "get_fields_and_field_types"):
        raise TypeError(f"expected a class of ROS messages or a type's name, found {type_or_name!r}")
    package, _, module = type_or_name.__module__.partition(".")
    folder = "action" if module.startswith("action.") else "msg"
    return f"{package}/{folder}/{type_or_name.__name__}"


def service_name(service: Any) -> str:
    """`std_srvs/srv/SetBool` of that class.

    Raises:
        TypeError: no class of a ROS service.
    """
    if not isinstance(service, type) or not hasattr(service, "Request") or not hasattr(service, "Response"):
        raise TypeError(f"expected a class of a ROS service, found {service!r}")
    package = service.__module__.partition(".")[0]
    return f"{package}/srv/{service.__name__}"


def action_name(action: Any) -> str:
    """`mauve_msgs/action/DriveTo` of that class.

    Raises:
        TypeError: no class of a ROS action.
    """
    if not isinstance(action, type) or not all(hasattr(action, part) for part in PARTS_OF_ACTIONS):
        raise TypeError(f"expected a class of a ROS action such as DriveTo, found {action!r}")
    return f"{action.__module__.partition('.')[0]}/action/{action.__name__}"


def zero(name: str) -> bytes | None:
    """The serialized message with every field at its default; None when the type is no installed message."""
    found = message_class(name)
    if found is None:
        return _EMPTY if is_promised(name) else None
    return serialize(found())


def zeros(name: str) -> list[bytes]:
    """The messages of a type, as `zero`: one, of an action three; none when the type is not installed."""
    parts = [f"{name}_{part}" for part in PARTS_OF_ACTIONS] if action_class(name) is not None else [name]
    found = [zero(part) for part in parts]
    return [each for each in found if each is not None] if None not in found else []


@cache
def frame_ids(of_class: Any) -> int:
    """How many frames a message begins with: 1 in its header, 2 with `child_frame_id` behind the header."""
    if of_class is None:
        return 0
    fields = [*of_class.get_fields_and_field_types().items()]
    if fields[:1] != [("header", "std_msgs/Header")]:
        return 0
    return 2 if fields[1:2] == [("child_frame_id", "string")] else 1


def in_frames(message: Any, frame: str, child_frame: str) -> Any:
    """The message, or a copy of it with the frames that it lacks."""
    lacks_frame = bool(frame) and not message.header.frame_id
    lacks_child = bool(child_frame) and frame_ids(message.__class__) > 1 and not message.child_frame_id
    if not lacks_frame and not lacks_child:
        return message
    filled = copy.copy(message)
    if lacks_frame:
        filled.header = copy.copy(message.header)
        filled.header.frame_id = frame
    if lacks_child:
        filled.child_frame_id = child_frame
    return filled


def serialize(message: Any) -> bytes:
    """The message as CDR with its header."""
    from rclpy.serialization import serialize_message  # noqa: PLC0415 - rclpy takes half a second to load

    return bytes(serialize_message(message))


def deserialize(data: bytes, of_class: Any) -> Any:
    """The message of that class in CDR."""
    from rclpy.serialization import deserialize_message  # noqa: PLC0415 - likewise

    return deserialize_message(data, of_class)
