"""Values of resources as messages of mauve_msgs."""

import time
from typing import Any

from builtin_interfaces.msg import Time

from mauve_msgs.msg import Value as ValueMessage
from mauve_rt.control.values import Value, definition_of
from mauve_rt.errors import MauveError

_NS = 1_000_000_000


def value_message(name: str, found: Value | MauveError, *, with_definition: bool) -> Any:
    """Value: of one poll of the resource or port `name`, or why there is none."""
    if isinstance(found, MauveError):
        return ValueMessage(name=name, problem=str(found))
    message = ValueMessage(name=name, resource=found.resource.name, type=found.resource.type, data=found.data)
    if with_definition:
        try:
            message.definition = definition_of(found.resource)
        except MauveError as error:
            message.problem = str(error)
    if found.writes:
        message.status = ValueMessage.WRITTEN
        message.writes = found.writes
        message.time_ns = found.time_ns
        message.age_ns = time.monotonic_ns() - found.time_ns
        stamp_ns = max(time.time_ns() - message.age_ns, 0)
        message.stamp = Time(sec=stamp_ns // _NS, nanosec=stamp_ns % _NS)
    return message
