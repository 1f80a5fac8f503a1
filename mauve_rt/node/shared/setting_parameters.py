"""The table of a node's settings as its ROS parameters: declared, typed, read-only where they are."""

from collections.abc import Mapping
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from mauve_rt.node.shared.settings import OF_RCLPY, Setting

_INT64_MAX = 2**63 - 1
_STRINGS = Parameter.Type.STRING_ARRAY


def declare_settings(node: Node, settings: Mapping[str, Setting]) -> dict[str, Any]:
    """Declare all of them; returns their values. What rclpy declares for every node is marked as well.

    Raises:
        Exception: of rclpy, for a value of another type or out of range.
    """
    values = {name: _declare(node, name, setting) for name, setting in settings.items()}
    for name, setting in OF_RCLPY.items():
        if not node.describe_parameter(name).read_only:
            node.set_descriptor(name, _descriptor(setting))
    return values


def _declare(node: Node, name: str, setting: Setting) -> Any:
    if not isinstance(setting.default, list):
        return node.declare_parameter(name, setting.default, _descriptor(setting)).value
    # rclpy takes an empty list for one of bytes, and rcl reads [] in a file as no value at all.
    value = node.declare_parameter(name, _STRINGS, ParameterDescriptor(type=_STRINGS.value)).value
    texts = list(setting.default if value is None else value)
    node.set_parameters([Parameter(name, _STRINGS, texts)])
    node.set_descriptor(name, _descriptor(setting))
    return texts


def _descriptor(setting: Setting) -> ParameterDescriptor:
    descriptor = ParameterDescriptor(
        type=_STRINGS.value
        if isinstance(setting.default, list)
        else Parameter.Type.from_parameter_value(setting.default).value,
        description=setting.description,
        additional_constraints=setting.constraints,
        read_only=setting.is_fixed,
    )
    low, high = setting.minimum, setting.maximum
    if low <= high < float("inf") or low > float("-inf"):
        if isinstance(setting.default, float):
            descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
        else:
            descriptor.integer_range = [
                IntegerRange(from_value=int(low), to_value=int(min(high, _INT64_MAX)))
            ]
    return descriptor
