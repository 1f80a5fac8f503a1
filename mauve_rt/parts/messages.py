"""ROS messages as Python parts name them: by class or by type name; and their serialized form."""

from typing import Any

from mauve_rt.parts.message_types import is_promised, message_class

__all__ = ["deserialize", "message_class", "serialize", "service_name", "type_name", "zero"]


_EMPTY = b"\0\1\0\0"  # CDR's header alone


def type_name(type_or_name: Any) -> str:
    """`geometry_msgs/msg/Point` of that class; a name is returned as it is.

    Raises:
        TypeError: neither a name nor a class of ROS messages.
    """
    if isinstance(type_or_name, str):
        return type_or_name
    if not isinstance(type_or_name, type) or not hasattr(type_or_name, "get_fields_and_field_types"):
        raise TypeError(f"expected a class of ROS messages or a type's name, found {type_or_name!r}")
    package = type_or_name.__module__.partition(".")[0]
    return f"{package}/msg/{type_or_name.__name__}"


def service_name(service: Any) -> str:
    """`std_srvs/srv/SetBool` of that class.

    Raises:
        TypeError: no class of a ROS service.
    """
    if not isinstance(service, type) or not hasattr(service, "Request") or not hasattr(service, "Response"):
        raise TypeError(f"expected a class of a ROS service, found {service!r}")
    package = service.__module__.partition(".")[0]
    return f"{package}/srv/{service.__name__}"


def zero(name: str) -> bytes | None:
    """The serialized message with every field at its default; None when the type is no installed message."""
    found = message_class(name)
    if found is None:
        return _EMPTY if is_promised(name) else None
    return serialize(found())


def serialize(message: Any) -> bytes:
    """The message as CDR with its header."""
    from rclpy.serialization import serialize_message  # noqa: PLC0415 - rclpy takes half a second to load

    return bytes(serialize_message(message))


def deserialize(data: bytes, of_class: Any) -> Any:
    """The message of that class in CDR."""
    from rclpy.serialization import deserialize_message  # noqa: PLC0415 - likewise

    return deserialize_message(data, of_class)
